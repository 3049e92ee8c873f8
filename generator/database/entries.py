"""Which objects a database holds: one line for each, with its counts.

Every function takes a connection, as those of `generator.database.read`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from sqlalchemy import Connection, Select, func, select

from generator.database import tables
from generator.database.registered import ObjectEntry
from generator.database.transaction import place_of
from generator.errors import DatabaseError


def list_objects(connection: Connection) -> tuple[ObjectEntry, ...]:
    """Return one entry per object, in the order of their names."""
    entries = _entries(connection, _select_entries())
    return tuple(sorted(entries, key=lambda entry: natural_key(entry.name)))


def object_names(connection: Connection) -> tuple[str, ...]:
    """Return the names of all objects, in order; without the counts of `list_objects`."""
    names = tables.objects.c.name
    return tuple(sorted(connection.execute(select(names)).scalars(), key=natural_key))


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Return what sorts names as people count: Block-2 before Block-10.

    Examples
    --------
    >>> sorted(["B-10", "B-2", "A"], key=natural_key)
    ['A', 'B-2', 'B-10']
    """
    runs = re.findall(r"[0-9]+|[^0-9]+", name)
    return tuple((0, int(run), run) if run[0] in "0123456789" else (1, 0, run) for run in runs)


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
