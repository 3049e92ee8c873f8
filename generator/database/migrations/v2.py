"""Version 2: taken cells as bits, retired and imported objects."""

from __future__ import annotations

import numpy as np
from alembic.operations import Operations
from sqlalchemy import (
    BigInteger,
    Column,
    Connection,
    ForeignKey,
    Integer,
    LargeBinary,
    PrimaryKeyConstraint,
    String,
    Table,
    Text,
    insert,
    text,
)

TILE = 64  #: rows and columns of a tile


def upgrade(operations: Operations) -> None:
    """Bring a database of version 1 to version 2."""
    operations.add_column("objects", Column("retired_utc", String(32)))
    operations.add_column("provenance", Column("imported_from", Text))
    operations.add_column("provenance", Column("imported_utc", String(32)))
    occupancy = operations.create_table(
        "occupancy",
        Column("array_id", Integer, ForeignKey("arrays.array_id"), nullable=False),
        Column("tile_row", BigInteger, nullable=False),
        Column("tile_column", BigInteger, nullable=False),
        Column("bits", LargeBinary, nullable=False),
        PrimaryKeyConstraint("array_id", "tile_row", "tile_column"),
        sqlite_with_rowid=False,
    )
    _fill(operations.get_bind(), occupancy)


def _fill(connection: Connection, occupancy: Table) -> None:
    """Set the bit of every cell that an object holds."""
    tiles: dict[tuple[int, int, int], np.ndarray[tuple[int], np.dtype[np.bool_]]] = {}
    for array_id, row, column in connection.execute(
        text('SELECT array_id, "row", "column" FROM cells')
    ):
        tile = (array_id, row // TILE, column // TILE)
        if tile not in tiles:
            tiles[tile] = np.zeros(TILE * TILE, bool)
        tiles[tile][row % TILE * TILE + column % TILE] = True
    if tiles:
        connection.execute(
            insert(occupancy),
            [
                {
                    "array_id": array_id,
                    "tile_row": row,
                    "tile_column": column,
                    "bits": np.packbits(cells, bitorder="little").tobytes(),
                }
                for (array_id, row, column), cells in tiles.items()
            ],
        )
