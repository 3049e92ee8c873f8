"""Bodies of simple shape that tests press: their highest point is the origin, mm."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import MultiPoint


@dataclass(frozen=True)
class Formula:
    """A surface z = height(x, y) of arrays (n,)."""

    height: Callable[[np.ndarray, np.ndarray], np.ndarray]
    top_mm: float = 0.0

    def heights_mm(self, points_mm: np.ndarray) -> np.ndarray:
        return self.height(*points_mm.T)


def sphere(radius_mm: float = 20.0) -> Formula:
    """Return the upper half of a ball; sqrt(R^2 - r^2) - R without its cancellation."""

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        square = x * x + y * y
        rest = radius_mm**2 - square
        depth = square / (radius_mm + np.sqrt(np.maximum(rest, 0.0)))
        return np.where(rest >= 0, -depth, -math.inf)

    return Formula(height)


def paraboloid(radius_mm: float) -> Formula:
    """Return z = -r^2 / 2R: the body of the closed formulas of contact."""
    return Formula(lambda x, y: -(x * x + y * y) / (2 * radius_mm))


def half_plane(floor_mm: float = -math.inf) -> Formula:
    """Return a flat face that ends at a straight edge: matter where x <= 0."""
    return Formula(lambda x, y: np.where(x <= 0, 0.0, floor_mm))


def block(low: Sequence[float], high: Sequence[float]) -> np.ndarray:
    """Return the twelve triangles (12, 3, 3) of a box, counter-clockwise from outside."""
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners[[t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]]


def nib_region(strokes: Sequence, width_mm: float, unit_mm: float = 1.0) -> shapely.Geometry:
    """Return what an octagonal nib covers on its way along strokes between nodes."""
    turns = (np.arange(8) + 0.5) * math.pi / 4
    nib = width_mm / 2 / math.cos(math.pi / 8) * np.stack([np.cos(turns), np.sin(turns)], 1)
    once = dict.fromkeys(strokes)  # GEOS loses a polygon where another one comes twice
    ends = [np.concatenate([unit_mm * np.array(end) + nib for end in stroke]) for stroke in once]
    return shapely.union_all([MultiPoint(points).convex_hull for points in ends])
