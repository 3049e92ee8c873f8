"""The surface of a printed part: a regular grid of heights, as a touch meets it.

Surface frame: that of the part's face (origin at its first vertex, x along its first edge, z
outward; z = 0 is the face as designed). Grid frame: the same plane and z, its axes along the
printer's. mm. Where there is no plastic within the depth that was looked at, -inf.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

STEP_MM = 0.05  #: between two places of the grid
DEPTH_MM = 2.5  #: below the face that is looked at: deeper a touch does not reach
MARGIN_MM = 1.0  #: around the face: strings and blobs hang over its edges


@dataclass(frozen=True, slots=True)
class Coverage:
    """How much of a print a surface was made from."""

    beads: int  #: of the whole print
    within: int  #: of them, within the depth and the region
    samples: int  #: places at which a bead's height was worked out


@dataclass(frozen=True, slots=True, eq=False)
class PrintedSurface:
    """Heights of the highest plastic."""

    heights: NDArray[np.float32]  #: (ny, nx) mm, at origin + step (column, row)
    origin_mm: tuple[float, float]  #: x, y of heights[0, 0], grid frame
    step_mm: float
    T_surface_grid: Floats  #: (4, 4) a turn in the plane
    T_part_surface: Floats  #: (4, 4)
    coverage: Coverage

    @property
    def top_mm(self) -> float:
        """Height of the highest plastic."""
        return float(self.heights.max(initial=-np.inf))

    def heights_mm(self, points_mm: Floats) -> Floats:
        """Return the heights at points (n, 2) of the surface frame; -inf off the grid."""
        T = self.T_surface_grid
        at = ((points_mm - T[:2, 3]) @ T[:2, :2] - np.array(self.origin_mm)) / self.step_mm
        return interpolate(at, self.heights.shape, lambda i, j: self.heights[i, j])


def interpolate(
    at: Floats, shape: tuple[int, ...], height: Callable[[Index, Index], NDArray[np.floating]]
) -> Floats:
    """Return heights between the places of a grid, -inf off it.

    Bilinear between the grid's places, the nearest place's where a neighbour is empty.

    Parameters
    ----------
    at
        (n, 2) columns and rows, not whole.
    shape
        ny, nx of the grid.
    height
        Rows (m,), columns (m,) -> heights (m,) of places, -inf where there is nothing.
    """
    ny, nx = shape
    nearest = np.rint(at).astype(np.int64)
    inside = ((nearest >= 0) & (nearest < [nx, ny])).all(axis=1)
    j, i = nearest.clip(0, [nx - 1, ny - 1]).T
    found = np.where(inside, height(i, j), -np.inf).astype(np.float64)
    cell = np.floor(at).astype(np.int64).clip(0, [max(nx - 2, 0), max(ny - 2, 0)])
    if min(nx, ny) < 2:
        return found
    u, v = (at - cell).T
    j, i = cell.T
    corners = [height(i + a, j + b).astype(np.float64) for a in (0, 1) for b in (0, 1)]
    smooth = inside & np.isfinite(corners).all(axis=0)
    u, v = u[smooth].clip(0, 1), v[smooth].clip(0, 1)
    h00, h01, h10, h11 = (corner[smooth] for corner in corners)
    found[smooth] = (h00 * (1 - u) + h01 * u) * (1 - v) + (h10 * (1 - u) + h11 * u) * v
    return found
