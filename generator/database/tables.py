"""The schema: the thesis's six tables, and what encoding adds to them. Thesis 6.3, figure 6.16.

Units: mm, radians. Numbers of vertices, faces and edges are those of the polyhedron
(`generator.polyhedron.winged`), zero-based, and name a row together with `object_id`.
Frames: vertices in the object frame; centres of cells in the face frame; placements
take the face frame to the array (`generator.layout.placement`).

Versions
--------
1
    meta, arrays, alphabets, objects, vertices, faces, edges, faces_to_vertices,
    edges_to_vertices, placements, cells, parts, provenance.
2
    occupancy; objects.retired_utc; provenance.imported_from, provenance.imported_utc.
3
    meta.lab_key and arrays.lab_key: every lab has arrays of its own, and `definition` may
    say `permutation` and `first`. Databases of earlier versions have no key and keep the
    published arrays. as_built.

What a version promises: a reader of version n reads every database of version n.
A change that a reader of version n would misread raises `SCHEMA_VERSION`, and
`open.py` refuses the newer file with the reason. An older one is brought to this version
when it is opened, by `migrations/vN.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from operator import index
from typing import Any

import sqlalchemy
from sqlalchemy import (
    CheckConstraint,
    Column,
    Double,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    LargeBinary,
    MetaData,
    PrimaryKeyConstraint,
    String,
    Table,
    Text,
    UniqueConstraint,
)
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.types import UserDefinedType

from generator.alphabet.outline import SymbolStyle

metadata = MetaData()

_Check = Callable[[Any], Any]


class DamagedValueError(SQLAlchemyError):
    """A value that this tool never writes there; `of_rows` and transactions explain it."""


def _real(value: Any) -> float:
    if type(value) in (float, int) and -_MOST <= value <= _MOST:
        return float(value)
    raise DamagedValueError(f"{value!r:.40} in a column of lengths and angles")


_MOST = 1e9  #: mm2; models are up to 10 m


# SQLite keeps a value of any type in any column, so each is checked as it is read: `of_rows` tells
# of the TypeError that `index` raises. A million cells are read here, which is why it is in C.
class _Whole:
    def result_processor(self, _dialect: object, _coltype: object) -> _Check:
        return index


class Integer(_Whole, sqlalchemy.Integer):
    """A whole number, never NULL."""


class BigInteger(_Whole, sqlalchemy.BigInteger):
    """A whole number beyond 31 bits, never NULL."""


class _SqliteDouble(UserDefinedType[float]):
    """An IEEE 754 double that SQLite stores as it is.

    A column of REAL affinity is written as an integer where the value has no
    fraction, which turns -0.0 into 0.0: the same spec would give other bytes when
    its layout is read back. A type name with BLOB in it has no affinity.
    """

    cache_ok = True

    def get_col_spec(self, **_: Any) -> str:
        return "DOUBLE_BLOB"

    def result_processor(self, _dialect: object, _coltype: object) -> _Check:
        return _real


REAL: Double[float] = Double().with_variant(_SqliteDouble(), "sqlite")


def required(kind: Any, *names: str) -> list[Column[Any]]:
    """Return columns of one type that are never NULL."""
    return [Column(name, kind, nullable=False) for name in names]


def of_object() -> Column[int]:
    """Return the column that ties a row to its object, and removes it with the object."""
    return Column(
        "object_id", Integer, ForeignKey("objects.object_id", ondelete="CASCADE"), nullable=False
    )


def foreign_key(table: str, column: str, *, key: str, **options: Any) -> ForeignKeyConstraint:
    """Return a foreign key from (object_id, column) to (object_id, key) of `table`.

    It removes nothing: an object goes as a whole, a single vertex or face does not.
    """
    return ForeignKeyConstraint(
        ["object_id", column], [f"{table}.object_id", f"{table}.{key}"], **options
    )


# OBJECTS of the thesis, with the array and the way its symbols are embossed.
objects = Table(
    "objects",
    metadata,
    Column("object_id", Integer, primary_key=True),
    Column("name", Text, nullable=False, unique=True),
    Column("object_type", Text, nullable=False),  #: cube, box, tetrahedron, ..., file
    *required(Integer, "number_of_vertices", "number_of_faces"),
    Column("array_id", ForeignKey("arrays.array_id"), nullable=False, index=True),
    Column("alphabet_id", ForeignKey("alphabets.alphabet_id"), nullable=False, index=True),
    *required(REAL, "pitch_mm", "height_mm", "stroke_mm", "draft_rad", "chamfer_mm"),
    Column("layout", Text, nullable=False),  #: net | faces
    Column("layout_warnings", Text, nullable=False),  #: JSON, texts for the person who asked
    Column("retired_utc", String(32)),  #: ISO 8601; NULL while in use. Its cells stay taken
    UniqueConstraint("object_id", "array_id"),  # so that cells can name both
    CheckConstraint("name <> ''", name="object_has_name"),
    CheckConstraint("pitch_mm > 0 AND stroke_mm > 0", name="symbols_have_size"),
    CheckConstraint("layout IN ('net', 'faces')", name="layout_known"),
)

STYLE = tuple(objects.c[field.name] for field in fields(SymbolStyle))  #: of an object's symbols

vertices = Table(
    "vertices",
    metadata,
    of_object(),
    Column("vertex_id", Integer, nullable=False),
    *required(REAL, "x_vertex", "y_vertex", "z_vertex"),
    PrimaryKeyConstraint("object_id", "vertex_id"),
    sqlite_with_rowid=False,
)

faces = Table(
    "faces",
    metadata,
    of_object(),
    Column("face_id", Integer, nullable=False),
    Column("name", Text, nullable=False),
    Column("face_type", Text, nullable=False),  #: triangle, square, rectangle, polygon, ...
    Column("number_of_edges", Integer, nullable=False),  #: of all loops
    Column("face_area", REAL, nullable=False),  #: mm2, holes taken off
    PrimaryKeyConstraint("object_id", "face_id"),
    CheckConstraint("number_of_edges >= 3", name="face_has_edges"),
    CheckConstraint("face_area > 0", name="face_has_area"),
    sqlite_with_rowid=False,
)

# EDGES of the thesis: `face_id` is the left face, which holds the edge from start to end.
# The links to neighbouring edges are checked at the commit, since edges come one after
# another; without an index each of them would search all edges of the object.
_LINKS = ("left_previous_id", "left_next_id", "right_previous_id", "right_next_id")
edges = Table(
    "edges",
    metadata,
    of_object(),
    *required(Integer, "edge_id", "face_id", "right_face_id", "start_vertex_id", "end_vertex_id"),
    *required(Integer, *_LINKS),
    Column("edge_length", REAL, nullable=False),  #: mm
    PrimaryKeyConstraint("object_id", "edge_id"),
    foreign_key("faces", "face_id", key="face_id"),
    foreign_key("faces", "right_face_id", key="face_id"),
    foreign_key("vertices", "start_vertex_id", key="vertex_id"),
    foreign_key("vertices", "end_vertex_id", key="vertex_id"),
    *(
        foreign_key("edges", link, key="edge_id", deferrable=True, initially="DEFERRED")
        for link in _LINKS
    ),
    *(Index(f"edges_by_{link}", "object_id", link) for link in _LINKS),
    CheckConstraint("edge_length > 0", name="edge_has_length"),
    CheckConstraint("start_vertex_id <> end_vertex_id", name="edge_has_two_ends"),
    sqlite_with_rowid=False,
)

# A face's loops in order: `loop` 0 is the outer one, the others are its holes.
faces_to_vertices = Table(
    "faces_to_vertices",
    metadata,
    of_object(),
    *required(Integer, "face_id", "loop", "position", "vertex_id"),
    PrimaryKeyConstraint("object_id", "face_id", "loop", "position"),
    foreign_key("faces", "face_id", key="face_id"),
    foreign_key("vertices", "vertex_id", key="vertex_id"),
    sqlite_with_rowid=False,
)

edges_to_vertices = Table(
    "edges_to_vertices",
    metadata,
    of_object(),
    Column("edge_id", Integer, nullable=False),
    Column("position", Integer, nullable=False),  #: 0 start, 1 end
    Column("vertex_id", Integer, nullable=False),
    PrimaryKeyConstraint("object_id", "edge_id", "position"),
    foreign_key("edges", "edge_id", key="edge_id"),
    foreign_key("vertices", "vertex_id", key="vertex_id"),
    CheckConstraint("position IN (0, 1)", name="edge_end"),
    sqlite_with_rowid=False,
)


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
    *required(BigInteger, "rows", "columns"),
    *required(Integer, "window_rows", "window_columns"),
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
    *required(BigInteger, "row", "column"),
    *required(REAL, "rotation_rad", "x_mm", "y_mm"),
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
    *required(BigInteger, "row", "column"),
    *required(Integer, "object_id", "face_id"),
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
    *required(BigInteger, "tile_row", "tile_column"),
    Column("bits", LargeBinary, nullable=False),  #: 512 bytes
    PrimaryKeyConstraint("array_id", "tile_row", "tile_column"),
    sqlite_with_rowid=False,
)


# One row per part and file format; a file of many parts (3MF) has a row for each of them.
parts = Table(
    "parts",
    metadata,
    of_object(),
    Column("position", Integer, nullable=False),  #: order in which they were written
    Column("name", Text, nullable=False),
    Column("format", String(16), nullable=False),  #: step, stl, 3mf, glb
    Column("file", Text, nullable=False),  #: from the database's folder; absolute on a server
    Column("sha256", String(64), nullable=False),
    Column("T_object_part", Text, nullable=False),  #: JSON, 4 rows of 4, mm
    PrimaryKeyConstraint("object_id", "name", "format"),
)

provenance = Table(
    "provenance",
    metadata,
    Column("object_id", ForeignKey("objects.object_id", ondelete="CASCADE"), primary_key=True),
    Column("tool_version", Text, nullable=False),
    Column("spec_hash", String(64), nullable=False),  #: SHA-256 of `spec`
    Column("spec", Text, nullable=False),  #: canonical JSON
    Column("utc", String(32), nullable=False),  #: ISO 8601, when it was registered
    Column("imported_from", Text),  #: database that it came from; NULL where it was made here
    Column("imported_utc", String(32)),
)

# How a print came out, from touches (`as_built.py`): of one part of an object, of all its
# parts (`part` NULL), or of whatever a printer makes of a material (`object_id` NULL).
as_built = Table(
    "as_built",
    metadata,
    Column("as_built_id", Integer, primary_key=True),
    Column(
        "object_id",
        sqlalchemy.Integer,  # NULL, too
        ForeignKey("objects.object_id", ondelete="CASCADE"),
        index=True,
    ),
    Column("part", Text),  #: name in `parts`
    *required(Text, "printer", "material"),
    Column("scale_x", REAL, nullable=False),  #: measured length / drawn length
    Column("scale_y", REAL, nullable=False),
    Column("skew_rad", REAL, nullable=False),  #: by which x and y are off a right angle
    Column("stroke_mm", REAL, nullable=False),
    Column("covariance", Text, nullable=False),  #: JSON, 4 rows of 4, in the order above
    Column("touches", Integer, nullable=False),  #: on which it rests
    CheckConstraint("object_id IS NOT NULL OR part IS NULL", name="part_of_an_object"),
    CheckConstraint("scale_x > 0 AND scale_y > 0 AND stroke_mm > 0", name="print_has_size"),
    CheckConstraint("touches > 0", name="print_was_touched"),
)


SCHEMA_VERSION = 3
FORMAT = "encoded-objects"  #: `meta.format`: whose tables these are

meta = Table(
    "meta",
    metadata,
    Column("key", String(64), primary_key=True),  #: format, schema_version, lab_key
    Column("value", Text, nullable=False),
)
