"""Symbols and faces as triangles: for what is seen at a slant, over an edge.

Symbols -> (m, 3, 3) corners in the symbol's axes: its sides and its top. Loops of a plane
figure -> triangles that cover it. mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from probe.errors import SurfaceError
from probe.surface.symbols import SymbolReliefs

Array = NDArray[np.float64]


def symbol_triangles(symbols: SymbolReliefs, label: int) -> Array:
    """Return the sides and the top of a symbol, (m, 3, 3) mm; z from the face."""
    away, heights = symbols.relief.profile()
    if heights[-1] > 0:  # an upright wall down to the face
        away, heights = np.append(away, away[-1]), np.append(heights, 0.0)
    found = []
    tops = []
    for ring in symbols.rings[label]:
        tiers = [
            np.c_[ring.moved(float(d)), np.full(len(ring.supports), z)]
            for d, z in zip(away, heights, strict=True)
        ]
        tops.append(tiers[0])
        for upper, lower in pairwise(tiers):
            above, below = np.roll(upper, -1, axis=0), np.roll(lower, -1, axis=0)
            found += [np.stack([lower, below, above], 1), np.stack([lower, above, upper], 1)]
    found.append(np.concatenate(tops)[triangulate([top[:, :2] for top in tops])])
    return np.concatenate(found)


def triangulate(loops_mm: Sequence[Array]) -> NDArray[np.int64]:
    """Return triangles (m, 3) over the points of all loops, one loop after the other.

    Parameters
    ----------
    loops_mm
        (k, 2) each: the outer one counter-clockwise, holes clockwise.

    Raises
    ------
    SurfaceError
        When the triangles do not have the area of the loops: they cross, or run the wrong way.
    """
    from manifold3d import triangulate

    points = np.concatenate(list(loops_mm))
    found = np.asarray(triangulate(list(loops_mm), allow_convex=False), dtype=np.int64)
    areas = [_area(triangle) for triangle in points[found.reshape(-1, 3)]]
    covered, wanted = sum(areas), sum(map(_area, loops_mm))
    eps = 1e-9 * float(np.ptp(points, axis=0).max()) ** 2
    if abs(covered - wanted) > eps or min(areas, default=0.0) < -eps:
        raise SurfaceError(
            f"the triangles of a face cover {covered:.6g} of {wanted:.6g} mm^2",
            fix="give loops that do not cross, the outer one counter-clockwise, holes clockwise",
        )
    return found


def _area(loop: Array) -> float:
    x, y = (loop - loop[0]).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
