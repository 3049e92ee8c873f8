"""The highest triangle of a mesh over each point, exactly.

Triangles (mm) + frame -> `MeshSurface`. Triangles are sorted into square bins once; a point asks
its bin's triangles alone, in C (heights.c; its form in numpy is in its tests). The side of an
edge is computed from the edge's lower corner for both triangles that share it, so a point on an
edge lies in at least one of them. Walls that stand upright cover no area and are left out, as are
the undersides of a closed mesh.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.compiled import POINTER, REAL, WHOLE, addresses, load_library
from probe.errors import SurfaceError

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

PAIRS = 1 << 25  # of bins and triangles at most
# A triangle's stretch over bins is taken too long by this share of a bin; rounding is 1e-12.
BIN_SLACK = 1e-6


@dataclass(frozen=True, eq=False)
class MeshSurface:
    """A height field of triangles.

    Their corners are in rising order (x, then y), so that a shared edge has the same direction in
    both of its triangles.
    """

    corners: Array = field(repr=False)  #: (n, 3, 3) mm, surface frame; all cover an area
    level: NDArray[np.bool_] = field(repr=False)
    """(n,) at z = 0, with a triangle beyond each edge that is seen from above, too."""
    solid_mm: Array = field(repr=False)  #: (m, 3, 3) all triangles, as they were given

    @cached_property
    def top_mm(self) -> float:
        """Highest corner."""
        return float(self.corners[:, :, 2].max())

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of the highest triangle over points (n, 2); -inf off the mesh."""
        bins, triangles = self.bins, self._triangles
        points = np.ascontiguousarray(points_mm, np.float64)
        heights = np.empty(len(points))
        first, *rest = addresses(
            points, bins.starts, bins.triangles, bins.level, triangles, heights
        )
        kernels().look_up_heights(
            len(points), first, *bins.low.tolist(), bins.side_mm, *bins.shape,
            *rest[:-1], self.top_mm, rest[-1],
        )  # fmt: skip
        return heights

    @cached_property
    def _triangles(self) -> Array:
        """Corners a and b, the edges ab, bc, ac, and the heights of each, (n, 13)."""
        (ax, bx, cx), (ay, by, cy), heights = self.corners.transpose(2, 1, 0)
        edges = [ax, ay, bx, by, bx - ax, by - ay, cx - bx, cy - by, cx - ax, cy - ay]
        return np.ascontiguousarray(np.concatenate([edges, heights]).T)

    @cached_property
    def bins(self) -> TriangleBins:
        """Triangles by place."""
        return bin_triangles(self.corners, self.level)


def mesh(
    triangles_mm: ArrayLike, T_surface_part: ArrayLike | None = None, *, place: str = ""
) -> MeshSurface:
    """Return the height field of triangles (n, 3, 3), mm, counter-clockwise from outside.

    `T_surface_part` (4, 4) leads from their frame to the surface frame; `place` is named in errors.

    Raises `SurfaceError` when a corner is no number, or no triangle covers an area seen along -z.
    """
    corners, outward, across = _read_triangles(triangles_mm, place)
    if T_surface_part is not None:
        corners = transform_points(corners, np.asarray(T_surface_part, dtype=np.float64))
    a, b, c = (corners[:, i, :2] for i in range(3))
    solid = corners
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    seen = (area > 0) | ((area < 0) & ~outward)
    if not seen.any():
        raise SurfaceError(
            "no triangle covers an area seen along -z",
            fix="give a part with an extent in x and y",
            place=place,
        )
    level = np.zeros(len(corners), dtype=np.bool_)
    if across is not None:
        level = np.logical_and.reduce(corners[:, :, 2].T == 0) & (area > 0)
        level[level] = (area[across[level]] > 0).all(axis=1)
    corners = corners[seen]
    order = np.lexsort((corners[:, :, 1], corners[:, :, 0]), axis=1)
    rising = np.take_along_axis(corners, order[:, :, None], axis=1)
    return MeshSurface(rising, level[seen], solid)


def transform_points(points: NDArray[Any], T: NDArray[Any]) -> Array:
    """Return points (..., 3) moved by T (4, 4), term by term: the same bits in every triangle."""
    x, y, z = np.moveaxis(points, -1, 0)
    rows = [T[i, 0] * x + T[i, 1] * y + T[i, 2] * z + T[i, 3] for i in range(3)]
    return np.stack(rows, axis=-1)


FOLDER = Path(__file__).parent


@lru_cache(maxsize=1)
def kernels() -> ctypes.CDLL:
    """Return the compiled look-up; raises `KernelsError`."""
    arguments = [WHOLE, POINTER, *[REAL] * 3, *[WHOLE] * 2, *[POINTER] * 4, REAL, POINTER]
    return load_library(FOLDER, {"look_up_heights": (None, arguments)})


def _read_triangles(triangles_mm: ArrayLike, place: str) -> tuple[Array, Mask, Index | None]:
    """Return corners (n, 3, 3), which look out of a closed body, and triangles beyond edges (n, 3).

    In a closed mesh every edge is met once each way, by exactly equal corners; otherwise the last
    is None. A body (or a cavity) whose volume is negative looks inward.
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
        return corners, np.zeros(len(corners), dtype=np.bool_), None
    body = _bodies(index, order)
    moved = corners - points.mean(axis=0)
    volume = np.einsum("ij,ij->i", moved[:, 0], np.cross(moved[:, 1], moved[:, 2]))
    outward: Mask = (np.bincount(body, volume) > 0)[body]
    return corners, outward, across


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


@dataclass(frozen=True, slots=True)
class TriangleBins:
    """Square bins over the plane, and the triangles that meet each of them."""

    low: Array  #: (2,) mm
    side_mm: float
    shape: tuple[int, int]  #: along x and y
    starts: Index  #: (bins + 1,) first of each bin in `triangles`
    triangles: Index
    level: Mask  #: (bins,) wholly under triangles at z = 0, which are left out


def bin_triangles(corners_mm: Array, level: Mask) -> TriangleBins:
    """Sort triangles (n, 3, 3), corners rising in x, into bins of a quarter of the usual triangle.

    Two or three lie in each. Those of `level` (n,) lie at z = 0 and have others beyond each of
    their edges: bins that these alone meet need none of them.
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
        if ((last - first + 1) * (highest - lowest + 1)).sum() <= PAIRS:
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
        slopes.append(np.divide(y[q] - y[p], run, out=none, where=run > BIN_SLACK))
    given = np.stack([*x, *y, *slopes])
    ax, bx, cx, ay, by, cy, ab, bc, ac = given.take(triangle, axis=1)
    left = np.maximum(strip - BIN_SLACK, ax)
    right = np.minimum(strip + (1 + BIN_SLACK), cx)
    ends = [ay + ac * (left - ax), ay + ac * (right - ax)]
    ends += [np.where(at < bx, ay + ab * (at - ax), by + bc * (at - bx)) for at in (left, right)]
    ends.append(np.where((left <= bx) & (bx <= right), by, ends[0]))
    ends.append(np.where(right == cx, cy, ends[0]))
    lowest, highest = ends[0], ends[0]
    for end in ends[1:]:
        lowest, highest = np.minimum(lowest, end), np.maximum(highest, end)
    lowest, highest = lowest - BIN_SLACK, highest + BIN_SLACK
    return triangle, strip, lowest.astype(np.int64), highest.astype(np.int64)
