"""Which cells of an array are taken: bits in tiles of 64 x 64 cells.

Cells (row, column) <-> tiles: (tile row, tile column) -> one bit per cell, row by row, the lowest
bit of a byte first. Tiles without a taken cell do not exist, so that an array may be of any size;
a million taken cells are 300 tiles. A value is not changed: with more cells taken it shares all
tiles but those of the new cells, so that adding an object costs what the object holds.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.array.contract import SymbolArray, on_torus

Cells = tuple[NDArray[np.int64], NDArray[np.int64]]  #: rows (n,) and columns (n,)
Tiles = dict[tuple[int, int], NDArray[np.uint8]]  #: (TILE TILE / 8,) bits each
Mask = NDArray[np.bool_]

TILE = 64  #: rows and columns of a tile


@dataclass(frozen=True, slots=True)
class Occupancy:
    """The taken cells of a torus of rows x columns."""

    rows: int
    columns: int
    tiles: Mapping[tuple[int, int], NDArray[np.uint8]]
    used: int  #: number of taken cells
    first: tuple[int, int] = (0, 0)  #: cell at which placing begins

    @classmethod
    def from_cells(cls, rows: ArrayLike, columns: ArrayLike, array: SymbolArray) -> Occupancy:
        """Return the occupancy of an array by cells (n,), taken on the torus."""
        none = cls(array.rows, array.columns, {}, 0, array.first)
        return none.with_cells(rows, columns)

    @classmethod
    def from_tiles(
        cls, tiles: Mapping[tuple[int, int], NDArray[np.uint8]], array: SymbolArray
    ) -> Occupancy:
        """Return the occupancy of an array by tiles, as a database has them."""
        counts = {at: int(np.bitwise_count(bits).sum()) for at, bits in tiles.items()}
        held = {at: tiles[at] for at in tiles if counts[at]}
        return cls(array.rows, array.columns, held, sum(counts.values()), array.first)

    def with_cells(self, rows: ArrayLike, columns: ArrayLike) -> Occupancy:
        """Return the occupancy with more cells (n,) taken."""
        return self._changed(rows, columns, taken=True)

    def without_cells(self, rows: ArrayLike, columns: ArrayLike) -> Occupancy:
        """Return the occupancy with some cells (n,) free."""
        return self._changed(rows, columns, taken=False)

    @property
    def free(self) -> int:
        """Number of free cells."""
        return self.rows * self.columns - self.used

    def cells(self) -> Cells:
        """Return the taken cells, rows (n,) and columns (n,), sorted by both."""
        return cells_of_tiles(self.tiles)

    def corner(self, rows: int, columns: int) -> Mask:
        """Return which cells are taken from the first one on, bool (rows, columns)."""
        down = _stretches(self.first[0], rows, self.rows)
        right = _stretches(self.first[1], columns, self.columns)
        return np.block([[self._block(*y, *x) for x in right] for y in down])

    def _block(self, top: int, rows: int, left: int, columns: int) -> Mask:
        """Return which cells of a block are taken; it does not go round the torus."""
        y0, x0 = top // TILE, left // TILE
        down, right = -(-(top + rows) // TILE) - y0, -(-(left + columns) // TILE) - x0
        seen = [at for at in self.tiles if 0 <= at[0] - y0 < down and 0 <= at[1] - x0 < right]
        sheet = np.zeros((down, TILE, right, TILE), dtype=bool)
        if seen:
            bits = np.unpackbits(np.stack([self.tiles[at] for at in seen]), bitorder="little")
            y, x = np.array(seen).T
            sheet[y - y0, :, x - x0] = bits.reshape(-1, TILE, TILE)
        whole = sheet.reshape(down * TILE, right * TILE)
        within = top - y0 * TILE, left - x0 * TILE
        return whole[within[0] : within[0] + rows, within[1] : within[1] + columns]

    def _changed(self, rows: ArrayLike, columns: ArrayLike, *, taken: bool) -> Occupancy:
        tiles, used = dict(self.tiles), self.used
        empty = np.zeros(TILE * TILE // 8, np.uint8)
        r, c = on_torus(rows, self.rows).ravel(), on_torus(columns, self.columns).ravel()
        for at, bits in tiles_of(r.astype(np.int64), c.astype(np.int64)).items():
            before = tiles.get(at, empty)
            after = before | bits if taken else before & ~bits
            used += int(np.bitwise_count(after).sum()) - int(np.bitwise_count(before).sum())
            tiles[at] = after
            if not after.any():
                del tiles[at]
        return replace(self, tiles=tiles, used=used)


def _stretches(first: int, length: int, cycle: int) -> list[tuple[int, int]]:
    """Return the one or two stretches (start, length) of a cycle from `first` on."""
    before = min(length, cycle - first)
    return [(first, before)] + ([(0, length - before)] if length > before else [])


def tiles_of(rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Tiles:
    """Return the tiles that hold cells (n,), each with the bits of its cells."""
    tiles: Tiles = {}
    if len(rows) == 0:
        return tiles
    tile_row, tile_column = rows // TILE, columns // TILE
    order = np.lexsort((tile_column, tile_row))
    tile_row, tile_column = tile_row[order], tile_column[order]
    new = np.flatnonzero((np.diff(tile_row) != 0) | (np.diff(tile_column) != 0)) + 1
    bit = (rows % TILE * TILE + columns % TILE)[order]
    for part, first in zip(np.split(bit, new), np.append(0, new).tolist(), strict=True):
        cells = np.zeros(TILE * TILE, bool)
        cells[part] = True
        at = int(tile_row[first]), int(tile_column[first])
        tiles[at] = np.packbits(cells, bitorder="little")
    return tiles


def cells_of_tiles(tiles: Mapping[tuple[int, int], NDArray[np.uint8]]) -> Cells:
    """Return the cells whose bits are set, rows (n,) and columns (n,), sorted by both."""
    # Tiles of one row side by side are a strip, in which cells come sorted as they are found.
    strips: dict[int, list[int]] = defaultdict(list)
    for tile_row, tile_column in sorted(tiles):
        strips[tile_row].append(tile_column)
    found = [(np.empty(0, np.int64), np.empty(0, np.int64))]
    for tile_row, strip in strips.items():
        bits = np.concatenate([tiles[tile_row, k].reshape(TILE, -1) for k in strip], axis=1)
        r, c = np.nonzero(np.unpackbits(bits, axis=1, bitorder="little").view(bool))
        first = np.array(strip, np.int64) * TILE
        found.append((r + tile_row * TILE, first[c // TILE] + c % TILE))
    rows, columns = zip(*found, strict=True)
    return np.concatenate(rows), np.concatenate(columns)
