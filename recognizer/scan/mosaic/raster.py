"""Images known in parts, on a grid of cells in a plane. Thesis 4.3.

Row 0 is on top: cell (i, j) has its centre at (x0 + j h, y0 - i h). A patch magnified to four
times its resolution is such an image in the sensor frame, the global tactile image in the
frame of the mosaic.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.patch import RIM, TouchPatch, basis
from recognizer.scan.mosaic.planar import transform_points
from recognizer.scan.mosaic.settings import CANVAS

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class KnownRaster:
    """Values on cells, and which of them are known."""

    values: Array  #: (rows, columns); 0 where not known
    known: NDArray[np.bool_]  #: (rows, columns)
    x0_mm: float  #: of the centre of cell (0, 0)
    y0_mm: float
    cell_mm: float


def magnify_patch(patch: TouchPatch) -> KnownRaster:
    """Return a patch at four times its resolution, sensor frame."""
    rows, columns = patch.values.shape
    h = patch.sensor.pitch_mm / CANVAS.magnified
    values = _spline_matrix(rows) @ patch.coefficients @ _spline_matrix(columns).T
    known = patch.good.repeat(CANVAS.magnified, axis=0).repeat(CANVAS.magnified, axis=1)
    width, height = columns * CANVAS.magnified, rows * CANVAS.magnified
    return KnownRaster(
        np.where(known, values, 0.0), known, -(width - 1) / 2 * h, (height - 1) / 2 * h, h
    )


def pad_raster(raster: KnownRaster, rows: int, columns: int) -> KnownRaster:
    """Return a raster with so many unknown cells more on each side."""
    margin = ((rows, rows), (columns, columns))
    return KnownRaster(
        np.pad(raster.values, margin),
        np.pad(raster.known, margin),
        raster.x0_mm - columns * raster.cell_mm,
        raster.y0_mm + rows * raster.cell_mm,
        raster.cell_mm,
    )


def points_mm(raster: KnownRaster) -> Array:
    """Return the cells' centres (rows, columns, 2)."""
    rows, columns = raster.values.shape
    points = np.empty((rows, columns, 2))
    points[..., 0] = raster.x0_mm + np.arange(columns) * raster.cell_mm
    points[..., 1] = (raster.y0_mm - np.arange(rows) * raster.cell_mm)[:, None]
    return points


def laid_under(source: KnownRaster, like: KnownRaster, T_source_like: Array) -> KnownRaster:
    """Return a raster on the cells of another one, between cells by the four around.

    A cell is known where all four are.
    """
    at = transform_points(T_source_like, points_mm(like))
    column = (at[..., 0] - source.x0_mm) / source.cell_mm
    row = (source.y0_mm - at[..., 1]) / source.cell_mm
    rows, columns = source.values.shape
    inside = (column >= 0) & (column <= columns - 1) & (row >= 0) & (row <= rows - 1)
    j = np.clip(column.astype(np.intp), 0, columns - 2)
    i = np.clip(row.astype(np.intp), 0, rows - 2)
    right, down = column - j, row - i
    first = i * columns + j
    values, known = source.values.reshape(-1), source.known.reshape(-1)
    total = np.zeros(at.shape[:2])
    for offset, share in (
        (0, (1 - right) * (1 - down)),
        (1, right * (1 - down)),
        (columns, (1 - right) * down),
        (columns + 1, right * down),
    ):
        total += values[first + offset] * share
        inside &= known[first + offset] | (share < 1e-9)
    return KnownRaster(np.where(inside, total, 0.0), inside, like.x0_mm, like.y0_mm, like.cell_mm)


@lru_cache(maxsize=8)
def _spline_matrix(tactels: int) -> Array:
    """Return what spline coefficients give at the cells of a row of tactels."""
    cells = (np.arange(tactels * CANVAS.magnified) + 0.5) / CANVAS.magnified - 0.5 + RIM
    first = np.floor(cells).astype(np.intp)
    table = np.zeros((len(cells), tactels + 2 * RIM))
    np.put_along_axis(table, first[:, None] + np.arange(-1, 3), basis(cells - first)[0], axis=1)
    table.setflags(write=False)
    return table
