"""Read objects and cells back, exactly as they were registered. Thesis 6.3.

Every function takes a connection, so that several of them see one state of the
database: `with read_transaction(engine) as connection: ...`.
"""

from __future__ import annotations

import json
import math
import re
from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Select, Table, func, literal, select

from generator.alphabet.known import alphabet_from
from generator.alphabet.outline import SymbolStyle
from generator.array import FoldedArray, ProductArray, array_from
from generator.database import tables
from generator.database.registered import (
    ObjectEntry,
    RegisteredArray,
    RegisteredFace,
    RegisteredObject,
    RegisteredPart,
    RegisteredStyle,
)
from generator.database.round_face import round_face
from generator.database.tables import DamagedValueError
from generator.database.transaction import of_rows, place_of
from generator.errors import DatabaseError
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.polyhedron.frame import face_frame, face_polygon
from generator.polyhedron.winged import Developable, Face, Polyhedron, WingedEdge, developable_from

MOST_SYMBOLS = 127  #: of an array; readers keep labels in 8 bits
_PITCHES_MM = (0.03, 10_000.0)  #: no symbol is finer than a beam of resin, or larger than a model


@of_rows
def list_objects(connection: Connection) -> tuple[ObjectEntry, ...]:
    """Return one entry per object, in the order of their names."""
    entries = _entries(connection, _select_entries())
    return tuple(sorted(entries, key=lambda entry: natural_key(entry.name)))


