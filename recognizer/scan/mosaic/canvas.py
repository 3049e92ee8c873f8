"""The sums under the global tactile image, in tiles that are made where something was felt.

Cells of a quarter of a tactel in the mosaic's frame: cell (i, j) has its centre at
((j + 1/2) h, -(i + 1/2) h). A canvas is a value: a touch that is laid, or taken off again,
copies the tiles that it meets and shares the others. Thesis 4.3.

A touch says f with variance floor^2 + (slope along what its pose leaves open)^2, so that a
doubtful pose counts little at edges, where it matters, and fully on flat ground.
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
from recognizer.scan.mosaic.raster import KnownRaster
from recognizer.scan.mosaic.settings import CANVAS

Array = NDArray[np.float64]

WEIGHT, VALUE, SQUARE, COUNT = range(4)  #: sums of w, w f, w f^2 and 1


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """Sums on tiles."""

    cell_mm: float
    tiles: Mapping[tuple[int, int], Array]  #: tile row and column -> (4, tile, tile)


@dataclass(frozen=True, slots=True, eq=False)
class CanvasEntry:
    """How a touch lies on a canvas; the same value takes it off again."""

    pose: Array  #: (3,) T_plane_touch
    covariance: Array  #: (3, 3) against its neighbours
    gain: float  #: readings times this are in the canvas's unit


def empty_canvas(pitch_mm: float) -> Canvas:
    """Return a canvas on which nothing lies."""
    return Canvas(pitch_mm / CANVAS.magnified, {})


def lay_touch(canvas: Canvas, patch: TouchPatch, how: CanvasEntry, sign: int = 1) -> Canvas:
    """Return the canvas with a touch more, or with one less (sign -1)."""
    h, (half_x, half_y) = canvas.cell_mm, patch.sensor.half_mm
    x, y, theta = how.pose.tolist()
    c, s = math.cos(theta), math.sin(theta)
    wide, high = abs(c) * half_x + abs(s) * half_y, abs(s) * half_x + abs(c) * half_y
    j0, j1 = math.floor((x - wide) / h), math.ceil((x + wide) / h)
    i0, i1 = math.floor((-y - high) / h), math.ceil((-y + high) / h)
    i, j = np.mgrid[i0:i1, j0:j1]
    points = np.stack([(j + 0.5) * h, -(i + 0.5) * h], axis=-1).reshape(-1, 2)
    inside = transform_points(inverse(how.pose), points)
    known = np.flatnonzero(covers_points(patch.sensor, inside, beyond=0.5))
    known = known[patch.good.reshape(-1)[nearest_tactel(patch.sensor, inside[known])]]
    values, by_x, by_y = interpolate_patch(patch, inside[known])
    slope_x, slope_y = c * by_x - s * by_y, s * by_x + c * by_y
    away = points[known] - how.pose[:2]
    slopes = np.stack([slope_x, slope_y, slope_y * away[:, 0] - slope_x * away[:, 1]], axis=-1)
    unit = how.gain * patch.scale
    left_open = np.einsum("ni,ij,nj->n", slopes, how.covariance, slopes)
    variance = unit**2 * (CANVAS.floor**2 + left_open)
    sums = np.zeros((4, points.shape[0]))
    weight = 1 / variance
    sums[WEIGHT, known], sums[COUNT, known] = weight, 1.0
    sums[VALUE, known] = weight * unit * values
    sums[SQUARE, known] = weight * (unit * values) ** 2
    return _add_sums(canvas, sign * sums.reshape(4, i1 - i0, j1 - j0), i0, j0)


def rectangle_sums(canvas: Canvas, i0: int, j0: int, rows: int, columns: int) -> Array:
    """Return the sums (4, rows, columns) of a rectangle of cells."""
    found, size = np.zeros((4, rows, columns)), CANVAS.tile
    for (k, m), tile in canvas.tiles.items():
        top, left = k * size - i0, m * size - j0
        if -size < top < rows and -size < left < columns:
            a, b = max(top, 0), max(left, 0)
            c, d = min(top + size, rows), min(left + size, columns)
            found[:, a:c, b:d] = tile[:, a - top : c - top, b - left : d - left]
    return found


def reference(canvas: Canvas, x_mm: float, y_mm: float, reach_mm: float) -> KnownRaster:
    """Return the mean about a place, for `search`."""
    h = canvas.cell_mm
    size = 2 * math.ceil(reach_mm / h)
    j0, i0 = round(x_mm / h) - size // 2, round(-y_mm / h) - size // 2
    sums = rectangle_sums(canvas, i0, j0, size, size)
    known = sums[COUNT] > 0.5
    values = np.where(known, sums[VALUE] / np.where(known, sums[WEIGHT], 1.0), 0.0)
    return KnownRaster(values, known, (j0 + 0.5) * h, -(i0 + 0.5) * h, h)


def _add_sums(canvas: Canvas, sums: Array, i0: int, j0: int) -> Canvas:
    tiles, size = dict(canvas.tiles), CANVAS.tile
    rows, columns = sums.shape[1:]
    for k in range(i0 // size, (i0 + rows - 1) // size + 1):
        for m in range(j0 // size, (j0 + columns - 1) // size + 1):
            top, left = k * size - i0, m * size - j0
            a, b = max(top, 0), max(left, 0)
            c, d = min(top + size, rows), min(left + size, columns)
            part = sums[:, a:c, b:d]
            if not part[COUNT].any():
                continue
            tile = tiles[k, m].copy() if (k, m) in tiles else np.zeros((4, size, size))
            under = tile[:, a - top : c - top, b - left : d - left]
            under += part
            under[:, under[COUNT] < 0.5] = 0.0  # nothing is left there but rounding
            tile.setflags(write=False)
            tiles[k, m] = tile
    return Canvas(canvas.cell_mm, {key: tile for key, tile in tiles.items() if tile[COUNT].any()})
