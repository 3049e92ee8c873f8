"""The highest triangle of a mesh over each asked point, exactly.

Triangles (mm) + frame -> Surface. Triangles are sorted into square bins once; a point looks
at its bin's triangles alone. The side of an edge is computed from the edge's lower corner
for both triangles that share it, so a point on an edge lies in at least one of them and
nothing falls through. Walls that stand upright cover no area and are left out, as are the
undersides of a closed mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import SurfaceError
from probe.surface.settings import SURFACE

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_BLOCK = 1 << 20  # pairs of points and triangles looked at together


@dataclass(frozen=True, eq=False)
class MeshSurface:
    """A height field of triangles.

    Corners of a triangle are in rising order (x, then y), so that a shared edge has the same
    direction in both of its triangles.
    """

    corners: Array = field(repr=False)  #: (n, 3, 3) mm, surface frame; all cover an area
    solid_mm: Array = field(repr=False)  #: (m, 3, 3) all triangles, as they were given

    @cached_property
    def top_mm(self) -> float:
        """Highest corner."""
        return float(self.corners[:, :, 2].max())

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of the highest triangle over points (n, 2); -inf beside all."""
        bins = self._bins
        found = np.full(len(points_mm), -np.inf)
        cell, asked = bins.of(points_mm)
        count = bins.starts[cell + 1] - bins.starts[cell]
        asked, cell, count = asked[count > 0], cell[count > 0], count[count > 0]
        ends = np.cumsum(count)
        first = 0
        while first < len(asked):
            done = int(ends[first - 1]) if first else 0
            last = max(first + 1, int(np.searchsorted(ends, done + _BLOCK, side="right")))
            part = slice(first, last)
            offsets = ends[part] - count[part] - done
            number = np.repeat(np.arange(last - first), count[part])
            listed = np.arange(len(number)) - offsets[number] + bins.starts[cell[part]][number]
            z = self._over(bins.triangles[listed], points_mm[asked[part]], number)
            found[asked[part]] = np.maximum.reduceat(z, offsets)
            first = last
        lowered: Array = np.minimum(found, self.top_mm)  # a mean of equal heights may round up
        return lowered

    def _over(self, triangle: Index, points: Array, number: Index) -> Array:
        """Return the height of triangles over a point each; -inf where it is not under it."""
        x, y = points[number].T
        (ax, bx, cx), (ay, by, cy), (az, bz, cz) = self._columns[:, :, triangle]
        # Twice the signed areas of the three parts; each edge runs up the order a < b < c.
        ab = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        bc = (cx - bx) * (y - by) - (cy - by) * (x - bx)
        ac = (cx - ax) * (y - ay) - (cy - ay) * (x - ax)
        left = (ab >= 0) & (bc >= 0) & (ac <= 0)
        right = (ab <= 0) & (bc <= 0) & (ac >= 0)
        weight = ab + bc - ac
        with np.errstate(divide="ignore", invalid="ignore"):
            z = (ab * cz + bc * az - ac * bz) / weight
        return np.where((left | right) & (weight != 0), z, -np.inf)

    @cached_property
    def _columns(self) -> Array:
        """Corners as (coordinate, corner, n)."""
        return np.ascontiguousarray(self.corners.transpose(2, 1, 0))

    @cached_property
    def _bins(self) -> _Bins:
        return _bin_triangles(self.corners)


def mesh(
    triangles_mm: ArrayLike, T_surface_part: ArrayLike | None = None, *, place: str = ""
) -> MeshSurface:
    """Return the height field of triangles.

    Parameters
    ----------
    triangles_mm
        (n, 3, 3) corners; those of closed parts counter-clockwise seen from outside.
    T_surface_part
        (4, 4) from their frame to the surface frame.
    place
        Named in errors.

    Raises
    ------
    SurfaceError
        When no triangle covers an area seen along -z.
    """
    corners = np.array(triangles_mm, dtype=np.float64).reshape(-1, 3, 3)
    if not np.isfinite(corners).all():
        raise SurfaceError("triangles hold NaN or infinity", fix="give lengths in mm", place=place)
    outward = _looks_outward(corners)
    if T_surface_part is not None:
        # Term by term: the same corner gives the same bits in all its triangles.
        T = np.asarray(T_surface_part, dtype=np.float64)
        x, y, z = np.moveaxis(corners, -1, 0)
        rows = [T[i, 0] * x + T[i, 1] * y + T[i, 2] * z + T[i, 3] for i in range(3)]
        corners = np.stack(rows, axis=-1)
    a, b, c = (corners[:, i, :2] for i in range(3))
    solid = corners
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    corners = corners[(area > 0) | ((area < 0) & ~outward)]
    if not len(corners):
        raise SurfaceError(
            "no triangle covers an area seen along -z",
            fix="give a part with an extent in x and y",
            place=place,
        )
    order = np.lexsort((corners[:, :, 1], corners[:, :, 0]), axis=1)
    return MeshSurface(np.take_along_axis(corners, order[:, :, None], axis=1), solid)


