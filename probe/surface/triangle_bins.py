"""Triangles sorted into square bins over the plane, so that a point looks at few of them.

Corners (n, 3, 3) mm -> `TriangleBins`. Every strip of bins along y takes from each triangle the
stretch that lies over it: bins hold the triangles that meet them, and hardly any other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.surface.settings import SURFACE

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
    (ax, _, cx), ys = corners_mm.transpose(2, 1, 0)[:2]
    low = np.column_stack([ax, np.minimum.reduce(ys)])
    high = np.column_stack([cx, np.maximum.reduce(ys)])
    start, extent = low.min(axis=0), float((high.max(axis=0) - low.min(axis=0)).max())
    sides = np.sort(np.maximum(*(high - low).T))
    side = max(float(sides[len(sides) // 2]) / 4, extent / 2048)
    while True:
        first = ((low - start) / side).astype(np.int64)
        last = ((high - start) / side).astype(np.int64)
        if (last - first + 1).prod(axis=1).sum() <= SURFACE.pairs:
            break
        side *= 1.5
    columns, rows = (last.max(axis=0) + 1).tolist()
    triangle, i, lowest, highest = _cut_strips((corners_mm[:, :, :2] - start) / side, first, last)
    count = highest - lowest + 1
    ends = np.cumsum(count)
    cell = np.repeat(i * rows + lowest - (ends - count), count) + np.arange(len(ends) and ends[-1])
    triangle = np.repeat(triangle, count)
    met, steep = np.zeros((2, columns * rows), dtype=np.bool_)
    met[cell] = True
    steep[cell[~level[triangle]]] = True
    left = np.flatnonzero(steep[cell])
    cell, triangle = cell[left], triangle[left]
    order = _order(cell)
    many = np.bincount(cell, minlength=columns * rows)
    return TriangleBins(
        low=start,
        side_mm=side,
        shape=(columns, rows),
        starts=np.concatenate([[0], np.cumsum(many)]),
        count=many,
        triangles=triangle[order],
        level=met & ~steep,
    )


def _cut_strips(at: Array, first: Index, last: Index) -> tuple[Index, Index, Index, Index]:
    """Return the strips that triangles lie over: triangle, strip, lowest and highest bin in it.

    `at` are the corners (n, 3, 2) and `first`, `last` the boxes (n, 2), in bins. Strips are cut
    a little wide, so that rounding leaves no bin out.
    """
    wide = last[:, 0] - first[:, 0] + 1
    triangle = np.repeat(np.arange(len(at)), wide)
    strip = np.arange(len(triangle)) - np.repeat(np.cumsum(wide) - wide - first[:, 0], wide)
    (ax, bx, cx), (ay, by, cy) = at.transpose(2, 1, 0)
    slopes = [
        np.divide(rise, run, out=np.zeros(len(at)), where=run > 0)
        for rise, run in ((by - ay, bx - ax), (cy - by, cx - bx), (cy - ay, cx - ax))
    ]
    ax, bx, cx, ay, by, ab, bc, ac = np.stack([ax, bx, cx, ay, by, *slopes])[:, triangle]
    left = np.maximum(strip - SURFACE.beside_bin, ax)
    right = np.minimum(strip + (1 + SURFACE.beside_bin), cx)
    ends = [ay + ac * (left - ax), ay + ac * (right - ax)]
    ends += [np.where(x < bx, ay + ab * (x - ax), by + bc * (x - bx)) for x in (left, right)]
    ends.append(np.where((left <= bx) & (bx <= right), by, ends[0]))
    lowest = np.minimum.reduce(ends) - SURFACE.beside_bin
    highest = np.maximum.reduce(ends) + SURFACE.beside_bin
    return (
        triangle,
        strip,
        np.maximum(lowest.astype(np.int64), first[triangle, 1]),
        np.minimum(highest.astype(np.int64), last[triangle, 1]),
    )


def _order(cell: Index) -> Index:
    """Return the stable order of whole numbers below 2^32, by halves: numpy counts short ones."""
    order = np.argsort((cell & 0xFFFF).astype(np.uint16), kind="stable")
    return order[np.argsort((cell >> 16).astype(np.uint16)[order], kind="stable")]
