"""A surface sampled once and kept: for thousands of touches of one part.

Heights are taken at the centres of square cells, tile by tile as they are asked for, and
every point gets its cell's. The error is at most half a cell's diagonal times the steepest
slope (0.025 mm cells on sides with a draft of 10 degrees: 0.1 mm, and as much as the wall's
height within half a diagonal of an upright wall); flat faces and tops are exact. Memory is
4 bytes a cell that was asked for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from probe.errors import SurfaceError
from probe.surface.contract import Surface

Array = NDArray[np.float64]

CELL_MM = 0.025
TILE = 128  #: cells along a tile's side
TILES = 1024  #: tiles along each side of the square that can be kept


class Raster:
    """A surface seen through a grid of cells.

    Parameters
    ----------
    surface
        What is sampled.
    cell_mm
        Side of a cell. The raster reaches 65,536 cells to each side of the origin.

    Raises
    ------
    SurfaceError
        When the size is not positive.
    """

    def __init__(self, surface: Surface, cell_mm: float = CELL_MM) -> None:
        if not 0 < cell_mm < np.inf:
            raise SurfaceError(f"cells of {cell_mm:g} mm", fix="give a size above 0 mm")
        self._surface = surface
        self._cell_mm = cell_mm
        self._number = np.full(TILES * TILES, -1)  # of the tile in the store, -1: not sampled
        self._store = np.empty((16, TILE * TILE), dtype=np.float32)
        self._count = 0

    @property
    def top_mm(self) -> float:
        """That of the surface."""
        return self._surface.top_mm

    @property
    def stored_bytes(self) -> int:
        """Memory of all tiles that were asked for."""
        return self._count * TILE * TILE * self._store.itemsize

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the heights of the cells in which points (n, 2) lie.

        Raises
        ------
        SurfaceError
            When a point lies beyond the raster.
        """
        cells = np.floor(points_mm / self._cell_mm)
        cells += TILE * TILES // 2
        if len(cells) and not 0 <= cells.min() <= cells.max() < TILE * TILES:
            raise SurfaceError(
                f"points up to {np.abs(points_mm).max():g} mm away, the raster reaches "
                f"{TILE * TILES // 2 * self._cell_mm:g} mm",
                fix="take larger cells",
            )
        i, j = cells.astype(np.int64).T
        tile = (i // TILE) * TILES + j // TILE
        number = self._number.take(tile)
        if (number < 0).any():
            for missing in np.unique(tile[number < 0]):
                self._sample(int(missing))
            number = self._number.take(tile)
        number *= TILE * TILE
        number += (i % TILE) * TILE + j % TILE
        heights: Array = self._store.ravel().take(number).astype(np.float64)
        return heights

    def _sample(self, tile: int) -> None:
        i, j = divmod(tile, TILES)
        place = TILE * (np.array([i, j]) - TILES // 2)
        x, y = (place[:, None] + np.arange(TILE) + 0.5) * self._cell_mm
        points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        if self._count == len(self._store):
            self._store = np.concatenate([self._store, np.empty_like(self._store)])
        self._store[self._count] = self._surface.heights_mm(points)
        self._number[tile] = self._count
        self._count += 1
