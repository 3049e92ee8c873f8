"""Heights of the surface under the matrix, only where they can matter.

Surface + cells + place -> Patch. Every cell is looked at in 4 points; a cell whose
neighbourhood is level needs no more, one that can touch is sampled in full (16 points by
default), all others never. The points of a cell are a lattice whose columns and rows are all
different, and neighbouring cells look at different quarters of it, so a stroke along an axis
is seen down to dx / 16. Thesis 4.2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.contact.heights import heights_at
from probe.contact.settings import LAYER_PATCH
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]
Cells = NDArray[np.intp]
Number = TypeVar("Number", np.float64, np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class LayerPatch:
    """What lies under the matrix: cells in flat numbers, row * columns + column, row 0 on top."""

    surface: HeightMap
    sensor: SensorType
    touch: Touch  #: its x, y and theta; force, tilt and wrist have no meaning here
    cells_per_tactel: int
    offsets_mm: Array  #: (samples, 2) points of a cell from its centre, sensor frame
    coarse_mm: Array  #: (all cells,) height of the first of the points looked at
    highest_mm: Array  #: (all cells,) of the points looked at
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
    """Return the first look at what lies under the matrix; no cell is sampled in full yet.

    Parameters
    ----------
    surface
        What is touched.
    sensor, touch
        The matrix, and where it stands.
    cells_per_tactel
        Cells along the side of a tactel.
    samples
        Points of a cell that is sampled in full: 16, 64 or 256.

    Raises
    ------
    ContactError
        When the number of samples is another, the surface gives a height that is no number, or
        carries strokes too thin to be seen.
    """
    if samples not in LAYER_PATCH.samples:
        raise ContactError(
            f"{samples} samples per cell, allowed are {', '.join(map(str, LAYER_PATCH.samples))}",
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
        level=(high <= low + LAYER_PATCH.level_mm).ravel(),
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

    Asked only when the surface has a top that the first look did not meet: a blank place, strokes
    thinner than the points are apart, or the top of something round. The last rises over the
    highest point seen about it by less than what was seen there differs.
    """
    seen, top = float(high.max()), surface.top_mm
    if top <= seen + LAYER_PATCH.level_mm:
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
        n = int(np.ceil(2 * along / LAYER_PATCH.search_step_mm))
        a = ((np.arange(n) + 0.5) / n * 2 - 1) * along
        b = (
            (np.arange(LAYER_PATCH.search_lines) + 0.5) / LAYER_PATCH.search_lines * 2 - 1
        ) * across
        both.append(np.stack(np.meshgrid(a, b), axis=-1).reshape(-1, 2))
    both[1] = both[1][:, ::-1]
    return np.concatenate(both)


@lru_cache(maxsize=8)
def _coarse_points(rows: int, columns: int, dx: float, samples: int) -> Array:
    """Return (LAYER_PATCH.coarse, all cells, 2): of every cell another quarter of its lattice."""
    quarters = samples // LAYER_PATCH.coarse
    row, column = np.divmod(np.arange(rows * columns), columns)
    which = (row * 3 + column * 5 + row // quarters + column // quarters) % quarters
    offsets = lattice(samples).reshape(LAYER_PATCH.coarse, quarters, 2) * dx
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
