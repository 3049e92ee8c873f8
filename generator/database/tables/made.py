"""What was made of an object: its files, where it comes from, how prints came out."""

from __future__ import annotations

from sqlalchemy import (
    CheckConstraint,
    Column,
    ForeignKey,
    Integer,
    PrimaryKeyConstraint,
    String,
    Table,
    Text,
)

from generator.database.tables.base import REAL, metadata, of_object

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
    Column("object_id", ForeignKey("objects.object_id", ondelete="CASCADE"), index=True),
    Column("part", Text),  #: name in `parts`
    Column("printer", Text, nullable=False),
    Column("material", Text, nullable=False),
    Column("scale_x", REAL, nullable=False),  #: felt length / drawn length
    Column("scale_y", REAL, nullable=False),
    Column("skew_rad", REAL, nullable=False),  #: by which x and y are felt off a right angle
    Column("stroke_mm", REAL, nullable=False),
    Column("covariance", Text, nullable=False),  #: JSON, 4 rows of 4, in the order above
    Column("touches", Integer, nullable=False),  #: on which it rests
    CheckConstraint("object_id IS NOT NULL OR part IS NULL", name="part_of_an_object"),
    CheckConstraint("scale_x > 0 AND scale_y > 0 AND stroke_mm > 0", name="print_has_size"),
    CheckConstraint("touches > 0", name="print_was_touched"),
)
