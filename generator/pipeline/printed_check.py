"""Specs -> what becomes of every symbol on a printer, before anything is printed.

Objects are placed and built as a run would make them, sliced and printed in simulation;
nothing is registered, and nothing is written but one picture for each object.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from generator.database.open import open_if_there
from generator.database.transaction import read_transaction
from generator.pipeline.choose import choose_array, lab_of
from generator.pipeline.files import parts_of
from generator.pipeline.place import place_in_turn
from generator.pipeline.plan import ObjectPlan
from generator.pipeline.progress import Progress, no_progress, part_of_progress
from generator.printed.check import PrintedCheck, check_parts, check_png
from generator.printed.faults import PrintFaults
from generator.printed.slicer import find_slicer, print_profile, profile_of_printer
from generator.solid import Part
from generator.spec import ObjectSpec


@dataclass(frozen=True, slots=True)
class PrintedObject:
    """One object on one printer."""

    name: str
    check: PrintedCheck
    symbols: tuple[str, ...]  #: names of the alphabet's symbols, by label
    picture: Path | None  #: None where no symbol is seen


def check_printed(
    specs: Sequence[ObjectSpec],
    *,
    folder: Path | None = None,
    database: str | None = None,
    profile: str = "",
    faults: PrintFaults | None = None,
    progress: Progress = no_progress,
) -> tuple[PrintedObject, ...]:
    """Print objects in simulation and compare every symbol with its design.

    Parameters
    ----------
    folder
        For the pictures, in place of the specs' own.
    database
        URL in place of the specs' own; it is read, if it is there.
    profile
        Name of the print profile or an exported file; else that of each spec's printer.
    faults
        Of the machine; none if left out.

    Raises
    ------
    GeneratorError
        As `encode` does; `PrintError` also when PrusaSlicer is missing.
    """
    find_slicer()
    profiles = [
        print_profile(profile) if profile else profile_of_printer(one.printer) for one in specs
    ]
    built = _build(specs, database or specs[0].database, part_of_progress(progress, 0.0, 0.2))
    found = []
    for number, ((plan, parts), chosen) in enumerate(zip(built, profiles, strict=True)):
        share = [0.2 + 0.8 * (number + k) / len(built) for k in (0, 1)]
        check = check_parts(
            parts, chosen, faults=faults, progress=part_of_progress(progress, *share)
        )
        symbols = tuple(glyph.name for glyph in plan.alphabet.glyphs)
        picture = None
        if check.tiles:
            place = folder or plan.spec.folder
            place.mkdir(parents=True, exist_ok=True)
            picture = place / f"{plan.spec.name}-printed.png"
            picture.write_bytes(
                check_png(f"{plan.spec.name} on {chosen.name}", check.tiles, symbols)
            )
        found.append(PrintedObject(plan.spec.name, check, symbols, picture))
    return tuple(found)


def _build(
    specs: Sequence[ObjectSpec], url: str, progress: Progress
) -> list[tuple[ObjectPlan, tuple[Part, ...]]]:
    """Return the parts of each object, placed after the ones before it."""
    engine = open_if_there(url, writable=False)
    built = []
    with read_transaction(engine) if engine else nullcontext() as connection:
        choice = choose_array(specs, lab_of(specs, connection), connection)
        places = place_in_turn(connection, choice.plans)
        for number, plan in enumerate(choice.plans):
            progress(f"building {plan.spec.name}", number / len(specs))
            built.append((plan, parts_of(plan, next(places).layout)[0]))
    return built
