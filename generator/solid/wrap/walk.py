"""Directed edges that leave every point once -> loops, each outer one with its holes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.plane.polygon import points_inside, signed_area

Loop = tuple[int, ...]


def loops_of(edges: Sequence[tuple[int, int]], place: str) -> list[Loop]:
    """Return the loops that directed edges make.

    Raises
    ------
    SolidError
        A point has not exactly one edge in and one out.
    """
    after = dict(edges)
    if len(after) != len(edges) or set(after) != set(after.values()):
        raise SolidError("the cut of a symbol does not close", place=place)
    loops = []
    while after:
        first, at = next(iter(after.items()))
        loop = [first]
        del after[first]
        while at != first:
            loop.append(at)
            at = after.pop(at)
        loops.append(tuple(loop))
    return loops


def with_holes(loops: Sequence[Loop], points: NDArray[np.float64]) -> list[tuple[Loop, ...]]:
    """Return each counter-clockwise loop with the clockwise ones that lie in it.

    Parameters
    ----------
    loops
        Of numbers into `points`; none crosses another.
    points
        (k, 2).
    """
    areas = [signed_area(points[list(loop)]) for loop in loops]
    outer = sorted((k for k, area in enumerate(areas) if area > 0), key=lambda k: areas[k])
    found: dict[int, list[Loop]] = {k: [loops[k]] for k in outer}
    for k, area in enumerate(areas):
        if area > 0:
            continue
        corner = points[list(loops[k][:1])]
        holder = next(  # the smallest that holds it
            (o for o in outer if points_inside(corner, [points[list(loops[o])]])[0]), None
        )
        if holder is None:
            raise SolidError("a hole lies outside of every outline")
        found[holder].append(loops[k])
    return [tuple(found[k]) for k in sorted(found)]
