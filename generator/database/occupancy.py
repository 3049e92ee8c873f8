"""Which cells of an array are taken, as bits: what the placing of the next object reads.

Cells (row, column) <-> rows of `occupancy`: one tile of TILE x TILE cells each, a bit per
cell, row by row, the lowest bit of a byte first. A million taken cells are so 300 rows in
place of a million. `cells` stays the truth; whoever writes cells writes these bits in the
same transaction.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, and_, bindparam, select, update

from generator.database import tables
from generator.database.rows import insert_rows

Cells = tuple[NDArray[np.int64], NDArray[np.int64]]  #: rows (n,) and columns (n,)

TILE = 64  #: rows and columns of a tile

_CHUNK = 256  # tile rows looked up in one statement


def taken_cells(connection: Connection, array_id: int, *, without: Cells | None = None) -> Cells:
    """Return the taken cells of an array: rows (n,) and columns (n,), sorted by both.

    Parameters
    ----------
    without
        Cells that do not count though they are taken.
    """
    occupancy = tables.occupancy.c
    tiles: dict[tuple[int, int], NDArray[np.uint8]] = {
        (row, column): np.frombuffer(bits, np.uint8)
        for row, column, bits in connection.execute(
            select(occupancy.tile_row, occupancy.tile_column, occupancy.bits)
            .where(occupancy.array_id == array_id)
            .order_by(occupancy.tile_row, occupancy.tile_column)
        )
    }
    if without is not None:
        for tile, bits in _bits_of(*without):
            tiles[tile] = tiles[tile] & ~bits
    # Tiles of one row side by side are a strip, in which cells come sorted as they are found.
    strips: dict[int, list[tuple[int, NDArray[np.uint8]]]] = defaultdict(list)
    for (tile_row, tile_column), bits in tiles.items():
        strips[tile_row].append((tile_column, bits))
    found = [(np.empty(0, np.int64), np.empty(0, np.int64))]
    for tile_row, strip in strips.items():
        cells = np.concatenate(
            [np.unpackbits(bits.reshape(TILE, -1), axis=1, bitorder="little") for _, bits in strip],
            axis=1,
        )
        r, c = np.nonzero(cells)
        first = np.array([tile_column for tile_column, _ in strip], np.int64) * TILE
        found.append((r + tile_row * TILE, first[c // TILE] + c % TILE))
    rows, columns = zip(*found, strict=True)
    return np.concatenate(rows), np.concatenate(columns)


def take_cells(connection: Connection, array_id: int, cells: Cells) -> None:
    """Note that cells (n,) of an array are taken from now on."""
    _write(connection, array_id, cells, taken=True)


def free_cells(connection: Connection, array_id: int, cells: Cells) -> None:
    """Note that cells (n,) of an array are free again."""
    _write(connection, array_id, cells, taken=False)


def _write(connection: Connection, array_id: int, cells: Cells, *, taken: bool) -> None:
    changed = dict(_bits_of(*cells))
    known = _read(connection, array_id, changed)
    empty = np.zeros(TILE * TILE // 8, np.uint8)
    rows = []
    for tile, bits in changed.items():
        before = known.get(tile, empty)
        after = before | bits if taken else before & ~bits
        rows.append((tile, after.tobytes()))
    occupancy = tables.occupancy.c
    old = [
        {"at_array": array_id, "at_row": row, "at_column": column, "bits": bits}
        for (row, column), bits in rows
        if (row, column) in known
    ]
    new = [
        {"array_id": array_id, "tile_row": row, "tile_column": column, "bits": bits}
        for (row, column), bits in rows
        if (row, column) not in known
    ]
    if old:
        this_tile = and_(
            occupancy.array_id == bindparam("at_array"),
            occupancy.tile_row == bindparam("at_row"),
            occupancy.tile_column == bindparam("at_column"),
        )
        connection.execute(update(tables.occupancy).where(this_tile), old)
    insert_rows(connection, tables.occupancy, new)


def _read(
    connection: Connection, array_id: int, wanted: Iterable[tuple[int, int]]
) -> dict[tuple[int, int], NDArray[np.uint8]]:
    """Return the tiles among `wanted` that the database has."""
    occupancy = tables.occupancy.c
    columns_of: dict[int, set[int]] = defaultdict(set)
    for row, column in wanted:
        columns_of[row].add(column)
    rows = sorted(columns_of)
    found = {}
    for start in range(0, len(rows), _CHUNK):
        chunk = rows[start : start + _CHUNK]
        columns = set().union(*(columns_of[row] for row in chunk))
        for row, column, bits in connection.execute(
            select(occupancy.tile_row, occupancy.tile_column, occupancy.bits).where(
                occupancy.array_id == array_id,
                occupancy.tile_row.in_(chunk),
                occupancy.tile_column.between(min(columns), max(columns)),
            )
        ):
            if column in columns_of[row]:
                found[row, column] = np.frombuffer(bits, np.uint8)
    return found


def _bits_of(
    rows: NDArray[np.int64], columns: NDArray[np.int64]
) -> Iterator[tuple[tuple[int, int], NDArray[np.uint8]]]:
    """Yield the tiles that hold cells, each with the bits (TILE TILE / 8,) of its cells."""
    if len(rows) == 0:
        return
    tiles, which = np.unique(
        np.stack([rows // TILE, columns // TILE], axis=1), axis=0, return_inverse=True
    )
    bit = rows % TILE * TILE + columns % TILE
    order = np.argsort(which.ravel(), kind="stable")
    ends = np.searchsorted(which.ravel()[order], np.arange(len(tiles)), side="right")
    for tile, part in zip(tiles.tolist(), np.split(bit[order], ends[:-1]), strict=True):
        cells = np.zeros(TILE * TILE, bool)
        cells[part] = True
        yield (tile[0], tile[1]), np.packbits(cells, bitorder="little")
