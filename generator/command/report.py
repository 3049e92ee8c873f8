"""What the commands say: results to stdout, messages to stderr, as text or as JSON."""

from __future__ import annotations

import json
import os
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from encoded_objects.errors import EncodedObjectsError

if TYPE_CHECKING:
    from rich.table import Table

    from generator.pipeline import Encoded, Made
    from generator.spec.problem import Problem

WIDTH = 120  # characters of a table that is written to a file


def write(text: str) -> None:
    """Write text to stdout."""
    sys.stdout.write(text if text.endswith("\n") else text + "\n")


def write_json(value: Any) -> None:
    """Write one JSON object to stdout."""
    write(json.dumps(value, indent=2))


def table(*titles: str) -> Table:
    """Return an empty table with these columns; `made for` and `file` may be broken."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    made = Table(box=SIMPLE_HEAD, pad_edge=False)
    for title in titles:
        made.add_column(title, no_wrap=title not in ("made for", "file"), overflow="fold")
    return made


def show(table: Table) -> None:
    """Write a table to stdout."""
    from rich.console import Console

    Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH).print(table)


def version(*, as_json: bool) -> None:
    """Say which version this is."""
    from importlib.metadata import version as installed

    number = installed("encoded-objects")
    if as_json:
        write_json({"version": number})
    else:
        write(f"encode-object {number}")


def error(problem: EncodedObjectsError, *, as_json: bool) -> None:
    """Say what is wrong: to stderr, or as JSON to stdout."""
    problems = _problems(problem)
    if as_json:
        write_json(
            {
                "error": {
                    "kind": type(problem).__name__,
                    "exit_code": problem.exit_code,
                    "problems": [_problem_values(each) for each in problems],
                }
            }
        )
        return
    for number, each in enumerate(problems):
        if number:
            sys.stderr.write("\n")
        message(str(each), "error:", "red")


def encoded(result: Encoded, *, dry_run: bool, as_json: bool) -> None:
    """Say what was made."""
    if as_json:
        write_json(_encoded_values(result, dry_run))
        return
    for made in result.objects:
        write(_object_text(made, dry_run))
        for warning in made.warnings:
            message(f"warning: {made.name}: {warning}", "warning:", "yellow")
    share = result.used_cells / max(1, result.rows * result.columns)
    array = f"array {result.rows} x {result.columns}, {share:.0%} of its cells in use"
    if dry_run:
        write(f"\n{array} then; nothing was written ({result.seconds:.1f} s)")
        return
    if result.set_files:
        folder = result.set_files[0].parent
        write(f"set:\n  {folder}{os.sep}  {', '.join(file.name for file in result.set_files)}")
    write(f"\n{array}; registered in {_shown(result.database)} ({result.seconds:.1f} s)")
    if following := _next_step(result.objects):
        write(following)


def _object_text(made: Made, dry_run: bool) -> str:
    """Return a few lines on one object."""
    verb = "made"
    if dry_run:
        verb = "would be made"
    elif made.skipped:
        verb = "registered before, its files are unchanged: nothing to do"
    elif made.reused:
        verb = "registered before, same cells"
    counts = f"{_number(made.faces, 'face')}, {_number(made.symbols, 'symbol')}"
    parts, places = _number(made.parts, "part"), _number(made.places, "place")
    lines = [f"{made.name}: {verb}; {counts}, {parts}, {places} told apart by touch"]
    for face in made.face_reports:
        size, least = (
            " x ".join(f"{v:.3g}" for v in each) for each in (face.size_mm, face.smallest_mm)
        )
        lines.append(
            f"  {face.name:6} {size} mm, {_number(face.symbols, 'symbol')}, "
            f"{_number(face.places, 'place')}; it could be as small as {least} mm"
        )
    for folder in dict.fromkeys(file.parent for file in made.files):
        lines.append(f"  {folder}{os.sep}  {_file_list(folder, made.files)}")
    return "\n".join(lines)


def _file_list(folder: Path, files: tuple[Path, ...]) -> str:
    """Return the files of a folder: by name, or how many where there are several of a kind."""
    kinds: dict[str, list[str]] = {}
    for file in files:
        if file.parent == folder:
            kinds.setdefault(file.suffix, []).append(file.name)
    return ", ".join(
        names[0] if len(names) == 1 else f"{len(names)} {kind.lstrip('.')} ({names[0]}, ...)"
        for kind, names in kinds.items()
    )


def _next_step(objects: tuple[Made, ...]) -> str:
    """Return what a person does next: look, and print."""
    files = [file for made in objects for file in made.files]
    picture = next((file for file in files if file.suffix == ".png"), None)
    printable = next((f for suffix in (".3mf", ".stl") for f in files if f.suffix == suffix), None)
    steps = [f"open {picture}"] if picture else []
    if printable:
        twin = printable.with_name(f"{printable.stem}-prusaslicer.3mf")
        name = f"{printable} (in PrusaSlicer {twin.name})" if twin in files else str(printable)
        steps.append(f"print {name} as it lies, symbols up, 100 % scale")
    return "next: " + ", then ".join(steps) if steps else ""


def _number(count: int, thing: str) -> str:
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def _encoded_values(result: Encoded, dry_run: bool) -> dict[str, Any]:
    return {
        "objects": [
            {
                "name": made.name,
                "faces": made.faces,
                "symbols": made.symbols,
                "files": [str(file) for file in made.files],
                "places": made.places,
                "parts": made.parts,
                "reused": made.reused,
                "skipped": made.skipped,
                "face_reports": [asdict(face) for face in made.face_reports],
                "warnings": list(made.warnings),
            }
            for made in result.objects
        ],
        "set_files": [str(file) for file in result.set_files],
        "database": _shown(result.database),
        "array": {
            "rows": result.rows,
            "columns": result.columns,
            "used_cells": result.used_cells,
        },
        "dry_run": dry_run,
        "seconds": round(result.seconds, 3),
    }


def _problems(error: EncodedObjectsError) -> tuple[Problem, ...]:
    from generator.spec.problem import Problem, SpecError

    if isinstance(error, SpecError):
        return error.problems
    return (Problem(error.cause, error.fix, file=error.place),)


def _problem_values(problem: Problem) -> dict[str, Any]:
    mark = problem.mark
    return {
        "place": problem.place,
        "file": mark.source.name if mark else None,
        "line": mark.line if mark else None,
        "column": mark.column if mark else None,
        "cause": problem.cause,
        "fix": problem.fix,
    }


def message(text: str, word: str, colour: str = "yellow") -> None:
    """Write a message to stderr; its kind in colour on a terminal."""
    if sys.stderr.isatty() and not os.environ.get("NO_COLOR"):
        text = text.replace(word, typer.style(word, fg=colour, bold=True), 1)
    sys.stderr.write(text + "\n")


def _shown(url: str) -> str:
    """Return a database's URL as it may be printed."""
    from generator.database.url import without_password

    return without_password(url)
