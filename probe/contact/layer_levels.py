"""What each cell of the pad meets: a few levels of matter, each with its share of the cell.

Patch + a plane near the plate -> Levels. The points of a patch are sorted by their depth below
the surface, seen from the plane, into at most `LAYER_LEVELS.count` bins. A cell of the pad takes
the points under a bell about its centre (the quadratic spline, three cells wide): every level has
a share and a mean depth there. Bells of neighbours overlap and add to 1, so how strokes lie to the
grid hardly matters: the stiffness of a strip 3.5 cells wide varies by 0.04 %, by 2.3 % where each
cell looks at itself alone.

The bell widens an edge by its variance, dx^2/4; `layer_influence` takes that off again on the
way to the base.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from probe.contact.layer_influence import Influence
from probe.contact.layer_patch import Cells, LayerPatch, centres_mm, lattice
from probe.contact.plate import PlatePose
from probe.contact.settings import LAYER_LEVELS

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """Depths are seen from a plane: the height of the surface minus the height of the plane."""

    grid: Influence
    plane: PlatePose
    cells: Cells  #: (n,) cells of the grid that meet matter, flat numbers, ascending
    levers: Array  #: (3, n) R = [1, y/L, -x/L] at their centres
    shares: Array  #: (levels, n) of the bell, their sum is at most 1
    depths_mm: Array  #: (levels, n) mean depth; -inf where the share is 0
    left_out_mm: Array  #: (grid cells,) greatest depth of matter below the look

    @property
    def reach_mm(self) -> float:
        """L, which makes turns lengths."""
        return self.grid.sensor.reach_mm

    def image(self, values: Array) -> Array:
        """Return values (n,) of the cells on the whole grid (rows, columns), 0 elsewhere."""
        image = np.zeros(self.grid.rows * self.grid.columns)
        image[self.cells] = values
        return image.reshape(self.grid.rows, self.grid.columns)


@dataclass(frozen=True, slots=True)
class DepthWindow:
    """What was looked at: matter that stands over a plane that lies deeper by the floor."""

    plane: PlatePose  #: about where the plate comes to rest
    floor_mm: float  #: seen from the plane, <= 0

    def depths_mm(self, patch: LayerPatch) -> Array:
        """Return how high the points (samples, cells) of a patch stand over the plane."""
        plane = self.plane
        depths = patch.heights_mm - plane.heights_mm(patch.centres_mm[patch.cells])
        depths -= (plane.heights_mm(patch.offsets_mm) - plane.z_mm)[:, None]
        return depths


def levels_of(
    patch: LayerPatch, grid: Influence, look: DepthWindow, earlier: Sequence[DepthWindow] = ()
) -> Levels:
    """Return the levels of the cells of a patch that were sampled in full.

    Parameters
    ----------
    patch
        Heights under the matrix.
    grid
        The pad's cells: those of the patch and a ring about them.
    look
        Points below are left out.
    earlier
        What these saw is one more level where it lies deeper than the look.
    """
    depth = look.depths_mm(patch)
    top = float(depth.max())
    floor_mm = min(look.floor_mm, top)
    step = max(top - floor_mm, LAYER_LEVELS.level * max(1.0, abs(top))) / LAYER_LEVELS.count
    near = depth >= floor_mm
    number = np.where(
        near, np.clip((depth - floor_mm) / step, 0, LAYER_LEVELS.count - 1), LAYER_LEVELS.count + 1
    )
    number = number.astype(np.int8)
    for other in earlier:
        number[(other.depths_mm(patch) >= other.floor_mm) & ~near] = LAYER_LEVELS.count
    inside = number <= LAYER_LEVELS.count
    used = np.flatnonzero(
        np.bincount(number.ravel(), minlength=LAYER_LEVELS.count + 2)[: LAYER_LEVELS.count + 1]
    )

    samples, n = depth.shape
    sorted_points = np.empty((samples, 2, len(used), n))
    np.equal(number[:, None, :], used[:, None], out=sorted_points[:, 0])
    np.multiply(
        sorted_points[:, 0], np.where(inside, depth, 0.0)[:, None, :], out=sorted_points[:, 1]
    )
    spread = _bells(samples) @ sorted_points.reshape(samples, -1)

    row, column = np.divmod(patch.cells, patch.shape[1])
    first = row * grid.columns + column  # of the nine grid cells about it, the upper left
    sums = np.zeros((2 * len(used), grid.rows * grid.columns))
    for k, part in enumerate(spread.reshape(9, 2 * len(used), n)):
        sums[:, first + (k // 3) * grid.columns + k % 3] += part
    shares, moments = sums.reshape(2, len(used), -1)
    cells = np.flatnonzero(shares.sum(axis=0) > LAYER_LEVELS.least)
    shares, moments = shares[:, cells], moments[:, cells]
    none = np.full_like(shares, -np.inf)
    depths = np.divide(moments, shares, out=none, where=shares > 0)

    left_out = np.full(grid.rows * grid.columns, -np.inf)
    seen = patch.highest_mm - look.plane.heights_mm(patch.centres_mm)
    seen[patch.cells] = np.where(near, -np.inf, depth).max(axis=0)
    left_out.reshape(grid.rows, -1)[1:-1, 1:-1] = seen.reshape(patch.shape)
    x, y = centres_mm(grid.rows, grid.columns, grid.dx_mm)[cells].T / grid.sensor.reach_mm
    return Levels(
        grid=grid,
        plane=look.plane,
        cells=cells,
        levers=np.stack([np.ones_like(x), y, -x]),
        shares=shares,
        depths_mm=depths,
        left_out_mm=left_out,
    )


@lru_cache(maxsize=4)
def _bells(samples: int) -> Array:
    """Return the weights (9, samples) of a cell's points in the bells of the nine about it."""
    x, y = lattice(samples).T
    at = np.array([-1.0, 0.0, 1.0])
    along_x, along_y = _bell(x - at[:, None]), _bell(y + at[:, None])  # rows run against y
    return (along_y[:, None, :] * along_x[None, :, :]).reshape(9, samples) / samples


def _bell(t: Array) -> Array:
    """Return the quadratic spline at distances t, in cells."""
    away = np.abs(t)
    return np.where(away <= 0.5, 0.75 - away**2, np.maximum(1.5 - away, 0.0) ** 2 / 2)
