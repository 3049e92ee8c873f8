"""Facets of the CAD kernel -> polyhedron with round faces. Lengths in mm.

A facet is a planar face, one of a run that unrolls, or a triangle of a face that stays blank.
Points that are one within the tolerance of a solid are joined; triangles without area go.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.polyhedron.developable import developable_from
from generator.polyhedron.read.settings import MODEL
from generator.polyhedron.read.soup import weld
from generator.polyhedron.winged import Face, Polyhedron, polyhedron

Loops = list[list[int]]


def polyhedron_of_facets(found: dict[str, Any], kind: str) -> Polyhedron:
    """Return a solid some of whose faces are round, with notes on how and on what stays blank.

    Parameters
    ----------
    found
        What `curved.curved_faces` returns.
    kind
        Of the polyhedron.

    Raises
    ------
    ShapeError
        The facets are no solid: walls thinner than the chord errors, a damaged model.
    """
    points, faces, kept = _weld(np.array(found["points"], dtype=np.float64), found["faces"])
    named = [
        Face(found["names"][old], tuple(tuple(loop) for loop in loops))
        for old, loops in zip(kept, faces, strict=True)
    ]
    try:
        solid = polyhedron(kind, points, named)
    except ShapeError as error:
        raise _facet_error(error, found) from None
    number = {old: new for new, old in enumerate(kept)}
    surfaces = tuple(
        developable_from(surface | {"facets": [number[k] for k in surface["facets"]]})
        for surface in found["surfaces"]
    )
    blank = tuple(number[k] for k in found["blank"] if k in number)
    notes = (*solid.notes, *found["notes"], *_blank_notes(found["kinds"], _places(found)))
    return replace(solid, notes=notes, surfaces=surfaces, blank=blank)


def _weld(
    points: NDArray[np.float64], faces: list[Loops]
) -> tuple[NDArray[np.float64], list[Loops], list[int]]:
    """Join near points; return points, the faces that are left and their old numbers."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    welded, number = weld(points, MODEL.facet_weld * size)
    if len(welded) == len(points):
        return points, faces, list(range(len(faces)))
    left, kept = [], []
    for old, loops in enumerate(faces):
        joined = [_without_repeats([int(number[v]) for v in loop]) for loop in loops]
        joined = [loop for loop in joined if len(loop) >= 3]
        if joined and len(joined) == len(loops):
            left.append(joined)
            kept.append(old)
    used = np.unique([v for loops in left for loop in loops for v in loop])
    return welded[used], [[np.searchsorted(used, loop).tolist() for loop in f] for f in left], kept


def _without_repeats(loop: list[int]) -> list[int]:
    return [v for k, v in enumerate(loop) if v != loop[k - 1]]


def _facet_error(error: ShapeError, found: dict[str, Any]) -> ShapeError:
    """Say of facets what a message about vertices says of a polyhedron."""
    cause = error.cause.strip().splitlines()
    first = cause[1].strip().partition(";")[0] if len(cause) > 1 else error.cause
    where = f"{error.place}: " if error.place and len(cause) == 1 else ""
    return ShapeError(
        f"its round faces, divided into {len(found['faces'])} facets to {found['error_mm']:g} mm, "
        f"make no solid: {where}{first}",
        fix="check that the model is one valid solid, fill inner voids, make walls thicker than "
        "that, or set scale for a larger part",
    )


def _places(found: dict[str, Any]) -> dict[str, str]:
    """Return the middle of the box of each blank face, by name."""
    points = np.array(found["points"], dtype=np.float64)
    corners: dict[str, list[int]] = {}
    for name, loops in zip(found["names"], found["faces"], strict=True):
        own = name.partition(".")[0]
        if own in found["kinds"]:
            corners.setdefault(own, []).extend(v for loop in loops for v in loop)
    places = {}
    for name, numbers in corners.items():
        low, high = points[numbers].min(axis=0), points[numbers].max(axis=0)
        places[name] = "({:.4g}, {:.4g}, {:.4g})".format(*((low + high) / 2).tolist())
    return places


def _blank_notes(kinds: dict[str, str], places: dict[str, str]) -> list[str]:
    by_kind: dict[str, list[str]] = {}
    for name, surface in kinds.items():
        by_kind.setdefault(surface, []).append(name)
    notes = []
    for surface, names in by_kind.items():
        listed = [f"{name} about {places[name]}" if name in places else name
                  for name in names[: MODEL.listed_blank]]  # fmt: skip
        if len(names) > MODEL.listed_blank:
            listed.append(f"{len(names) - MODEL.listed_blank} more")
        what = f"faces {', '.join(listed)} stay" if len(names) > 1 else f"face {listed[0]} stays"
        why = "outline" if surface in ("cylinder", "cone") else "surface"
        notes.append(f"{what} blank: the {why} ({surface}) does not unroll into a simple strip")
    return notes
