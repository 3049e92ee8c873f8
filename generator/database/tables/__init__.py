"""The schema: the thesis's six tables, and what encoding adds to them. Thesis 6.3, figure 6.16.

::

    shape.py  objects, vertices, faces, edges, faces_to_vertices, edges_to_vertices
    code.py   arrays, alphabets, placements, cells, occupancy
    made.py   parts, provenance, as_built

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
when it is opened, by `migrations/v2.py` and its successors.
"""

from __future__ import annotations

from sqlalchemy import Column, String, Table, Text

from generator.database.tables.base import metadata
from generator.database.tables.code import alphabets, arrays, cells, occupancy, placements
from generator.database.tables.made import as_built, parts, provenance
from generator.database.tables.shape import (
    edges,
    edges_to_vertices,
    faces,
    faces_to_vertices,
    objects,
    vertices,
)

__all__ = [
    "FORMAT",
    "SCHEMA_VERSION",
    "alphabets",
    "arrays",
    "as_built",
    "cells",
    "edges",
    "edges_to_vertices",
    "faces",
    "faces_to_vertices",
    "meta",
    "metadata",
    "objects",
    "occupancy",
    "parts",
    "placements",
    "provenance",
    "vertices",
]

SCHEMA_VERSION = 3
FORMAT = "encoded-objects"  #: `meta.format`: whose tables these are

meta = Table(
    "meta",
    metadata,
    Column("key", String(64), primary_key=True),  #: format, schema_version, lab_key
    Column("value", Text, nullable=False),
)
