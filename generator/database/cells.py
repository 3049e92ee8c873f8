"""Cells of an array: which are taken, and which object and face hold them."""

from __future__ import annotations

from itertools import chain

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sqlalchemy import Connection, select

from generator.array.contract import SymbolArray
from generator.database import tables
from generator.database.canonical import canonical, digest
from generator.database.occupancy import taken_tiles
from generator.layout.occupancy import Cells, Occupancy, cells_of_tiles

_CHUNK = 64  #: cells looked up in one statement


def array_key(array: SymbolArray) -> str:
    """Return the digest by which the database knows an array.

    The window is left out, and where placing begins: they change no symbol, so objects
    registered with others stand on the same cells.
    """
    kept = {name: v for name, v in array.definition().items() if name not in ("window", "first")}
    return digest(canonical(kept))


def find_array(connection: Connection, array: SymbolArray) -> int | None:
    """Return the number of an array that objects were registered on, None for a new one."""
    arrays = tables.arrays.c
    return connection.execute(
        select(arrays.array_id).where(arrays.definition_sha256 == array_key(array))
    ).scalar_one_or_none()


def occupancy(connection: Connection, array: SymbolArray) -> Occupancy:
    """Return which cells of an array objects hold; none of one that is new to the database."""
    array_id = find_array(connection, array)
    tiles = {} if array_id is None else taken_tiles(connection, array_id)
    return Occupancy.from_tiles(tiles, array)


def occupied_cells(connection: Connection, array_id: int | None) -> Cells:
    """Return the cells of an array that objects hold: rows (n,) and columns (n,), sorted.

    An array that the database does not know yet, None, has no cells taken.
    """
    return cells_of_tiles({} if array_id is None else taken_tiles(connection, array_id))


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


def held_cells(connection: Connection, array_id: int) -> NDArray[np.int64]:
    """Return every registered cell of an array, (n, 5): row, column, object, face, label.

    Sorted by row and column.
    """
    cells = tables.cells.c
    rows = connection.execute(
        select(cells.row, cells.column, cells.object_id, cells.face_id, cells.label)
        .where(cells.array_id == array_id)
        .order_by(cells.row, cells.column)
    )
    return np.fromiter(chain.from_iterable(rows), dtype=np.int64).reshape(-1, 5)


def faces_at(
    connection: Connection, array_id: int, rows: ArrayLike, columns: ArrayLike
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return which object and which face hold each cell; -1 where nothing is registered.

    Parameters
    ----------
    rows, columns
        Cells on the torus, 0 <= row < rows; broadcast together to (n,).

    Returns
    -------
    Object numbers (n,) and face numbers (n,).
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
                cells.array_id == array_id,
                cells.row.in_(near_rows),
                cells.column.in_(near_columns),
            )
        ):
            held[row, column] = (object_id, face_id)
    found = np.array([held.get(cell, (-1, -1)) for cell in asked], dtype=np.int64).reshape(-1, 2)
    return found[:, 0], found[:, 1]
