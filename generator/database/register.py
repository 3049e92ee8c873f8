"""Register an object: all of it, or nothing. Thesis 6.3.

::

    with write_transaction(engine) as connection:           # nobody else writes from here on
        known = find_object(connection, name)
        layout = lay_out(..., occupancy(connection, array))
        register(connection, ObjectRecord(...))
                                                            # committed, or undone on any error

The primary key of `cells` is the last defence of the promise that no cell is used twice.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
from sqlalchemy import Connection, delete, func, insert, select, update

from generator.alphabet.known import Alphabet
from generator.alphabet.outline import SymbolStyle
from generator.array.contract import SymbolArray
from generator.database import tables
from generator.database.cells import array_key, cells_of, mark_cells
from generator.database.read import find_object, object_entry, read_layout
from generator.database.registered import ObjectEntry, RegisteredPart, canonical, digest
from generator.database.rows import definition_number, insert_rows, layout_rows, polyhedron_rows
from generator.database.tables import objects
from generator.database.transaction import place_of
from generator.errors import DatabaseError
from generator.layout.occupancy import Cells
from generator.layout.placement import Layout
from generator.polyhedron.winged import Polyhedron

_LARGEST = 2**63 - 1  #: of a whole number in the database


@dataclass(frozen=True, slots=True)
class ObjectRecord:
    """An object, ready to be registered."""

    name: str
    polyhedron: Polyhedron
    layout: Layout
    array: SymbolArray
    profile: str  #: name under which the array was asked for
    alphabet: Alphabet
    style: SymbolStyle
    spec: Mapping[str, Any]  #: plain values; equal values are the same object
    tool_version: str
    parts: tuple[RegisteredPart, ...] = ()
    lab_key: str = ""  #: from which the array was made; empty: the published one


def register(connection: Connection, registration: ObjectRecord, *, replace: bool = False) -> int:
    """Insert an object with its faces, edges, cells and parts; return its number.

    The same spec under a registered name changes nothing but its parts; pass the layout that
    `read_layout` returns. `replace` removes what the name held before, and frees its cells; the
    number stays. `connection` is that of a `write_transaction`.

    Raises
    ------
    DatabaseError
        Another spec is registered under this name (without `replace`), another object holds a
        cell, or the array is beyond what a database can count.
    """
    _check(registration)
    known = find_object(connection, registration.name)
    if known is not None:
        require_in_use(connection, known)
        if not replace:
            require_same_spec(connection, known, registration.spec)
            if not same_layout(read_layout(connection, known.name), registration.layout):
                raise DatabaseError(
                    f"'{known.name}' is registered already, on other cells or at other places",
                    fix="replace the registered one with --replace",
                    place=place_of(connection.engine.url),
                )
            record_parts(connection, known.object_id, registration.parts)
            return known.object_id
        remove_object(connection, known.object_id)
    array_id, object_id = _insert_object(connection, registration, known)
    for table, rows in polyhedron_rows(object_id, registration.polyhedron):
        insert_rows(connection, table, rows)
    for table, rows in layout_rows(object_id, array_id, registration.layout):
        insert_rows(connection, table, rows)
    mark_cells(connection, array_id, _all_cells(registration.layout), taken=True)
    record_parts(connection, object_id, registration.parts)
    spec = canonical(registration.spec)
    provenance = {
        "object_id": object_id,
        "tool_version": registration.tool_version,
        "spec_hash": digest(spec),
        "spec": spec,
        "utc": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    insert_rows(connection, tables.provenance, [provenance])
    return object_id


def require_same_spec(connection: Connection, known: ObjectEntry, spec: Any) -> None:
    """Refuse a spec that is not the one under which an object is registered and in use.

    Raises
    ------
    DatabaseError
        With the way out: another name, or `--replace`.
    """
    require_in_use(connection, known)
    if not known.same_spec(spec):
        raise DatabaseError(
            f"'{known.name}' is registered already, with another spec ({known.utc})",
            fix="give this object another name, or replace the registered one with --replace",
            place=place_of(connection.engine.url),
        )


def require_in_use(connection: Connection, known: ObjectEntry) -> None:
    """Refuse to make an object that was retired: its cells stay as they are."""
    if known.retired_utc:
        raise DatabaseError(
            f"'{known.name}' was retired ({known.retired_utc})",
            fix="give this object another name, or bring the retired one back with: "
            f"encode-object retire '{known.name}' --undo",
            place=place_of(connection.engine.url),
        )


def record_parts(connection: Connection, object_id: int, written: Sequence[RegisteredPart]) -> None:
    """Note the files of an object; a part of the same name and format replaces the one before."""
    parts = tables.parts.c
    for part in written:
        connection.execute(
            delete(tables.parts).where(
                parts.object_id == object_id, parts.name == part.name, parts.format == part.format
            )
        )
    last = connection.execute(
        select(func.coalesce(func.max(parts.position), -1)).where(parts.object_id == object_id)
    ).scalar_one()
    insert_rows(
        connection,
        tables.parts,
        [
            {
                "object_id": object_id,
                "position": last + 1 + k,
                "name": part.name,
                "format": part.format,
                "file": part.file,
                "sha256": part.sha256,
                "T_object_part": json.dumps(part.T_object_part.tolist()),
            }
            for k, part in enumerate(written)
        ],
    )


def remove_object(connection: Connection, object_id: int) -> None:
    """Remove an object and all that belongs to it; its cells are free again."""
    array_id = connection.execute(
        select(tables.objects.c.array_id).where(tables.objects.c.object_id == object_id)
    ).scalar_one_or_none()
    if array_id is not None:
        mark_cells(connection, array_id, cells_of(connection, object_id, array_id), taken=False)
    # Children first: a parent's cascade would search every table once per row.
    for table in reversed(tables.metadata.sorted_tables):
        if "object_id" in table.c:
            connection.execute(delete(table).where(table.c.object_id == object_id))


def same_layout(one: Layout, other: Layout) -> bool:
    """Whether two layouts are equal bit for bit."""
    return (
        (one.kind, one.pitch_mm, len(one.faces)) == (other.kind, other.pitch_mm, len(other.faces))
        and (one.blank_faces, one.warnings) == (other.blank_faces, other.warnings)
    ) and all(
        (a.face, a.placement, a.places) == (b.face, b.placement, b.places)
        and np.array_equal(a.rows, b.rows)
        and np.array_equal(a.columns, b.columns)
        and np.array_equal(a.labels, b.labels)
        and a.centres_mm.tobytes() == b.centres_mm.tobytes()
        for a, b in zip(one.faces, other.faces, strict=True)
    )


def _check(registration: ObjectRecord) -> None:
    """Refuse what the tables could not say."""
    array, layout = registration.array, registration.layout
    if max(array.rows, array.columns) > _LARGEST:
        raise DatabaseError(
            f"an array of {array.rows} x {array.columns} is beyond what a database counts, "
            f"{_LARGEST} rows and columns",
            fix="fold it into a more square array",
        )
    if layout.pitch_mm != registration.style.pitch_mm:
        raise ValueError(
            f"layout at {layout.pitch_mm} mm, symbols at {registration.style.pitch_mm}"
        )
    for face in layout.faces:
        if len(face.rows) and not (
            0 <= face.rows.min() <= face.rows.max() < array.rows
            and 0 <= face.columns.min() <= face.columns.max() < array.columns
        ):
            raise ValueError(f"cells of face {face.face} lie beyond the array")
        if not np.isfinite(face.centres_mm).all():
            raise ValueError(f"symbols of face {face.face} have no place")


def _all_cells(layout: Layout) -> Cells:
    rows = [face.rows for face in layout.faces]
    columns = [face.columns for face in layout.faces]
    none = np.empty(0, np.int64)
    return np.concatenate([none, *rows]), np.concatenate([none, *columns])


def _insert_object(
    connection: Connection, registration: ObjectRecord, known: ObjectEntry | None
) -> tuple[int, int]:
    """Return the numbers of array and object."""
    array = registration.array
    window_rows, window_columns = array.window
    array_id = definition_number(
        connection,
        tables.arrays,
        definition_sha256=array_key(array),
        definition=canonical(array.definition()),
        profile=registration.profile,
        rows=array.rows,
        columns=array.columns,
        window_rows=window_rows,
        window_columns=window_columns,
        order=array.order,
        lab_key=registration.lab_key or None,
    )
    alphabet = canonical(registration.alphabet.definition())
    alphabet_id = definition_number(
        connection,
        tables.alphabets,
        definition_sha256=digest(alphabet),
        definition=alphabet,
        name=registration.alphabet.name,
    )
    values = {
        "name": registration.name,
        "object_type": registration.polyhedron.kind,
        "number_of_vertices": len(registration.polyhedron.vertices),
        "number_of_faces": len(registration.polyhedron.faces),
        "array_id": array_id,
        "alphabet_id": alphabet_id,
        **asdict(registration.style),
        "layout": registration.layout.kind,
        "layout_warnings": canonical(list(registration.layout.warnings)),
    }
    if known is not None:
        values["object_id"] = known.object_id
    inserted = insert(objects).values(values).returning(objects.c.object_id)
    return array_id, connection.execute(inserted).scalar_one()


def retire(connection: Connection, name: str) -> ObjectEntry:
    """Mark an object as retired; one that is retired keeps its date. Returns its entry now.

    Raises `DatabaseError` for an unknown name; the fix lists those that are known.
    """
    if not object_entry(connection, name).retired_utc:
        _mark(connection, name, datetime.now(UTC).isoformat(timespec="seconds"))
    return object_entry(connection, name)


def restore(connection: Connection, name: str) -> ObjectEntry:
    """Bring a retired object back into use; raises as `retire`."""
    _mark(connection, object_entry(connection, name).name, None)
    return object_entry(connection, name)


def remove(connection: Connection, name: str) -> ObjectEntry:
    """Remove an object and free its cells; returns what its entry was. Raises as `retire`."""
    entry = object_entry(connection, name)
    remove_object(connection, entry.object_id)
    return entry


def _mark(connection: Connection, name: str, utc: str | None) -> None:
    connection.execute(update(objects).where(objects.c.name == name).values(retired_utc=utc))