def _looks_outward(corners: Array) -> NDArray[np.bool_]:
    """Whether each triangle belongs to a closed body and looks out of it; (n,).

    In a closed mesh every edge is met once each way, by exactly equal corners. A body (or a
    cavity) whose volume is negative looks inward.
    """
    points = corners.reshape(-1, 3)
    order = np.lexsort(points.T)
    number = np.zeros(len(points), dtype=np.int64)
    number[order[1:]] = np.cumsum((np.diff(points[order], axis=0) != 0).any(axis=1))
    index = number.reshape(-1, 3)
    starts, ends = index.ravel(), np.roll(index, -1, axis=1).ravel()
    kept = starts != ends
    ahead = np.sort(starts[kept] * len(points) + ends[kept])
    back = np.sort(ends[kept] * len(points) + starts[kept])
    if not np.array_equal(ahead, back):
        return np.zeros(len(corners), dtype=bool)
    body = _bodies(index)
    moved = corners - points.mean(axis=0)
    volume = np.einsum("ij,ij->i", moved[:, 0], np.cross(moved[:, 1], moved[:, 2]))
    outward: NDArray[np.bool_] = (np.bincount(body, volume) > 0)[body]
    return outward


def _bodies(index: Index) -> Index:
    """Return a number (n,) for each triangle, equal where triangles hang together by corners."""
    label = np.arange(int(index.max()) + 1)
    while True:
        least = label[index].min(axis=1)
        before = label.copy()
        np.minimum.at(label, index, least[:, None])
        label = label[label]
        if np.array_equal(label, before):
            return label[index[:, 0]]


@dataclass(frozen=True, slots=True)
class _Bins:
    """Square bins over the plane, and the triangles whose box meets each of them."""

    low: Array  # (2,) mm
    side_mm: float
    shape: tuple[int, int]  # along x and y
    starts: Index  # (bins + 1,) first of each bin in `triangles`
    triangles: Index

    def of(self, points: Array) -> tuple[Index, Index]:
        """Return the bins of the points that lie in any, and the numbers of these points."""
        at = (points - self.low) / self.side_mm
        inside = np.flatnonzero(((at >= 0) & (at <= self.shape)).all(axis=1))
        at = np.minimum(at[inside].astype(np.int64), np.array(self.shape) - 1)
        return at[:, 0] * self.shape[1] + at[:, 1], inside


def _bin_triangles(corners: Array) -> _Bins:
    """Sort triangles into bins of a quarter of the usual triangle: two or three in each."""
    low, high = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
    start, extent = low.min(axis=0), float((high.max(axis=0) - low.min(axis=0)).max())
    sides = np.sort(np.maximum(*(high - low).T))
    side = max(float(sides[len(sides) // 2]) / 4, extent / 2048)
    while True:
        first = ((low - start) / side).astype(np.int64)
        last = ((high - start) / side).astype(np.int64)
        wide = last - first + 1
        count = wide.prod(axis=1)
        if count.sum() <= SURFACE.pairs:
            break
        side *= 1.5
    shape = last.max(axis=0) + 1
    triangle = np.repeat(np.arange(len(corners)), count)
    within = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
    i, j = np.divmod(within, wide[triangle, 1])
    i, j = i + first[triangle, 0], j + first[triangle, 1]
    met = _meets_bin(corners, triangle, start, side, i, j)
    triangle, cell = triangle[met], (i * shape[1] + j)[met]
    order = np.argsort(cell, kind="stable")
    starts = np.searchsorted(cell[order], np.arange(int(shape.prod()) + 1))
    return _Bins(start, side, (int(shape[0]), int(shape[1])), starts, triangle[order])


def _meets_bin(
    corners: Array, triangle: Index, start: Array, side: float, i: Index, j: Index
) -> NDArray[np.bool_]:
    """Whether a triangle meets a bin: no edge has the whole bin on its outer side."""
    met = np.ones(len(triangle), dtype=bool)
    middle_x, middle_y = start[0] + (i + 0.5) * side, start[1] + (j + 0.5) * side
    half = side * (0.5 + 1e-9)
    for k in range(3):
        a, b, c = (corners[:, (k + m) % 3, :2] for m in range(3))
        nx, ny = b[:, 1] - a[:, 1], a[:, 0] - b[:, 0]
        inner = nx * (c[:, 0] - a[:, 0]) + ny * (c[:, 1] - a[:, 1])
        sign = np.sign(inner)
        nx, ny = nx * sign, ny * sign
        reach = half * (np.abs(nx) + np.abs(ny))
        offset = reach - nx * a[:, 0] - ny * a[:, 1]
        met &= nx[triangle] * middle_x + ny[triangle] * middle_y + offset[triangle] >= 0
    return met
