"""The highest triangle of a mesh over each asked point, exactly.

Triangles (mm) + frame -> Surface. Triangles are sorted into square bins once; a point looks
at its bin's triangles alone. The side of an edge is computed from the edge's lower corner
for both triangles that share it, so a point on an edge lies in at least one of them and
nothing falls through. Walls that stand upright cover no area and are left out, as are the
undersides of a closed mesh.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.compiled import addresses
from probe.errors import SurfaceError
from probe.surface.heights import compiled_kernels
from probe.surface.triangle_bins import TriangleBins, bin_triangles
from probe.surface.triangle_mesh import triangle_mesh

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
    level: NDArray[np.bool_] = field(repr=False)
    """(n,) at z = 0, with a triangle beyond each edge that is seen from above, too."""
    solid_mm: Array = field(repr=False)  #: (m, 3, 3) all triangles, as they were given

    @cached_property
    def top_mm(self) -> float:
        """Highest corner."""
        return float(self.corners[:, :, 2].max())

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of the highest triangle over points (n, 2); -inf beside all."""
        library = compiled_kernels()
        if library is not None:
            return self._look_up(library, points_mm)
        bins = self._bins
        found = np.full(len(points_mm), -np.inf)
        cell, asked = bins.of(points_mm)
        found[asked[bins.level[cell]]] = 0.0  # as each triangle there says, exactly
        count = bins.count[cell]
        met = np.flatnonzero(count)
        asked, cell, count = asked[met], cell[met], count[met]
        ends = np.cumsum(count)
        first = 0
        while first < len(asked):
            done = int(ends[first - 1]) if first else 0
            last = max(first + 1, int(np.searchsorted(ends, done + _BLOCK, side="right")))
            part = slice(first, last)
            offsets = ends[part] - count[part] - done
            listed = np.repeat(bins.starts[cell[part]] - offsets, count[part])
            listed += np.arange(len(listed))
            x, y = (np.repeat(points_mm[asked[part], i], count[part]) for i in (0, 1))
            z = self._over(bins.triangles[listed], x, y)
            found[asked[part]] = np.maximum.reduceat(z, offsets)
            first = last
        lowered: Array = np.minimum(found, self.top_mm)  # a mean of equal heights may round up
        return lowered

    def _look_up(self, library: ctypes.CDLL, points_mm: Array) -> Array:
        """Return the same heights, compiled."""
        bins, triangles = self._bins, self._triangles
        points = np.ascontiguousarray(points_mm, np.float64)
        heights = np.empty(len(points))
        first, *rest = addresses(
            points, bins.starts, bins.triangles, bins.level, triangles, heights
        )
        library.look_up_heights(
            len(points), first, *bins.low.tolist(), bins.side_mm, *bins.shape,
            *rest[:-1], self.top_mm, rest[-1],
        )  # fmt: skip
        return heights

    def _over(self, triangle: Index, x: Array, y: Array) -> Array:
        """Return the height of triangles over a point each; -inf where it is not under it."""
        edges, heights = self._columns
        ax, ay, bx, by, ab_x, ab_y, bc_x, bc_y, ac_x, ac_y = edges.take(triangle, axis=1)
        # Twice the signed areas of the three parts; each edge runs up the order a < b < c.
        ab = ab_x * (y - ay) - ab_y * (x - ax)
        bc = bc_x * (y - by) - bc_y * (x - bx)
        ac = ac_x * (y - ay) - ac_y * (x - ax)
        left = (ab >= 0) & (bc >= 0) & (ac <= 0)
        right = (ab <= 0) & (bc <= 0) & (ac >= 0)
        under = np.flatnonzero(left | right)
        ab, bc, ac = ab[under], bc[under], ac[under]
        az, bz, cz = heights.take(triangle[under], axis=1)
        weight = ab + bc - ac
        found = np.full(len(triangle), -np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            found[under] = np.where(weight != 0, (ab * cz + bc * az - ac * bz) / weight, -np.inf)
        return found

    @cached_property
    def _columns(self) -> tuple[Array, Array]:
        """Corners a and b and the edges ab, bc, ac as (10, n), and the heights (3, n)."""
        (ax, bx, cx), (ay, by, cy), heights = self.corners.transpose(2, 1, 0)
        edges = [ax, ay, bx, by, bx - ax, by - ay, cx - bx, cy - by, cx - ax, cy - ay]
        return np.stack(edges), np.ascontiguousarray(heights)

    @cached_property
    def _triangles(self) -> Array:
        """Corners a and b, the edges and the heights of each, (n, 13)."""
        return np.ascontiguousarray(np.concatenate(self._columns).T)

    @cached_property
    def _bins(self) -> TriangleBins:
        return bin_triangles(self.corners, self.level)


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
    part = triangle_mesh(triangles_mm, place=place)
    corners, across = part.corners_mm, part.across
    if T_surface_part is not None:
        # Term by term: the same corner gives the same bits in all its triangles.
        T = np.asarray(T_surface_part, dtype=np.float64)
        x, y, z = np.moveaxis(corners, -1, 0)
        rows = [T[i, 0] * x + T[i, 1] * y + T[i, 2] * z + T[i, 3] for i in range(3)]
        corners = np.stack(rows, axis=-1)
    a, b, c = (corners[:, i, :2] for i in range(3))
    solid = corners
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    seen = (area > 0) | ((area < 0) & ~part.outward)
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
