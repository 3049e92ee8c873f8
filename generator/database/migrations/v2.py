"""Version 2: taken cells as bits, retired and imported objects."""

from __future__ import annotations

import numpy as np
from sqlalchemy import (
    BigInteger,
    Column,
    Connection,
    ForeignKey,
    Integer,
    LargeBinary,
    MetaData,
    PrimaryKeyConstraint,
    Table,
    insert,
    text,
)

TILE = 64  #: rows and columns of a tile

COLUMNS = {
    "objects": ("retired_utc VARCHAR(32)",),
    "provenance": ("imported_from TEXT", "imported_utc VARCHAR(32)"),
}  #: that are new


def upgrade(connection: Connection) -> None:
    """Bring a database of version 1 to version 2."""
    for table, columns in COLUMNS.items():
        for column in columns:
            connection.execute(text(f"ALTER TABLE {table} ADD COLUMN {column}"))
    metadata = MetaData()
    Table("arrays", metadata, autoload_with=connection)
    occupancy = Table(
        "occupancy",
        metadata,
        Column("array_id", Integer, ForeignKey("arrays.array_id"), nullable=False),
        Column("tile_row", BigInteger, nullable=False),
        Column("tile_column", BigInteger, nullable=False),
        Column("bits", LargeBinary, nullable=False),
        PrimaryKeyConstraint("array_id", "tile_row", "tile_column"),
        sqlite_with_rowid=False,
    )
    occupancy.create(connection)
    _fill(connection, occupancy)


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
