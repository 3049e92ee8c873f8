"""Which cells of an array are taken, as bits: what the placing of the next object reads.

Cells (row, column) <-> rows of `occupancy`: one tile of 64 x 64 cells each
(`generator.layout.occupancy`). A million taken cells are so 300 rows in place of a million.
`cells` stays the truth; whoever writes cells writes these bits in the same transaction.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import numpy as np
from sqlalchemy import Connection, and_, bindparam, select, update

from generator.database import tables
from generator.database.insert import insert_rows
from generator.layout.occupancy import TILE, Cells, Tiles, tiles_of

_CHUNK = 256  # tile rows looked up in one statement


def taken_tiles(connection: Connection, array_id: int) -> Tiles:
    """Return the tiles of an array in which cells are taken, or were."""
    occupancy = tables.occupancy.c
    return {
        (row, column): np.frombuffer(bits, np.uint8)
        for row, column, bits in connection.execute(
            select(occupancy.tile_row, occupancy.tile_column, occupancy.bits).where(
                occupancy.array_id == array_id
            )
        )
    }


def take_cells(connection: Connection, array_id: int, cells: Cells) -> None:
    """Note that cells (n,) of an array are taken from now on."""
    _write(connection, array_id, cells, taken=True)


def free_cells(connection: Connection, array_id: int, cells: Cells) -> None:
    """Note that cells (n,) of an array are free again."""
    _write(connection, array_id, cells, taken=False)


def _write(connection: Connection, array_id: int, cells: Cells, *, taken: bool) -> None:
    changed = tiles_of(*cells)
    known = _read_tiles(connection, array_id, changed)
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


def _read_tiles(connection: Connection, array_id: int, wanted: Iterable[tuple[int, int]]) -> Tiles:
    """Return the tiles among `wanted` that the database has."""
    occupancy = tables.occupancy.c
    columns_of: dict[int, set[int]] = defaultdict(set)
    for row, column in wanted:
        columns_of[row].add(column)
    rows = sorted(columns_of)
    found: Tiles = {}
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
