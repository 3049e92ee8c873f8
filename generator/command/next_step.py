"""The last line of `encode-object`: what a person does with what was really made."""

from __future__ import annotations

from pathlib import Path

from generator.pipeline import Encoded, MadeObject


def next_step(result: Encoded) -> str:
    """Return what to open, print and put together; empty where nothing was written."""
    if result.set_files:
        return _of_set(result)
    steps: list[str] = []
    for made in result.objects:
        steps += _of_object(made)
    return f"next: {', then '.join(steps)}" if steps else ""


def _of_set(result: Encoded) -> str:
    files = result.set_files
    plates = [file for file in files if file.suffix == ".3mf"]
    plain = [file for file in plates if not file.stem.endswith("-prusaslicer")]
    sheet = next((file for file in files if file.name.endswith("-build.html")), None)
    steps = []
    if plain:
        first = plain[0].name if len(plain) == 1 else f"{plain[0].name} ... {plain[-1].name}"
        lies = "as it lies" if len(plain) == 1 else "as they lie"
        if all(made.lying is None for made in result.objects):
            lies += ", backs down, symbols up, no supports, 100 % scale"
        where = f"{first} in {plain[0].parent} ({_twin_name(plain[0])} in PrusaSlicer)"
        steps.append(f"print {where} {lies}")
    if sheet:
        steps.append(f"put the objects together by {sheet}")
    elif not steps:
        return ""
    whole = [made for made in result.objects if made.lying is not None]
    if whole:
        steps.append("; ".join(f"{made.name}: {made.lying}" for made in whole))
    return "next: " + ", then ".join(steps)


def _of_object(made: MadeObject) -> list[str]:
    """Return the steps for one object alone."""
    sheet = next((file for file in made.files if file.name.endswith("-build.html")), None)
    steps = [f"open {sheet}"] if sheet else []
    printable = [f for suffix in (".3mf", ".stl") for f in made.files if f.suffix == suffix]
    plates = [f for f in printable if f.suffix == ".3mf" and "-prusaslicer" not in f.stem]
    if not printable:
        return steps
    chosen = plates or printable[:1]
    name = str(chosen[0]) if len(chosen) == 1 else f"{chosen[0]} ... {chosen[-1].name}"
    twin = chosen[0].with_name(_twin_name(chosen[0]))
    if twin in made.files:
        name += f" (in PrusaSlicer {twin.name})"
    if made.lying is None:
        steps.append(f"print {name} as it lies, backs down, symbols up, no supports, 100 % scale")
        return steps
    steps.append(f"print {name} as it lies, {made.lying}, 100 % scale")
    return steps


def _twin_name(plate: Path) -> str:
    return f"{plate.stem}-prusaslicer.3mf"
