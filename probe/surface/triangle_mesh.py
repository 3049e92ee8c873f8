"""How the triangles of a part hang together.

Corners (n, 3, 3) mm -> `TriangleMesh`: which triangles look out of a closed body, and which
lies beyond each edge.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import SurfaceError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class TriangleMesh:
    """Triangles of a part."""

    corners_mm: Array = field(repr=False)  #: (n, 3, 3) frame of the part
    outward: NDArray[np.bool_]  #: (n,) of a closed body, and looking out of it
    across: Index | None  #: (n, 3) triangle beyond each edge, a-b, b-c, c-a; None: not closed


def triangle_mesh(triangles_mm: ArrayLike, *, place: str = "") -> TriangleMesh:
    """Return a part of triangles (n, 3, 3), mm; `place` is named in errors.

    In a closed mesh every edge is met once each way, by exactly equal corners. A body (or a
    cavity) whose volume is negative looks inward.

    Raises
    ------
    SurfaceError
        A corner is no number.
    """
    corners = np.array(triangles_mm, dtype=np.float64).reshape(-1, 3, 3)
    if not np.isfinite(corners).all():
        raise SurfaceError("triangles hold NaN or infinity", fix="give lengths in mm", place=place)
    points = corners.reshape(-1, 3)
    order = np.lexsort(points.T)
    number = np.zeros(len(points), dtype=np.int64)
    x, y, z = points[order].T
    number[order[1:]] = np.cumsum((x[1:] != x[:-1]) | (y[1:] != y[:-1]) | (z[1:] != z[:-1]))
    index = number.reshape(-1, 3)
    across = _find_across(index)
    if across is None:
        return TriangleMesh(corners, np.zeros(len(corners), dtype=np.bool_), None)
    body = _bodies(index, order)
    moved = corners - points.mean(axis=0)
    volume = np.einsum("ij,ij->i", moved[:, 0], np.cross(moved[:, 1], moved[:, 2]))
    outward: NDArray[np.bool_] = (np.bincount(body, volume) > 0)[body]
    return TriangleMesh(corners, outward, across)


def _find_across(index: Index) -> Index | None:
    """Return the triangle beyond each edge (n, 3), itself at an edge of no length; None: open."""
    starts, ends = index.ravel(), np.roll(index, -1, axis=1).ravel()
    edges = np.flatnonzero(starts != ends)
    corners = int(index.max()) + 1
    ahead = starts[edges] * corners + ends[edges]
    back = ends[edges] * corners + starts[edges]
    order, other = sort_numbers(ahead), sort_numbers(back)
    if not np.array_equal(ahead[order], back[other]):
        return None
    across = np.arange(index.size) // 3
    across[edges[order]] = edges[other] // 3
    return across.reshape(-1, 3)


def _bodies(index: Index, order: Index) -> Index:
    """Return a number (n,) for each triangle, equal where triangles hang together by corners.

    `order` sorts the corners (3 n,) by their numbers in `index` (n, 3).
    """
    a, b, c = np.ascontiguousarray(index.T)
    number = index.ravel()[order]
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    triangle = order // 3
    label: Index = np.arange(len(starts))
    while True:
        least = np.minimum(np.minimum(label[a], label[b]), label[c])
        lowered: Index = np.minimum(label, np.minimum.reduceat(least[triangle], starts))
        lowered = lowered[lowered]
        if np.array_equal(lowered, label):
            found: Index = label[a]
            return found
        label = lowered


def sort_numbers(numbers: Index) -> Index:
    """Return the stable order of whole numbers from 0 on, by 16 bits at a time.

    Numpy counts numbers of 16 bits, and compares longer ones: three times as slow.
    """
    order = np.argsort((numbers & 0xFFFF).astype(np.uint16), kind="stable")
    left = int(numbers.max(initial=0)) >> 16
    shift = 16
    while left:
        digits = (numbers >> shift).astype(np.uint16)[order]
        order = order[np.argsort(digits, kind="stable")]
        left, shift = left >> 16, shift + 16
    return order
