"""Cells of an array: which are taken, and which object and face hold them.

`cells` is the truth. `occupancy` holds it as bits, one row a tile of 64 x 64 cells
(`generator.layout.occupancy`): placing the next object reads 300 rows where a million cells are
taken. Whoever writes cells writes these bits in the same transaction.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sqlalchemy import Connection, and_, bindparam, select, update

from generator.array.contract import SymbolArray
from generator.database import tables
from generator.database.registered import canonical, digest
from generator.database.rows import insert_rows
from generator.database.transaction import of_rows
from generator.layout.occupancy import Cells, Occupancy, Tiles, cells_of_tiles, tiles_of

_CHUNK = 64  #: cells looked up in one statement


def array_key(array: SymbolArray) -> str:
    """Return the digest by which the database knows an array.

    The window is left out, and where placing begins: they change no symbol.
    """
    kept = {name: v for name, v in array.definition().items() if name not in ("window", "first")}
    return digest(canonical(kept))


@of_rows
def find_array(connection: Connection, array: SymbolArray) -> int | None:
    """Return the number of an array that objects were registered on, None for a new one."""
    arrays = tables.arrays.c
    return connection.execute(
        select(arrays.array_id).where(arrays.definition_sha256 == array_key(array))
    ).scalar_one_or_none()


def occupancy(connection: Connection, array: SymbolArray) -> Occupancy:
    """Return which cells of an array objects hold; none of one that is new to the database."""
    array_id = find_array(connection, array)
    return Occupancy.from_tiles(taken_tiles(connection, array_id), array)


@of_rows
def occupied_cells(connection: Connection, array_id: int | None) -> Cells:
    """Return the taken cells of an array, sorted: rows (n,) and columns (n,); none for None."""
    return cells_of_tiles(taken_tiles(connection, array_id))


@of_rows
def cells_of(connection: Connection, object_id: int, array_id: int) -> Cells:
    """Return the cells of an array that an object holds: rows (n,) and columns (n,)."""
    cells = tables.cells.c
    rows = connection.execute(
        select(cells.row, cells.column).where(
            cells.object_id == object_id, cells.array_id == array_id
        )
    )
    flat = np.fromiter(chain.from_iterable(rows), dtype=np.int64)
    return flat[0::2].copy(), flat[1::2].copy()


@of_rows
def held_cells(connection: Connection, array_id: int) -> NDArray[np.int64]:
    """Return every registered cell of an array, sorted (n, 5): row, column, object, face, label."""
    cells = tables.cells.c
    rows = connection.execute(
        select(cells.row, cells.column, cells.object_id, cells.face_id, cells.label)
        .where(cells.array_id == array_id)
        .order_by(cells.row, cells.column)
    )
    return np.fromiter(chain.from_iterable(rows), dtype=np.int64).reshape(-1, 5)


@of_rows
def faces_at(
    connection: Connection, array_id: int, rows: ArrayLike, columns: ArrayLike
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return object numbers (n,) and face numbers (n,) of cells; -1 where nothing is registered.

    `rows` and `columns` (0 <= row < rows) are broadcast together to (n,).
    """
    r, c = np.broadcast_arrays(np.atleast_1d(rows), np.atleast_1d(columns))
    asked = list(zip(r.tolist(), c.tolist(), strict=True))
    cells = tables.cells.c
    held: dict[tuple[int, int], tuple[int, int]] = {}
    wanted = sorted(set(asked))
    for start in range(0, len(wanted), _CHUNK):
        near_rows, near_columns = (
            sorted(set(part)) for part in zip(*wanted[start : start + _CHUNK], strict=True)
        )
        # All pairs of these rows and columns: few more than asked for where cells lie
        # together, and each is one step in the primary key, unlike a search for pairs.
        for row, column, object_id, face_id in connection.execute(
            select(cells.row, cells.column, cells.object_id, cells.face_id).where(
                cells.array_id == array_id, cells.row.in_(near_rows), cells.column.in_(near_columns)
            )
        ):
            held[row, column] = (object_id, face_id)
    found = np.array([held.get(cell, (-1, -1)) for cell in asked], dtype=np.int64).reshape(-1, 2)
    return found[:, 0], found[:, 1]


_TILE_CHUNK = 256  # tile rows looked up in one statement


@of_rows
def taken_tiles(connection: Connection, array_id: int | None) -> Tiles:
    """Return the tiles of an array in which cells are taken, or were; none for None."""
    if array_id is None:
        return {}
    occupancy = tables.occupancy.c
    return {
        (row, column): np.frombuffer(bits, np.uint8)
        for row, column, bits in connection.execute(
            select(occupancy.tile_row, occupancy.tile_column, occupancy.bits).where(
                occupancy.array_id == array_id
            )
        )
    }


@of_rows
def mark_cells(connection: Connection, array_id: int, cells: Cells, *, taken: bool) -> None:
    """Note that cells (n,) of an array are taken from now on, or free again."""
    changed = tiles_of(*cells)
    known = _read_tiles(connection, array_id, changed)
    old, new = [], []
    for (row, column), bits in changed.items():
        before = known.get((row, column), np.zeros_like(bits))
        after = (before | bits if taken else before & ~bits).tobytes()
        if (row, column) in known:
            old.append({"at_array": array_id, "at_row": row, "at_column": column, "bits": after})
        else:
            new.append(
                {"array_id": array_id, "tile_row": row, "tile_column": column, "bits": after}
            )
    occupancy = tables.occupancy.c
    if old:
        this_tile = and_(
            occupancy.array_id == bindparam("at_array"),
            occupancy.tile_row == bindparam("at_row"),
            occupancy.tile_column == bindparam("at_column"),
        )
        connection.execute(update(tables.occupancy).where(this_tile), old)
    insert_rows(connection, tables.occupancy, new)


def _read_tiles(connection: Connection, array_id: int, wanted: Iterable[tuple[int, int]]) -> Tiles:
    occupancy = tables.occupancy.c
    columns_of: dict[int, set[int]] = defaultdict(set)
    for row, column in wanted:
        columns_of[row].add(column)
    rows = sorted(columns_of)
    found: Tiles = {}
    for start in range(0, len(rows), _TILE_CHUNK):
        chunk = rows[start : start + _TILE_CHUNK]
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
