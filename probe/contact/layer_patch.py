"""Heights of the surface under the pad's cells, and the levels of matter that each cell meets.

Surface + cells + place -> LayerPatch. Every cell is sampled at 4 points; a cell whose
neighbourhood is level needs no more, one that can touch is sampled in full (16 points by default).
The points of a cell are a lattice whose columns and rows are all different, and neighbouring cells
sample different quarters of it, so a stroke along an axis is seen down to dx / 16.

Patch + a plane near the plate -> Levels. The points of a patch are sorted by their depth below
the surface, seen from the plane, into at most `MOST_LEVELS` bins. A cell of the pad takes
the points under a bell about its centre (the quadratic spline, three cells wide): every level has
a share and a mean depth there. Bells of neighbours overlap and add to 1, so the place of strokes on
the grid hardly matters: the stiffness of a strip 3.5 cells wide varies by 0.04 %, by 2.3 % where
each cell takes its own points alone. The bell widens an edge by its variance, dx^2/4;
`layer_influence` takes that off again on the way to the base. Thesis 4.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch, heights_at
from probe.contact.layer_influence import Influence
from probe.contact.plate import PlatePose
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]
Cells = NDArray[np.intp]
Number = TypeVar("Number", np.float64, np.bool_)

COARSE = 4  # first samples per cell
SAMPLES = (16, 64, 256)  # per cell that is sampled in full
LEVEL_MM = 1e-9  # heights that differ less are level
SEARCH_STEP_MM = 0.01  # along the lines that search for strokes between the samples
SEARCH_LINES = 16  # across the matrix, each way
MOST_LEVELS = 8  #: of a cell that stands on a step; one where all that counts is flat
ONE_LEVEL = 1e-12  # mm, or of the greatest depth; depths that differ less are one level
LEAST_SHARE = 1e-3  # of a bell, below which a cell meets nothing


@dataclass(frozen=True, slots=True, eq=False)
class LayerPatch:
    """Heights under the matrix: cells in flat numbers, row * columns + column, row 0 on top."""

    surface: HeightMap
    sensor: SensorType
    touch: Touch  #: its x, y and theta; force, tilt and wrist have no meaning here
    cells_per_tactel: int
    offsets_mm: Array  #: (samples, 2) points of a cell from its centre, sensor frame
    coarse_mm: Array  #: (all cells,) height of the first sample
    highest_mm: Array  #: (all cells,) of the samples
    level: NDArray[np.bool_]  #: (all cells,) the cell and its neighbours are level
    cells: Cells  #: (n,) cells sampled in full, ascending
    heights_mm: Array  #: (samples, n) their heights

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of cells."""
        n = self.cells_per_tactel
        return self.sensor.rows * n, self.sensor.columns * n

    @property
    def dx_mm(self) -> float:
        """Side of a cell."""
        return self.sensor.pitch_mm / self.cells_per_tactel

    @property
    def centres_mm(self) -> Array:
        """Centres (all cells, 2) of the cells, sensor frame."""
        return centres_mm(*self.shape, self.dx_mm)

    def with_cells(self, cells: Cells) -> LayerPatch:
        """Return the patch with these cells sampled as well."""
        new = np.setdiff1d(cells, self.cells, assume_unique=True)
        if not len(new):
            return self
        fine = np.repeat(self.coarse_mm[None, new], len(self.offsets_mm), axis=0)
        rough = np.flatnonzero(~self.level[new])
        points = self.centres_mm[new[rough]] + self.offsets_mm[:, None, :]
        fine[:, rough] = heights_at(self.surface, self.touch, points)
        if not len(self.cells):
            return replace(self, cells=new, heights_mm=fine)
        both = np.concatenate([self.cells, new])
        order = np.argsort(both, kind="stable")
        heights = np.concatenate([self.heights_mm, fine], axis=1)[:, order]
        return replace(self, cells=both[order], heights_mm=heights)

    def neighbours(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the cells of a mask (all cells,) and the eight around each."""
        return _join_neighbours(mask.reshape(self.shape), np.logical_or).ravel()


def patch_under(
    surface: HeightMap,
    sensor: SensorType,
    touch: Touch,
    *,
    cells_per_tactel: int = 4,
    samples: int = 16,
) -> LayerPatch:
    """Return the first samples under the matrix; no cell is sampled in full yet.

    Raises `ContactError` when the number of samples per cell is not 16, 64 or 256, the surface
    gives a height that is no number, or carries strokes too thin to be seen.
    """
    if samples not in SAMPLES:
        raise ContactError(
            f"{samples} samples per cell, allowed are {', '.join(map(str, SAMPLES))}",
            fix="take 16 for a touch, 64 for a reference",
        )
    shape = sensor.rows * cells_per_tactel, sensor.columns * cells_per_tactel
    dx = sensor.pitch_mm / cells_per_tactel
    coarse = heights_at(surface, touch, _coarse_points(*shape, dx, samples))
    highest = coarse.max(axis=0)
    high = _join_neighbours(highest.reshape(shape), np.maximum)
    low = _join_neighbours(coarse.min(axis=0).reshape(shape), np.minimum)
    _refuse_hidden(surface, sensor, touch, high, low, dx / samples)
    return LayerPatch(
        surface=surface,
        sensor=sensor,
        touch=touch,
        cells_per_tactel=cells_per_tactel,
        offsets_mm=lattice(samples) * dx,
        coarse_mm=coarse[0],
        highest_mm=highest,
        level=(high <= low + LEVEL_MM).ravel(),
        cells=np.zeros(0, dtype=np.intp),
        heights_mm=np.zeros((samples, 0)),
    )


@lru_cache(maxsize=16)
def centres_mm(rows: int, columns: int, dx_mm: float) -> Array:
    """Return the centres (rows * columns, 2) of a grid of cells about the origin."""
    x = (np.arange(columns) - (columns - 1) / 2) * dx_mm
    y = ((rows - 1) / 2 - np.arange(rows)) * dx_mm
    centres = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    centres.setflags(write=False)
    return centres


@lru_cache(maxsize=4)
def lattice(samples: int) -> Array:
    """Return points (samples, 2) of a unit cell about 0: the lattice with the widest gaps."""
    i = np.arange(samples)
    best, widest = i, -1
    for step in range(1, samples, 2):
        across = i * step % samples
        dx, dy = np.minimum(i, samples - i)[1:], np.minimum(across, samples - across)[1:]
        shortest = int((dx**2 + dy**2).min())
        if shortest > widest:
            best, widest = across, shortest
    return (np.stack([i, best], axis=-1) + 0.5) / samples - 0.5


def _refuse_hidden(
    surface: HeightMap, sensor: SensorType, touch: Touch, high: Array, low: Array, finest_mm: float
) -> None:
    """Refuse a surface whose top is under the matrix and was seen by no point.

    Where the first samples missed the top, it is a blank place, strokes thinner than the points are
    apart, or the top of something round. The last rises over the highest point seen about it by
    less than what was seen there differs.
    """
    seen, top = float(high.max()), surface.top_mm
    if top <= seen + LEVEL_MM:
        return
    points = _search_lines(*sensor.half_mm)
    heights = heights_at(surface, touch, points)
    highest = int(heights.argmax())
    found, at = float(heights[highest]), points[highest]
    rows, columns = high.shape
    row = min(int((0.5 - at[1] / (2 * sensor.half_mm[1])) * rows), rows - 1)
    column = min(int((0.5 + at[0] / (2 * sensor.half_mm[0])) * columns), columns - 1)
    near, lowest = float(high[row, column]), float(low[row, column])
    differ = near - lowest if lowest > -np.inf else 0.0
    if found - seen > 0.5 * min(top - seen, sensor.overlay.height_mm) and found - near > differ:
        raise ContactError(
            f"strokes that rise to {found:g} mm lie between the points, at least "
            f"{finest_mm:.2g} mm apart, that were looked at (the highest stands at {seen:g} mm)",
            fix="take more cells per tactel or more samples per cell, or a wider stroke",
        )


@lru_cache(maxsize=8)
def _search_lines(half_width: float, half_height: float) -> Array:
    """Return points (n, 2) along lines across the matrix, both ways."""
    both = []
    for along, across in ((half_width, half_height), (half_height, half_width)):
        n = int(np.ceil(2 * along / SEARCH_STEP_MM))
        a = ((np.arange(n) + 0.5) / n * 2 - 1) * along
        b = ((np.arange(SEARCH_LINES) + 0.5) / SEARCH_LINES * 2 - 1) * across
        both.append(np.stack(np.meshgrid(a, b), axis=-1).reshape(-1, 2))
    both[1] = both[1][:, ::-1]
    return np.concatenate(both)


@lru_cache(maxsize=8)
def _coarse_points(rows: int, columns: int, dx: float, samples: int) -> Array:
    """Return (COARSE, all cells, 2): of every cell another quarter of its lattice."""
    quarters = samples // COARSE
    row, column = np.divmod(np.arange(rows * columns), columns)
    which = (row * 3 + column * 5 + row // quarters + column // quarters) % quarters
    offsets = lattice(samples).reshape(COARSE, quarters, 2) * dx
    return centres_mm(rows, columns, dx) + offsets[:, which]


def _join_neighbours(image: NDArray[Number], join: np.ufunc) -> NDArray[Number]:
    """Return an image in which each cell joins the eight around it."""
    spread = image.copy()
    spread[1:] = join(spread[1:], image[:-1])
    spread[:-1] = join(spread[:-1], image[1:])
    result = spread.copy()
    result[:, 1:] = join(result[:, 1:], spread[:, :-1])
    result[:, :-1] = join(result[:, :-1], spread[:, 1:])
    return result


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """Depths are seen from a plane: the height of the surface minus the height of the plane."""

    grid: Influence
    plane: PlatePose
    cells: Cells  #: (n,) cells of the grid that meet matter, flat numbers, ascending
    levers: Array  #: (3, n) R = [1, y/L, -x/L] at their centres
    shares: Array  #: (levels, n) of the bell, their sum is at most 1
    depths_mm: Array  #: (levels, n) mean depth; -inf where the share is 0
    left_out_mm: Array  #: (grid cells,) greatest depth of matter below the window

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
    """Depth window below a plane."""

    plane: PlatePose  #: about where the plate comes to rest
    floor_mm: float  #: seen from the plane, <= 0

    def depths_mm(self, patch: LayerPatch) -> Array:
        """Return how high the points (samples, cells) of a patch stand over the plane."""
        plane = self.plane
        depths = patch.heights_mm - plane.heights_mm(patch.centres_mm[patch.cells])
        depths -= (plane.heights_mm(patch.offsets_mm) - plane.z_mm)[:, None]
        return depths


def levels_of(
    patch: LayerPatch, grid: Influence, window: DepthWindow, earlier: Sequence[DepthWindow] = ()
) -> Levels:
    """Return the levels of the cells of a patch that were sampled in full.

    Points below the `window` are left out; matter in `earlier` windows, deeper, is one more level.
    """
    depth = window.depths_mm(patch)
    top = float(depth.max())
    floor_mm = min(window.floor_mm, top)
    step = max(top - floor_mm, ONE_LEVEL * max(1.0, abs(top))) / MOST_LEVELS
    near = depth >= floor_mm
    number = np.where(near, np.clip((depth - floor_mm) / step, 0, MOST_LEVELS - 1), MOST_LEVELS + 1)
    number = number.astype(np.int8)
    for other in earlier:
        number[(other.depths_mm(patch) >= other.floor_mm) & ~near] = MOST_LEVELS
    inside = number <= MOST_LEVELS
    used = np.flatnonzero(np.bincount(number.ravel(), minlength=MOST_LEVELS + 2)[: MOST_LEVELS + 1])

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
    cells = np.flatnonzero(shares.sum(axis=0) > LEAST_SHARE)
    shares, moments = shares[:, cells], moments[:, cells]
    none = np.full_like(shares, -np.inf)
    depths = np.divide(moments, shares, out=none, where=shares > 0)

    left_out = np.full(grid.rows * grid.columns, -np.inf)
    seen = patch.highest_mm - window.plane.heights_mm(patch.centres_mm)
    seen[patch.cells] = np.where(near, -np.inf, depth).max(axis=0)
    left_out.reshape(grid.rows, -1)[1:-1, 1:-1] = seen.reshape(patch.shape)
    x, y = centres_mm(grid.rows, grid.columns, grid.dx_mm)[cells].T / grid.sensor.reach_mm
    return Levels(
        grid=grid,
        plane=window.plane,
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