@of_rows
def object_names(connection: Connection) -> tuple[str, ...]:
    """Return the names of all objects, in order; without the counts of `list_objects`."""
    names = tables.objects.c.name
    return tuple(sorted(connection.execute(select(names)).scalars(), key=natural_key))


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Return a key that sorts names as people count.

    >>> sorted(["B-10", "B-2", "A"], key=natural_key)
    ['A', 'B-2', 'B-10']
    """
    runs = re.findall(r"[0-9]+|[^0-9]+", name)
    return tuple((0, int(run), run) if run[0] in "0123456789" else (1, 0, run) for run in runs)


@of_rows
def find_object(connection: Connection, name: str) -> ObjectEntry | None:
    """Return the entry of the object called `name`, None if there is none."""
    found = _entries(connection, _select_entries().where(tables.objects.c.name == name))
    return next(iter(found), None)


def object_entry(connection: Connection, name: str) -> ObjectEntry:
    """Return the entry of the object called `name`; raises as `read_object`."""
    entry = find_object(connection, name)
    if entry is None:
        known = ", ".join(object_names(connection)[:8]) or "none yet"
        raise DatabaseError(
            f"no object is called '{name}'",
            fix=f"registered objects: {known}",
            place=place_of(connection.engine.url),
        )
    return entry


def _select_entries() -> Select[Any]:
    objects, arrays, provenance = tables.objects.c, tables.arrays.c, tables.provenance.c
    faces = (
        select(func.count())
        .select_from(tables.faces)
        .where(tables.faces.c.object_id == objects.object_id)
        .where(tables.faces.c.name.not_like("%.%"))  # F2.2, F2.3, ...: facets of round F2
        .scalar_subquery()
    )
    symbols = (
        select(func.count())
        .select_from(tables.cells)
        .where(tables.cells.c.object_id == objects.object_id)
        .scalar_subquery()
    )
    return (
        select(
            objects.object_id,
            objects.name,
            objects.object_type,
            objects.number_of_vertices,
            objects.number_of_faces,
            faces,
            symbols,
            objects.array_id,
            arrays.profile,
            arrays.rows,
            arrays.columns,
            objects.pitch_mm,
            provenance.spec_hash,
            provenance.tool_version,
            provenance.utc,
            func.coalesce(objects.retired_utc, ""),
            func.coalesce(provenance.imported_from, ""),
            func.coalesce(provenance.imported_utc, ""),
        )
        .select_from(tables.objects)
        .join(tables.arrays)
        .join(tables.provenance)
    )


def _entries(connection: Connection, query: Select[Any]) -> Iterable[ObjectEntry]:
    return (ObjectEntry(*row) for row in connection.execute(query))


@of_rows
def read_object(connection: Connection, name: str) -> RegisteredObject:
    """Return everything about the object called `name`; all numbers bit for bit.

    Raises
    ------
    DatabaseError
        No object has this name; the fix lists names that are known.
    """
    entry = object_entry(connection, name)
    polyhedron = _read_polyhedron(connection, entry)
    layout = _layout_of(connection, entry)
    alphabet, text, *style = connection.execute(
        select(tables.alphabets.c.definition, tables.provenance.c.spec, *tables.STYLE)
        .select_from(tables.objects)
        .join(tables.alphabets)
        .join(tables.provenance)
        .where(tables.objects.c.object_id == entry.object_id)
    ).one()
    spec, glyphs = json.loads(text), json.loads(alphabet)
    alphabet_from(glyphs)  # or an AlphabetError
    return RegisteredObject(
        entry=entry,
        polyhedron=polyhedron,
        faces=_read_faces(connection, entry, polyhedron, layout, surfaces_of(spec)),
        layout=layout,
        style=_style(*style),
        array=read_array(connection, entry.array_id),
        alphabet=glyphs,
        parts=read_parts(connection, entry.object_id),
        spec=spec,
    )


def surfaces_of(spec: Any) -> tuple[Developable, ...]:
    """Return the round faces of an object from its registered spec."""
    known = spec.get("surfaces", ()) if isinstance(spec, dict) else ()
    return tuple(developable_from(one) for one in known)


@of_rows
def read_surfaces(connection: Connection) -> dict[int, tuple[Developable, ...]]:
    """Return the round faces of all objects that have some, by their numbers."""
    known = tables.provenance.c
    query = select(known.object_id, known.spec).where(known.spec.like('%"surfaces":[%'))
    found = {number: surfaces_of(json.loads(spec)) for number, spec in connection.execute(query)}
    return {number: surfaces for number, surfaces in found.items() if surfaces}


@of_rows
def read_layout(connection: Connection, name: str) -> Layout:
    """Return the layout of the object called `name`, bit for bit what was registered."""
    return _layout_of(connection, object_entry(connection, name))


def _layout_of(connection: Connection, entry: ObjectEntry) -> Layout:
    known = connection.execute(
        select(tables.objects.c.layout, tables.objects.c.layout_warnings).where(
            tables.objects.c.object_id == entry.object_id
        )
    ).one()
    symbols: dict[int, list[tuple[Any, ...]]] = defaultdict(list)
    cells = tables.cells.c
    for face, *symbol in connection.execute(
        select(cells.face_id, cells.row, cells.column, cells.label, cells.x_mm, cells.y_mm)
        .where(cells.object_id == entry.object_id)
        .order_by(cells.face_id, cells.position)
    ):
        symbols[face].append(tuple(symbol))
    faces, blank = [], []
    for row in connection.execute(_rows_of_object(tables.placements, entry, "position")):
        if row.blank:
            blank.append(row.face_id)
        r, c, label, x, y = (
            zip(*symbols[row.face_id], strict=True) if symbols[row.face_id] else ((),) * 5
        )
        faces.append(
            FaceLayout(
                face=row.face_id,
                placement=Placement(row.row, row.column, row.rotation_rad, row.x_mm, row.y_mm),
                rows=read_only(r, np.int64),
                columns=read_only(c, np.int64),
                labels=read_only(label, np.int64),
                centres_mm=read_only(np.array([x, y], dtype=np.float64).T),
                places=row.places,
            )
        )
    return Layout(
        kind=known.layout,
        pitch_mm=entry.pitch_mm,
        faces=tuple(faces),
        blank_faces=tuple(sorted(blank)),
        warnings=tuple(json.loads(known.layout_warnings)),
    )


@of_rows
def read_styles(connection: Connection) -> tuple[RegisteredStyle, ...]:
    """Return array and style of every object, by its number."""
    objects = tables.objects.c
    query = (
        select(
            objects.object_id,
            objects.name,
            objects.array_id,
            tables.alphabets.c.definition,
            *tables.STYLE,
        )
        .select_from(tables.objects)
        .join(tables.alphabets)
        .order_by(objects.object_id)
    )
    return tuple(
        RegisteredStyle(number, name, array, alphabet, _style(*style))
        for number, name, array, alphabet, *style in connection.execute(query)
    )


def _style(*lengths: float) -> SymbolStyle:
    style = SymbolStyle(*lengths)
    check_pitch(style.pitch_mm)
    steep = abs(style.draft_rad) >= math.pi / 2
    if style.stroke_mm <= 0 or max(map(abs, lengths)) > _PITCHES_MM[1] or steep:
        raise DamagedValueError(f"symbols of {style}")
    return style


def check_pitch(pitch_mm: float) -> None:
    """Refuse a stored pitch that no symbols have."""
    if not _PITCHES_MM[0] <= pitch_mm <= _PITCHES_MM[1]:
        raise DamagedValueError(f"a pitch of {pitch_mm:g} mm")


@of_rows
def read_array(connection: Connection, array_id: int) -> RegisteredArray:
    """Return the array with this number."""
    row = connection.execute(
        select(tables.arrays).where(tables.arrays.c.array_id == array_id)
    ).one()
    least = min(row.rows, row.columns, row.window_rows, row.window_columns)
    if least < 1 or not 2 <= row.order <= MOST_SYMBOLS:
        cause = f"an array of {row.rows} x {row.columns} cells and {row.order} symbols"
        raise DamagedValueError(cause)
    return RegisteredArray(
        array_id=row.array_id,
        profile=row.profile,
        definition=json.loads(row.definition),
        rows=row.rows,
        columns=row.columns,
        window=(row.window_rows, row.window_columns),
        order=row.order,
        lab_key=row.lab_key or "",
    )


@of_rows
def make_array(connection: Connection, array_id: int) -> FoldedArray | ProductArray:
    """Return the symbols of the array with this number, made from its definition."""
    return array_from(read_array(connection, array_id).definition)


@of_rows
def read_parts(connection: Connection, object_id: int) -> tuple[RegisteredPart, ...]:
    """Return the parts of an object in the order in which they were written."""
    parts = tables.parts.c
    return tuple(
        RegisteredPart(
            row.name, row.format, row.file, row.sha256, read_only(json.loads(row.T_object_part))
        )
        for row in connection.execute(
            select(tables.parts).where(parts.object_id == object_id).order_by(parts.position)
        )
    )


def _rows_of_object(table: Table, entry: ObjectEntry, *order: str) -> Select[Any]:
    return (
        select(table)
        .where(table.c.object_id == literal(entry.object_id))
        .order_by(*(table.c[name] for name in order))
    )


def _read_polyhedron(connection: Connection, entry: ObjectEntry) -> Polyhedron:
    points = [
        (row.x_vertex, row.y_vertex, row.z_vertex)
        for row in connection.execute(_rows_of_object(tables.vertices, entry, "vertex_id"))
    ]
    loops: dict[int, dict[int, list[int]]] = defaultdict(lambda: defaultdict(list))
    query = _rows_of_object(tables.faces_to_vertices, entry, "face_id", "loop", "position")
    for row in connection.execute(query):
        loops[row.face_id][row.loop].append(row.vertex_id)
    faces = tuple(
        Face(row.name, tuple(tuple(loop) for loop in loops[row.face_id].values()))
        for row in connection.execute(_rows_of_object(tables.faces, entry, "face_id"))
    )
    edges = tuple(
        WingedEdge(
            start=row.start_vertex_id,
            end=row.end_vertex_id,
            left=row.face_id,
            right=row.right_face_id,
            left_previous=row.left_previous_id,
            left_next=row.left_next_id,
            right_previous=row.right_previous_id,
            right_next=row.right_next_id,
        )
        for row in connection.execute(_rows_of_object(tables.edges, entry, "edge_id"))
    )
    if (len(points), len(faces)) != (entry.number_of_vertices, entry.number_of_faces):
        cause = f"{len(points)} vertices and {len(faces)} faces of '{entry.name}'"
        raise DamagedValueError(cause)
    return Polyhedron(entry.object_type, read_only(points), faces, edges)


def _read_faces(
    connection: Connection,
    entry: ObjectEntry,
    polyhedron: Polyhedron,
    layout: Layout,
    surfaces: tuple[Developable, ...],
) -> tuple[RegisteredFace, ...]:
    placements = {
        face.face: face.placement for face in layout.faces if face.face not in layout.blank_faces
    }
    rounds = {one.carrier: round_face(polyhedron, one) for one in surfaces}
    return tuple(
        RegisteredFace(
            face_id=k,
            name=row.name,
            face_type=row.face_type,
            area_mm2=row.face_area,
            T_object_face=read_only(face_frame(polyhedron, k)),
            polygon_mm=tuple(read_only(loop) for loop in face_polygon(polyhedron, k)),
            placement=placements.get(k),
            round=rounds.get(k),
        )
        for row in connection.execute(_rows_of_object(tables.faces, entry, "face_id"))
        for k in [row.face_id]
    )


def read_only(values: Any, dtype: type[np.generic] = np.float64) -> NDArray[Any]:
    """Return a read-only array of its own, contiguous."""
    array = np.array(values, dtype=dtype, order="C")
    array.setflags(write=False)
    return array
