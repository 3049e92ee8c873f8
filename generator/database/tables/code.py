"""Which symbol stands where: arrays, alphabets, placements of faces, cells that are taken."""

from __future__ import annotations

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    Column,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    Integer,
    LargeBinary,
    PrimaryKeyConstraint,
    String,
    Table,
    Text,
)

from generator.database.tables.base import REAL, foreign_key, metadata, of_object

# One array is shared by all objects whose definitions agree but for the window, which
# changes no symbol. The digest is unique and not the text, because PostgreSQL indexes no
# text beyond 2700 bytes.
arrays = Table(
    "arrays",
    metadata,
    Column("array_id", Integer, primary_key=True),
    Column("definition", Text, nullable=False),  #: canonical JSON for `array_from`
    Column("definition_sha256", String(64), nullable=False, unique=True),
    Column("profile", Text, nullable=False),  #: name under which it was first asked for
    Column("rows", BigInteger, nullable=False),
    Column("columns", BigInteger, nullable=False),
    Column("window_rows", Integer, nullable=False),
    Column("window_columns", Integer, nullable=False),
    Column("order", Integer, nullable=False),  #: number of different symbols
    Column("lab_key", String(32)),  #: from which it was made; NULL: the published array
    CheckConstraint('"rows" > 0 AND "columns" > 0', name="array_has_cells"),
    CheckConstraint("window_rows > 0 AND window_columns > 0", name="window_has_cells"),
)

alphabets = Table(
    "alphabets",
    metadata,
    Column("alphabet_id", Integer, primary_key=True),
    Column("name", Text, nullable=False),
    Column("definition", Text, nullable=False),  #: canonical JSON
    Column("definition_sha256", String(64), nullable=False, unique=True),
)

# Face to array, one rigid transform per face; the anchor is the cell (row, column). On a
# blank face, one without symbols, it has no meaning and keeps what the layout said.
placements = Table(
    "placements",
    metadata,
    of_object(),
    Column("face_id", Integer, nullable=False),
    Column("position", Integer, nullable=False),  #: of the face in its layout
    Column("row", BigInteger, nullable=False),
    Column("column", BigInteger, nullable=False),
    Column("rotation_rad", REAL, nullable=False),
    Column("x_mm", REAL, nullable=False),
    Column("y_mm", REAL, nullable=False),
    Column("places", BigInteger, nullable=False),  #: places of the face that can be identified
    PrimaryKeyConstraint("object_id", "face_id"),
    foreign_key("faces", "face_id", key="face_id"),
    Column("blank", Integer, nullable=False),  #: 1 where the face was left blank, else 0
    CheckConstraint('"row" >= 0 AND "column" >= 0', name="anchor_on_array"),
    CheckConstraint("blank IN (0, 1)", name="blank_or_not"),
    sqlite_with_rowid=False,
)

# The primary key is the promise: a cell of an array stands on one face of one object.
cells = Table(
    "cells",
    metadata,
    Column("array_id", Integer, nullable=False),
    Column("row", BigInteger, nullable=False),
    Column("column", BigInteger, nullable=False),
    Column("object_id", Integer, nullable=False),
    Column("face_id", Integer, nullable=False),
    Column("position", Integer, nullable=False),  #: of the symbol in its face's layout
    Column("label", Integer, nullable=False),  #: symbol, 0 ... order - 1
    Column("x_mm", REAL, nullable=False),  #: centre of the symbol, face frame
    Column("y_mm", REAL, nullable=False),
    PrimaryKeyConstraint("array_id", "row", "column"),
    ForeignKeyConstraint(
        ["object_id", "array_id"], ["objects.object_id", "objects.array_id"], ondelete="CASCADE"
    ),
    foreign_key("placements", "face_id", key="face_id"),
    CheckConstraint('"row" >= 0 AND "column" >= 0 AND label >= 0', name="cell_on_array"),
    Index("cells_of_face", "object_id", "face_id", "position", unique=True),
    sqlite_with_rowid=False,
)

# The same cells as bits, a row per tile of 64 x 64 (`occupancy.py`): what placing reads.
occupancy = Table(
    "occupancy",
    metadata,
    Column("array_id", ForeignKey("arrays.array_id"), nullable=False),
    Column("tile_row", BigInteger, nullable=False),
    Column("tile_column", BigInteger, nullable=False),
    Column("bits", LargeBinary, nullable=False),  #: 512 bytes
    PrimaryKeyConstraint("array_id", "tile_row", "tile_column"),
    sqlite_with_rowid=False,
)
