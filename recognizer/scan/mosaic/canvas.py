"""The global tactile image and its sums. Thesis 4.3.

Cells of a quarter of a tactel in the mosaic's frame: cell (i, j) has its centre at
((j + 1/2) h, -(i + 1/2) h). Tiles exist where touches lie. A canvas is a value: adding or removing
a touch copies the tiles under it and shares the others.

A touch contributes f with variance floor^2 + (slope times the uncertainty of its pose)^2, so that
an uncertain pose counts little at edges, where it matters, and fully on flat ground. Values are
readings (newtons or counts) of a touch of median strength: the gain of a touch against its
neighbours is removed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.patch import (
    TouchPatch,
    covers_points,
    interpolate_patch,
    nearest_tactel,
)
from recognizer.scan.mosaic.planar import inverse, transform_points
from recognizer.scan.mosaic.search import MAGNIFIED, KnownRaster

Array = NDArray[np.float64]

WEIGHT, VALUE, COUNT = range(3)  #: sums of w, w f and 1
TILE = 64  #: cells, as wide as a touch of 16 tactels
FLOOR = 0.03  #: least standard deviation of a reading, share of the upper level


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """Sums on tiles."""

    cell_mm: float
    tiles: Mapping[tuple[int, int], Array]  #: tile row and column -> (3, tile, tile)


@dataclass(frozen=True, slots=True, eq=False)
class CanvasEntry:
    """Pose, covariance and gain with which a touch lies on a canvas; needed to remove it."""

    pose: Array  #: (3,) T_plane_touch
    covariance: Array  #: (3, 3) against its neighbours
    gain: float  #: readings times this are in the canvas's unit


@dataclass(frozen=True, slots=True, eq=False)
class GlobalImage:
    """The image on cells of the plane; 0 where no touch lies. Cell (0, 0) is the upper left one."""

    values: Array  #: (h, w) weighted means
    count: NDArray[np.int64]  #: (h, w) touches
    step_mm: float
    corner_mm: tuple[float, float]  #: x and y of cell (0, 0), frame of the mosaic

    @property
    def known(self) -> NDArray[np.bool_]:
        """(h, w) cells that a touch covers."""
        return self.count > 0


def empty_canvas(pitch_mm: float) -> Canvas:
    """Return a canvas without touches."""
    return Canvas(pitch_mm / MAGNIFIED, {})


def add_to_canvas(canvas: Canvas, patch: TouchPatch, entry: CanvasEntry, sign: int = 1) -> Canvas:
    """Return the canvas with a touch added, or removed (sign -1)."""
    h, (half_x, half_y) = canvas.cell_mm, patch.sensor.half_mm
    x, y, theta = entry.pose.tolist()
    c, s = math.cos(theta), math.sin(theta)
    wide, high = abs(c) * half_x + abs(s) * half_y, abs(s) * half_x + abs(c) * half_y
    j0, j1 = math.floor((x - wide) / h), math.ceil((x + wide) / h)
    i0, i1 = math.floor((-y - high) / h), math.ceil((-y + high) / h)
    i, j = np.mgrid[i0:i1, j0:j1]
    points = np.stack([(j + 0.5) * h, -(i + 0.5) * h], axis=-1).reshape(-1, 2)
    inside = transform_points(inverse(entry.pose), points)
    known = np.flatnonzero(covers_points(patch.sensor, inside, beyond=0.5))
    known = known[patch.good.reshape(-1)[nearest_tactel(patch.sensor, inside[known])]]
    values, by_x, by_y = interpolate_patch(patch, inside[known])
    slope_x, slope_y = c * by_x - s * by_y, s * by_x + c * by_y
    away = points[known] - entry.pose[:2]
    slopes = np.stack([slope_x, slope_y, slope_y * away[:, 0] - slope_x * away[:, 1]], axis=-1)
    unit = entry.gain * patch.scale
    uncertain = np.einsum("ni,ij,nj->n", slopes, entry.covariance, slopes)
    variance = unit**2 * (FLOOR**2 + uncertain)
    sums = np.zeros((3, points.shape[0]))
    weight = 1 / variance
    sums[WEIGHT, known], sums[COUNT, known] = weight, 1.0
    sums[VALUE, known] = weight * unit * values
    return _add_sums(canvas, sign * sums.reshape(3, i1 - i0, j1 - j0), i0, j0)


def rectangle_sums(canvas: Canvas, i0: int, j0: int, rows: int, columns: int) -> Array:
    """Return the sums (3, rows, columns) of a rectangle of cells."""
    found, size = np.zeros((3, rows, columns)), TILE
    for (k, m), tile in canvas.tiles.items():
        top, left = k * size - i0, m * size - j0
        if -size < top < rows and -size < left < columns:
            a, b = max(top, 0), max(left, 0)
            c, d = min(top + size, rows), min(left + size, columns)
            found[:, a:c, b:d] = tile[:, a - top : c - top, b - left : d - left]
    return found


def reference(canvas: Canvas, x_mm: float, y_mm: float, reach_mm: float) -> KnownRaster:
    """Return the mean around a place, for `search`."""
    h = canvas.cell_mm
    size = 2 * math.ceil(reach_mm / h)
    j0, i0 = round(x_mm / h) - size // 2, round(-y_mm / h) - size // 2
    sums = rectangle_sums(canvas, i0, j0, size, size)
    known = sums[COUNT] > 0.5
    values = np.where(known, sums[VALUE] / np.where(known, sums[WEIGHT], 1.0), 0.0)
    return KnownRaster(values, known, (j0 + 0.5) * h, -(i0 + 0.5) * h, h)


def image_of(canvas: Canvas) -> GlobalImage:
    """Return the image of a canvas, as large as its touches; (0, 0) without any."""
    h = canvas.cell_mm
    if not canvas.tiles:
        none = np.zeros((0, 0))
        return GlobalImage(none, none.astype(np.int64), h, (0.0, 0.0))
    at = np.array(list(canvas.tiles))
    low, high = at.min(axis=0) * TILE, (at.max(axis=0) + 1) * TILE
    sums = rectangle_sums(canvas, low[0], low[1], *(high - low).tolist())
    rows, columns = (np.flatnonzero((sums[COUNT] > 0.5).any(axis=axis)) for axis in (1, 0))
    sums = sums[:, rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    count = np.rint(sums[COUNT]).astype(np.int64)
    mean = np.where(count > 0, sums[VALUE] / np.where(count > 0, sums[WEIGHT], 1.0), 0.0)
    corner = (float(low[1] + columns[0] + 0.5) * h, -float(low[0] + rows[0] + 0.5) * h)
    return GlobalImage(mean, count, h, corner)


def _add_sums(canvas: Canvas, sums: Array, i0: int, j0: int) -> Canvas:
    tiles, size = dict(canvas.tiles), TILE
    rows, columns = sums.shape[1:]
    for k in range(i0 // size, (i0 + rows - 1) // size + 1):
        for m in range(j0 // size, (j0 + columns - 1) // size + 1):
            top, left = k * size - i0, m * size - j0
            a, b = max(top, 0), max(left, 0)
            c, d = min(top + size, rows), min(left + size, columns)
            part = sums[:, a:c, b:d]
            if not part[COUNT].any():
                continue
            tile = tiles[k, m].copy() if (k, m) in tiles else np.zeros((3, size, size))
            under = tile[:, a - top : c - top, b - left : d - left]
            under += part
            under[:, under[COUNT] < 0.5] = 0.0  # rounding alone is left
            tile.setflags(write=False)
            tiles[k, m] = tile
    return Canvas(canvas.cell_mm, {key: tile for key, tile in tiles.items() if tile[COUNT].any()})
