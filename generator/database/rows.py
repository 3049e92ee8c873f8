"""Rows of the tables from a polyhedron and its layout. Thesis 6.3, figure 6.16.

Each function yields tables with their rows in an order that foreign keys allow.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Table, bindparam, func, insert, select

from generator.database import tables
from generator.layout.placement import Layout
from generator.polyhedron.frame import edge_length, face_area, face_polygon
from generator.polyhedron.winged import Polyhedron

Row = dict[str, Any]
Rows = list[Row]


def insert_rows(connection: Connection, table: Table, rows: Rows) -> None:
    """Insert rows of one table, all of which name the same columns; none is well, too.

    A server gets one statement with an array per column: a message per row costs twice the time.
    """
    if not rows:
        return
    if connection.dialect.name != "postgresql":
        connection.execute(insert(table), rows)
        return
    from sqlalchemy.dialects.postgresql import ARRAY

    names = list(rows[0])
    columns = [
        bindparam(None, [row[name] for row in rows], type_=ARRAY(table.c[name].type))
        for name in names
    ]
    connection.execute(insert(table).from_select(names, select(*map(func.unnest, columns))))


_EQUAL = 1e-6  #: lengths that differ by less than this share are equal; angles, rad


def face_type(polygon: Sequence[NDArray[np.float64]]) -> str:
    """Return triangle, square, rectangle, quadrilateral or polygon of loops (k, 2), mm.

    >>> face_type([np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])])
    'rectangle'
    """
    outer = polygon[0]
    if len(polygon) > 1 or len(outer) > 4:
        return "polygon"
    if len(outer) == 3:
        return "triangle"
    sides = np.roll(outer, -1, axis=0) - outer
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    following = np.roll(sides, -1, axis=0)
    cosines = np.sum(sides * following, axis=1) / (lengths * np.roll(lengths, -1))
    if np.abs(cosines).max() > _EQUAL:
        return "quadrilateral"
    return "square" if np.ptp(lengths) <= _EQUAL * lengths.max() else "rectangle"


def polyhedron_rows(object_id: int, polyhedron: Polyhedron) -> Iterator[tuple[Table, Rows]]:
    """Yield the thesis's vertices, faces, edges, and the tables that connect them."""
    edges, faces = polyhedron.edges, polyhedron.faces
    rows: dict[Table, Rows] = {
        tables.vertices: [
            {"vertex_id": k, "x_vertex": x, "y_vertex": y, "z_vertex": z}
            for k, (x, y, z) in enumerate(polyhedron.vertices.tolist())
        ],
        tables.faces: [
            {
                "face_id": k,
                "name": face.name,
                "face_type": face_type(face_polygon(polyhedron, k)),
                "number_of_edges": sum(map(len, face.loops)),
                "face_area": face_area(polyhedron, k),
            }
            for k, face in enumerate(faces)
        ],
        tables.edges: [
            {
                "edge_id": k,
                "face_id": edge.left,
                "right_face_id": edge.right,
                "start_vertex_id": edge.start,
                "end_vertex_id": edge.end,
                "left_previous_id": edge.left_previous,
                "left_next_id": edge.left_next,
                "right_previous_id": edge.right_previous,
                "right_next_id": edge.right_next,
                "edge_length": edge_length(polyhedron, k),
            }
            for k, edge in enumerate(edges)
        ],
        tables.faces_to_vertices: [
            {"face_id": face_id, "loop": loop_id, "position": k, "vertex_id": vertex}
            for face_id, face in enumerate(faces)
            for loop_id, loop in enumerate(face.loops)
            for k, vertex in enumerate(loop)
        ],
        tables.edges_to_vertices: [
            {"edge_id": k, "position": position, "vertex_id": vertex}
            for k, edge in enumerate(edges)
            for position, vertex in enumerate((edge.start, edge.end))
        ],
    }
    for table, of_table in rows.items():
        yield table, [{"object_id": object_id, **row} for row in of_table]


def layout_rows(object_id: int, array_id: int, layout: Layout) -> Iterator[tuple[Table, Rows]]:
    """Yield the placements of the faces, and the cells that they hold."""
    placements = [
        {
            "object_id": object_id,
            "face_id": face.face,
            "position": k,
            **asdict(face.placement),
            "places": face.places,
            "blank": int(face.face in layout.blank_faces),
        }
        for k, face in enumerate(layout.faces)
    ]
    yield tables.placements, placements
    for face in layout.faces:
        symbols = np.stack([face.rows, face.columns, face.labels], axis=1).tolist()
        cells = [
            {
                "array_id": array_id,
                "row": row,
                "column": column,
                "object_id": object_id,
                "face_id": face.face,
                "position": k,
                "label": label,
                "x_mm": x,
                "y_mm": y,
            }
            for k, ((row, column, label), (x, y)) in enumerate(
                zip(symbols, face.centres_mm.tolist(), strict=True)
            )
        ]
        yield tables.cells, cells


def definition_number(connection: Connection, table: Table, **values: Any) -> int:
    """Return the number of an array or alphabet by its digest; insert it where it is new."""
    (number,) = table.primary_key.columns
    same = table.c.definition_sha256 == values["definition_sha256"]
    known: int | None = connection.execute(select(number).where(same)).scalar_one_or_none()
    if known is not None:
        return known
    new: int = connection.execute(insert(table).values(values).returning(number)).scalar_one()
    return new


def definition_of(connection: Connection, table: Table, of_object: Mapping[str, Any]) -> Row:
    """Return the array or alphabet that a row of `objects` names, without its number."""
    (number,) = table.primary_key.columns
    found = connection.execute(select(table).where(number == of_object[number.name])).one()
    return {name: value for name, value in found._asdict().items() if name != number.name}
