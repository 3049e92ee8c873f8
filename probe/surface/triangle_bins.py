"""Triangles sorted into square bins over the plane, so that a point looks at few of them.

Corners (n, 3, 3) mm -> `TriangleBins`. Every strip of bins along y takes from each triangle the
stretch that lies over it: bins hold the triangles that meet them, and hardly any other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.surface.settings import SURFACE
from probe.surface.triangle_mesh import sort_numbers

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class TriangleBins:
    """Square bins over the plane, and the triangles that meet each of them."""

    low: Array  #: (2,) mm
    side_mm: float
    shape: tuple[int, int]  #: along x and y
    starts: Index  #: (bins + 1,) first of each bin in `triangles`
    count: Index  #: (bins,) triangles of each
    triangles: Index
    level: Mask  #: (bins,) wholly under triangles at z = 0, which are left out

    def of(self, points: Array) -> tuple[Index, Index]:
        """Return the bins of the points that lie in any, and the numbers of these points."""
        x, y = points[:, 0] - self.low[0], points[:, 1] - self.low[1]
        x /= self.side_mm
        y /= self.side_mm
        within = (x >= 0) & (x <= self.shape[0]) & (y >= 0) & (y <= self.shape[1])
        inside = np.flatnonzero(within)
        i = np.minimum(x[inside].astype(np.int64), self.shape[0] - 1)
        j = np.minimum(y[inside].astype(np.int64), self.shape[1] - 1)
        return i * self.shape[1] + j, inside


def bin_triangles(corners_mm: Array, level: Mask) -> TriangleBins:
    """Sort triangles into bins of a quarter of the usual triangle: two or three in each.

    Parameters
    ----------
    corners_mm
        (n, 3, 3) whose corners rise in x.
    level
        (n,) which of them lie at z = 0 and have others beyond each of their edges: bins that
        these alone meet need none of them.
    """
    x, y = corners_mm.transpose(2, 1, 0)[:2]
    south, north = (end(end(y[0], y[1]), y[2]) for end in (np.minimum, np.maximum))
    low = np.array([x[0].min(), south.min()])
    extent = max(x[2].max() - low[0], north.max() - low[1])
    usual = np.sort(np.maximum(x[2] - x[0], north - south))[len(corners_mm) // 2]
    side = max(float(usual) / 4, float(extent) / 2048)
    while True:
        first, last, lowest, highest = (
            ((at - start) / side).astype(np.int64)
            for at, start in ((x[0], low[0]), (x[2], low[0]), (south, low[1]), (north, low[1]))
        )
        if ((last - first + 1) * (highest - lowest + 1)).sum() <= SURFACE.pairs:
            break
        side *= 1.5
    columns, rows = int(last.max()) + 1, int(highest.max()) + 1
    triangle, i, from_row, to_row = _cut_strips(
        (x - low[0]) / side, (y - low[1]) / side, first, last - first + 1
    )
    lowest = np.maximum(from_row, lowest[triangle])
    highest = np.minimum(to_row, highest[triangle])
    count = highest - lowest + 1
    ends = np.cumsum(count)
    cell = np.repeat(i * rows + lowest - (ends - count), count) + np.arange(len(ends) and ends[-1])
    triangle = np.repeat(triangle, count)
    met, steep = np.zeros((2, columns * rows), dtype=np.bool_)
    met[cell] = True
    steep[cell[~level[triangle]]] = True
    left = np.flatnonzero(steep[cell])
    cell, triangle = cell[left], triangle[left]
    order = sort_numbers(cell)
    many = np.bincount(cell, minlength=columns * rows)
    return TriangleBins(
        low=low,
        side_mm=side,
        shape=(columns, rows),
        starts=np.concatenate([[0], np.cumsum(many)]),
        count=many,
        triangles=triangle[order],
        level=met & ~steep,
    )


def _cut_strips(x: Array, y: Array, first: Index, wide: Index) -> tuple[Index, Index, Index, Index]:
    """Return the strips that triangles lie over: triangle, strip, lowest and highest bin in it.

    `x` and `y` are the corners (3, n) in bins; triangles lie over `wide` (n,) strips from the
    `first`. Strips are cut a little wide, so that rounding leaves no bin out.
    """
    triangle = np.repeat(np.arange(len(wide)), wide)
    strip = np.arange(len(triangle)) - np.repeat(np.cumsum(wide) - wide - first, wide)
    slopes = []  # an edge steeper than a strip is cut too wide spans it by its corners
    for p, q in ((0, 1), (1, 2), (0, 2)):
        run, none = x[q] - x[p], np.zeros(len(wide))
        slopes.append(np.divide(y[q] - y[p], run, out=none, where=run > SURFACE.beside_bin))
    given = np.stack([*x, *y, *slopes])
    ax, bx, cx, ay, by, cy, ab, bc, ac = given.take(triangle, axis=1)
    left = np.maximum(strip - SURFACE.beside_bin, ax)
    right = np.minimum(strip + (1 + SURFACE.beside_bin), cx)
    ends = [ay + ac * (left - ax), ay + ac * (right - ax)]
    ends += [np.where(at < bx, ay + ab * (at - ax), by + bc * (at - bx)) for at in (left, right)]
    ends.append(np.where((left <= bx) & (bx <= right), by, ends[0]))
    ends.append(np.where(right == cx, cy, ends[0]))
    lowest, highest = ends[0], ends[0]
    for end in ends[1:]:
        lowest, highest = np.minimum(lowest, end), np.maximum(highest, end)
    lowest, highest = lowest - SURFACE.beside_bin, highest + SURFACE.beside_bin
    return triangle, strip, lowest.astype(np.int64), highest.astype(np.int64)
