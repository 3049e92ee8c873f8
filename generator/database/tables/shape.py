"""The thesis's six tables: objects, their vertices, faces and edges. Thesis 6.3, figure 6.16."""

from __future__ import annotations

from sqlalchemy import (
    CheckConstraint,
    Column,
    ForeignKey,
    Index,
    Integer,
    PrimaryKeyConstraint,
    String,
    Table,
    Text,
    UniqueConstraint,
)

from generator.database.tables.base import REAL, foreign_key, metadata, of_object

# OBJECTS of the thesis, with the array and the way its symbols are embossed.
objects = Table(
    "objects",
    metadata,
    Column("object_id", Integer, primary_key=True),
    Column("name", Text, nullable=False, unique=True),
    Column("object_type", Text, nullable=False),  #: cube, box, tetrahedron, ..., file
    Column("number_of_vertices", Integer, nullable=False),
    Column("number_of_faces", Integer, nullable=False),
    Column("array_id", ForeignKey("arrays.array_id"), nullable=False, index=True),
    Column("alphabet_id", ForeignKey("alphabets.alphabet_id"), nullable=False, index=True),
    Column("pitch_mm", REAL, nullable=False),
    Column("height_mm", REAL, nullable=False),
    Column("stroke_mm", REAL, nullable=False),
    Column("draft_rad", REAL, nullable=False),
    Column("chamfer_mm", REAL, nullable=False),
    Column("layout", Text, nullable=False),  #: net | faces
    Column("layout_warnings", Text, nullable=False),  #: JSON, texts for the person who asked
    Column("retired_utc", String(32)),  #: ISO 8601; NULL while in use. Its cells stay taken
    UniqueConstraint("object_id", "array_id"),  # so that cells can name both
    CheckConstraint("name <> ''", name="object_has_name"),
    CheckConstraint("pitch_mm > 0 AND stroke_mm > 0", name="symbols_have_size"),
    CheckConstraint("layout IN ('net', 'faces')", name="layout_known"),
)

vertices = Table(
    "vertices",
    metadata,
    of_object(),
    Column("vertex_id", Integer, nullable=False),
    Column("x_vertex", REAL, nullable=False),
    Column("y_vertex", REAL, nullable=False),
    Column("z_vertex", REAL, nullable=False),
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
    Column("edge_id", Integer, nullable=False),
    Column("face_id", Integer, nullable=False),
    Column("right_face_id", Integer, nullable=False),
    Column("start_vertex_id", Integer, nullable=False),
    Column("end_vertex_id", Integer, nullable=False),
    Column("left_previous_id", Integer, nullable=False),
    Column("left_next_id", Integer, nullable=False),
    Column("right_previous_id", Integer, nullable=False),
    Column("right_next_id", Integer, nullable=False),
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
    Column("face_id", Integer, nullable=False),
    Column("loop", Integer, nullable=False),
    Column("position", Integer, nullable=False),
    Column("vertex_id", Integer, nullable=False),
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
