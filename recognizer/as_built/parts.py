"""Touches of an object -> how each of its parts was printed, and what a person does about it."""

from __future__ import annotations

from collections.abc import Sequence

from generator.database.as_built import AsBuilt
from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from recognizer.as_built.estimate import FeltPrint, estimate_print
from recognizer.as_built.settings import ESTIMATE
from recognizer.as_built.verdict import PrintVerdict, judge_print
from recognizer.touch.lab import printer_of


def estimate_parts(
    felt: Sequence[FeltPrint], database: str, material: str
) -> tuple[list[tuple[AsBuilt, PrintVerdict]], list[str]]:
    """Return every part that was touched often enough with its verdict, and words on the others.

    Parameters
    ----------
    felt
        Touches of one object.
    database, material
        Where it is registered, and what it is printed of.

    Raises
    ------
    AsBuiltError
        No part was touched often enough, or none of a face that tells all.
    """
    with read_transaction(open_database(database, writable=False)) as connection:
        held = read_object(connection, felt[0].object)
    parts: dict[str, list[FeltPrint]] = {}
    for one in felt:
        parts.setdefault(one.part, []).append(one)
    told, few = [], []
    most = max(parts.values(), key=len)
    for name, touches in parts.items():
        if len(touches) < ESTIMATE.least and touches is not most:
            few.append(f"{name}: {len(touches)} touches are too few")
            continue
        found = estimate_print(
            touches, object_id=held.entry.object_id, printer=printer_of(held), material=material
        )
        told.append((found, judge_print(found, held.style.stroke_mm)))
    return told, few
