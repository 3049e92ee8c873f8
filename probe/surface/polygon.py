"""Points in a polygon with holes, convex or not, edges included.

Loops (k, 2) mm + points (n, 2) -> (n,) bool. By the parity of the edges that a ray from the
point crosses; a point within rounding of an edge is inside. (The sum of areas of thesis 6.3
is wrong on every non-convex face.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import SurfaceError

Array = NDArray[np.float64]

ON_EDGE = 1e-12  # share of the size that counts as on an edge
_BLOCK = 1 << 20  # pairs of points and edges at once


@dataclass(frozen=True, slots=True, eq=False)
class FaceRegion:
    """A region of the plane bounded by straight edges."""

    starts: Array  #: (e, 2) mm
    ends: Array  #: (e, 2) mm
    convex: bool  #: and without holes

    @property
    def box_mm(self) -> tuple[Array, Array]:
        """Lowest and highest x and y."""
        return self.starts.min(axis=0), self.starts.max(axis=0)

    def loops(self) -> list[Array]:
        """Return the corners (k, 2) of the outline and of every hole."""
        ends = np.flatnonzero((np.roll(self.starts, -1, axis=0) != self.ends).any(axis=1))
        rings = ends if len(ends) else np.array([len(self.starts) - 1])
        return np.split(self.starts, rings[:-1] + 1)

    def contains(self, points_mm: Array) -> NDArray[np.bool_]:
        """Whether points (n, 2) lie inside or on an edge."""
        step = max(1, _BLOCK // len(self.starts))
        parts = [points_mm[i : i + step] for i in range(0, max(1, len(points_mm)), step)]
        return np.concatenate([self._within(part) for part in parts])

    def distance_mm(self, points_mm: Array) -> Array:
        """Return how far points (n, 2) lie from the nearest edge."""
        along = self.ends - self.starts
        square = np.einsum("ij,ij->i", along, along)
        best = np.full(len(points_mm), np.inf)
        for a, d, s in zip(self.starts, along, square, strict=True):
            away = points_mm - a
            share = np.clip(away @ d / s, 0.0, 1.0)
            best = np.minimum(best, np.hypot(*(away - share[:, None] * d).T))
        return best

    def _within(self, points: Array) -> NDArray[np.bool_]:
        """Decide for all pairs of an edge (down) and a point (across)."""
        along = self.ends - self.starts
        size = np.hypot(*along.T)
        eps = ON_EDGE * float(np.abs(self.starts).max())
        outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / size[:, None]
        beyond = outward @ points.T - np.einsum("ij,ij->i", outward, self.starts)[:, None]
        if self.convex:
            inside: NDArray[np.bool_] = (beyond <= eps).all(axis=0)
            return inside
        y = points[:, 1]
        up = self.starts[:, 1:] <= y
        crossed = up != (self.ends[:, 1:] <= y)
        odd = np.logical_xor.reduce(crossed & ((beyond < 0) == up), axis=0)
        ahead = (along @ points.T - np.einsum("ij,ij->i", along, self.starts)[:, None]).T / size
        on = (np.abs(beyond.T) <= eps) & (ahead >= -eps) & (ahead <= size + eps)
        edged: NDArray[np.bool_] = odd | on.any(axis=1)
        return edged


def polygon(loops_mm: Sequence[ArrayLike]) -> FaceRegion:
    """Return the region inside the first loop and outside the others; each (k, 2), k >= 3, mm.

    Raises `SurfaceError` when a loop is no ring of finite points, or encloses no area.
    """
    rings = [np.asarray(loop, dtype=np.float64) for loop in loops_mm]
    if not rings or any(r.ndim != 2 or r.shape[1] != 2 or len(r) < 3 for r in rings):
        raise SurfaceError("a face has no outline", fix="give loops of three or more points (x, y)")
    if not all(np.isfinite(r).all() for r in rings):
        raise SurfaceError("a face's outline holds NaN or infinity", fix="give lengths in mm")
    starts = np.concatenate(rings)
    ends = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    along = ends - starts
    kept = np.hypot(*along.T) > 0
    starts, ends, along = starts[kept], ends[kept], along[kept]
    area = signed_area(rings[0])
    if area == 0.0:
        raise SurfaceError("a face's outline encloses no area", fix="give a polygon with an area")
    if area < 0 and len(rings) == 1:
        starts, ends, along = ends[::-1], starts[::-1], -along[::-1]
    before = np.roll(along, 1, axis=0)
    turns = before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0]
    angles = np.arctan2(turns, np.einsum("ij,ij->i", before, along))
    convex = len(rings) == 1 and bool((turns >= 0).all()) and abs(angles.sum() - 2 * np.pi) < 1e-6
    return FaceRegion(starts, ends, convex)


def signed_area(loop: Array) -> float:
    """Return the area of a polygon (n, 2), positive if it runs counter-clockwise."""
    if len(loop) < 3:
        return 0.0
    x, y = (loop - loop[0]).T
    return float(x[:-1] @ y[1:] - x[1:] @ y[:-1]) / 2
