"""Do plane polygons overlap? Triangles that touch do not.

Polygons with holes (mm) -> triangles -> separating axes. Two triangles overlap if along every
edge normal of both they reach into each other by more than a tolerance that scales with the
problem; so faces that share an edge or a vertex of the net never count, whatever the rounding.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from manifold3d import triangulate
from numpy.typing import NDArray

from generator.plane.polygon import is_convex, triangle_areas

Points = NDArray[np.float64]
Triangles = NDArray[np.float64]  # (n, 3, 2), counter-clockwise


def triangles_of(loops: Sequence[Points]) -> Triangles:
    """Return triangles (n, 3, 2) that fill a polygon: outer loop, then holes."""
    points = np.concatenate(loops)
    if len(loops) == 1 and is_convex(points):
        k = np.arange(1, len(points) - 1)
        corners = points[np.column_stack([np.zeros_like(k), k, k + 1])]
    else:
        corners = points[np.asarray(triangulate([np.asarray(loop) for loop in loops]))]
    size = float(np.ptp(points, axis=0).max())
    return np.asarray(corners[triangle_areas(corners) > 0.5e-12 * size * size])


def overlap(first: Triangles, second: Triangles, tolerance: float) -> bool:
    """Whether any triangle of the first set reaches into one of the second (lengths in mm)."""
    second = _near_triangles(second, first, tolerance)
    first = _near_triangles(first, second, tolerance)
    if len(first) == 0 or len(second) == 0:
        return False
    gap = np.maximum(_separation(first, second), _separation(second, first).T)
    return bool((gap < -tolerance).any())


def _near_triangles(triangles: Triangles, others: Triangles, tolerance: float) -> Triangles:
    """Return the triangles that reach into the bounding box of the others."""
    if len(others) == 0:
        return triangles[:0]
    low, high = others.min(axis=(0, 1)) + tolerance, others.max(axis=(0, 1)) - tolerance
    near = (triangles.max(axis=1) > low) & (triangles.min(axis=1) < high)
    return np.asarray(triangles[near.all(axis=1)])


def _separation(first: Triangles, second: Triangles) -> Points:
    """Return the widest gap (n, m) that an edge normal of the first shows to the second, mm."""
    side = np.roll(first, -1, axis=1) - first
    normal = np.stack([side[..., 1], -side[..., 0]], axis=-1)
    normal /= np.sqrt(np.einsum("nki,nki->nk", side, side))[..., None]
    foot = np.einsum("nki,nki->nk", normal, first)
    reach = np.einsum("nki,mci->nkmc", normal, second).min(axis=-1)
    return np.asarray((reach - foot[..., None]).max(axis=1))
