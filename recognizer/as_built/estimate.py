"""Touches of a part -> how it was printed: scale both ways, skew and stroke width.

A print takes a point p of the part to S p (`recognizer.touch.as_built`). Place and turn of a touch
are not known, but its strain is: E = (S'S - 1) / 2 does not change with a turn. A touch gives E of
its face, P' E P with P the face's axes in x and y of the part (along z it is as designed), which is
linear in E, so touches of all faces of a part go into one weighted least squares. A touch may be
plainly wrong, so errors follow Student's t, by reweighing (K. L. Lange et al., J. Amer. Stat.
Assoc. 84 (1989) 881); the covariance comes from the spread of the touches, not from their own ones
(P. J. Huber, Proc. 5th Berkeley Symp. 1 (1967) 221). Part frame; mm, rad.

Measurements: `tests/campaigns/as_built.py`, tables in `docs/recognizer.md`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from generator.database.as_built import PARAMETERS, AsBuilt, read_as_built, write_as_built
from generator.database.open import existing_database, open_database
from generator.database.read import list_objects, read_object
from generator.database.transaction import read_transaction, write_transaction
from recognizer.as_built.verdict import PrintVerdict, judge_print
from recognizer.errors import AsBuiltError
from recognizer.touch.lab import printer_of

Array = NDArray[np.float64]

LEAST_TOUCHES = 10  #: without which there is no estimate
ENOUGH_TOUCHES = 25  #: that users are asked for
FREEDOM = 4.0  #: of the t distribution of errors: one bad touch in ten changes little
MEDIAN_CHI2 = 3.357  #: of the four numbers of a touch
ROUNDS = 50  #: of reweighing, at most
SETTLED = 1e-9  #: change of a strain that ends them
UNSEEN = 1e-6  #: of the largest eigenvalue: below it a direction was not touched
#: standard deviations of `PARAMETERS` that no number of touches reduces: templates differ from
#: real readings
ALWAYS = (0.0006, 0.0006, 0.0005, 0.1)
#: least ones between the parts of one printer and material
BETWEEN = (0.0015, 0.0015, 0.001, 0.1)


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredPrint:
    """Strain and stroke width of the print under one touch."""

    seq: int
    object: str
    face: str
    part: str  #: name of the part that bears the face
    axes: Array  #: (2, 2) P: columns are the face's x and y axes, in x and y of the part
    strain: Array  #: (3,) xx, yy and xy of (F'F - 1) / 2, F from the face's design to its print
    stroke_mm: float
    covariance: Array  #: (4, 4) of strain and stroke_mm


def estimate_print(
    measured: Sequence[MeasuredPrint],
    *,
    object_id: int | None = None,
    printer: str = "",
    material: str = "",
) -> AsBuilt:
    """Return how a part was printed, under these keys of the database.

    Raises
    ------
    AsBuiltError
        There are too few touches, or none of a face that defines scale both ways and skew.

    Examples
    --------
    >>> touch = MeasuredPrint(0, "Cube", "F1", "Cube-F1", np.eye(2), np.array([-0.02, 0, 0]), 1.4,
    ...                   np.eye(4) * 1e-6)
    >>> found = estimate_print([touch] * 25)
    >>> round(found.scale_x, 4), found.scale_y, found.skew_rad
    (0.9798, 1.0, 0.0)
    """
    if len(measured) < LEAST_TOUCHES:
        raise AsBuiltError(
            f"{len(measured)} touches of it were read, {LEAST_TOUCHES} are the least",
            fix=f"record {ENOUGH_TOUCHES}-{2 * ENOUGH_TOUCHES} touches all over the part",
            place=measured[0].part if measured else "",
        )
    design = np.array([_design(one.axes) for one in measured])  # (n, 4, 4)
    values = np.array([[*one.strain, one.stroke_mm] for one in measured])
    information = np.linalg.inv([one.covariance for one in measured])
    _refuse_unseen(design, measured[0].part)
    weights = np.ones(len(measured))
    best = np.full(4, np.inf)
    for _ in range(ROUNDS):
        pull = design.swapaxes(1, 2) @ information * weights[:, None, None]
        normal = (pull @ design).sum(axis=0)
        before, best = best, np.linalg.solve(normal, (pull @ values[..., None]).sum(axis=0)[:, 0])
        left = values - design @ best
        square = np.einsum("ni,nij,nj->n", left, information, left)
        size = max(float(np.median(square)) / MEDIAN_CHI2, 1e-12)
        if np.abs(best - before).max() < SETTLED:
            break
        weights = (FREEDOM + 4) / (FREEDOM + square / size)
    each = (pull @ left[..., None])[..., 0]
    meat = each.T @ each
    bread = np.linalg.inv(normal - 2 / ((FREEDOM + 4) * size) * meat)
    spread = bread @ meat @ bread * len(measured) / (len(measured) - 4)  # four unknowns
    scale_x, scale_y = math.sqrt(1 + 2 * best[0]), math.sqrt(1 + 2 * best[1])
    by = np.diag([1 / scale_x, 1 / scale_y, 2 / (scale_x * scale_y), 1.0])  # to first order
    return AsBuilt(
        object_id=object_id,
        part=measured[0].part,
        printer=printer,
        material=material,
        scale_x=scale_x,
        scale_y=scale_y,
        skew_rad=math.asin(2 * best[2] / (scale_x * scale_y)),
        stroke_mm=float(best[3]),
        covariance=by @ spread @ by + np.diag(np.square(ALWAYS)),
        touches=len(measured),
    )


def estimate_printer(parts: Sequence[AsBuilt]) -> AsBuilt:
    """Return the expected print of an untouched part, by one or more parts of its printer.

    Their spread is measured, and no less than `BETWEEN`.
    """
    values = np.array([[getattr(one, name) for name in PARAMETERS] for one in parts])
    mean, count = values.mean(axis=0), len(parts)
    between = np.square(BETWEEN)
    if count > 1:
        between = np.maximum(between, values.var(axis=0, ddof=1))
    known = np.sum([one.covariance for one in parts], axis=0) / count**2
    return AsBuilt(
        object_id=None,
        part=None,
        printer=parts[0].printer,
        material=parts[0].material,
        **dict(zip(PARAMETERS, mean.tolist(), strict=True)),
        covariance=known + np.diag(between) * (1 + 1 / count),
        touches=sum(one.touches for one in parts),
    )


def estimate_parts(
    measured: Sequence[MeasuredPrint], database: str, material: str
) -> tuple[list[tuple[AsBuilt, PrintVerdict]], list[str]]:
    """Return every part of an object with enough touches and its verdict, messages on the others.

    Raises
    ------
    AsBuiltError
        No part has enough touches, or none of a face that defines all numbers.
    """
    with read_transaction(open_database(database, writable=False)) as connection:
        held = read_object(connection, measured[0].object)
    parts: dict[str, list[MeasuredPrint]] = {}
    for one in measured:
        parts.setdefault(one.part, []).append(one)
    estimated, few = [], []
    most = max(parts.values(), key=len)
    for name, touches in parts.items():
        if len(touches) < LEAST_TOUCHES and touches is not most:
            few.append(f"{name}: {len(touches)} touches are too few")
            continue
        found = estimate_print(
            touches, object_id=held.entry.object_id, printer=printer_of(held), material=material
        )
        estimated.append((found, judge_print(found, held.style.stroke_mm)))
    return estimated, few


def keep_prints(database: str | Path, prints: Sequence[AsBuilt]) -> AsBuilt:
    """Store parts of one printer and material; return the expected print of that printer.

    One transaction; it replaces what was stored of these parts and of the printer and material.

    Raises
    ------
    DatabaseError
        The database cannot be written.
    """
    of = prints[0].printer, prints[0].material
    with write_transaction(existing_database(str(database))) as connection:
        for one in prints:
            write_as_built(connection, one)
        stored = [
            one
            for entry in list_objects(connection)
            for one in read_as_built(connection, entry.object_id)
            if one.part is not None and (one.printer, one.material) == of
        ]
        printer = estimate_printer(stored)
        write_as_built(connection, printer)
    return printer


def _design(axes: Array) -> Array:
    """Return (4, 4): strain and stroke of a face by xx, yy, xy of its part's E and the stroke."""
    (xa, xb), (ya, yb) = axes
    whole = np.eye(4)
    whole[0, :3] = xa * xa, ya * ya, 2 * xa * ya
    whole[1, :3] = xb * xb, yb * yb, 2 * xb * yb
    whole[2, :3] = xa * xb, ya * yb, xa * yb + ya * xb
    return whole


def _refuse_unseen(design: Array, part: str) -> None:
    """Refuse touches of faces that do not define all of E, such as one wall of a whole body."""
    values, axes = np.linalg.eigh((design.swapaxes(1, 2) @ design).sum(axis=0)[:3, :3])
    if values[0] > UNSEEN * values[-1]:
        return
    names = "x", "y", "skew"
    hidden = values <= UNSEEN * values[-1]
    unseen = [name for name, row in zip(names, axes, strict=True) if abs(row[hidden]).max() > 0.5]
    raise AsBuiltError(
        f"the faces that were touched do not tell {' and '.join(unseen)}",
        fix="touch also its top, or a wall that runs the other way",
        place=part,
    )
