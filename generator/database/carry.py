"""Copy objects from one lab's database into another, with the cells that they have.

Connection + names -> rows of the other database: the same numbers of vertices, faces and
cells, another number of the object. An object is refused when one of its cells is held there
or its name is; when it is there already, the same on the same cells, nothing is done.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import URL, Connection, insert

from generator.database import tables
from generator.database.carry_check import (
    ArrayHere,
    CopyRefusedError,
    array_here,
    check_alphabet,
    check_cells,
    geometry,
    rows_of,
    same_object,
)
from generator.database.entries import find_object, list_objects, object_entry
from generator.database.insert import insert_rows
from generator.database.occupancy import take_cells
from generator.database.registered import ObjectEntry
from generator.database.rows import definition_number, definition_of
from generator.database.transaction import place_of
from generator.database.url import part_file, part_path
from generator.errors import DatabaseError


@dataclass(frozen=True, slots=True)
class Origin:
    """Where objects come from."""

    name: str  #: of the database, as people know it
    utc: str  #: when they came, ISO 8601


@dataclass(frozen=True, slots=True)
class RefusedCopy:
    """An object that cannot be carried over."""

    name: str
    cause: str  #: what follows the name
    fix: str


@dataclass(frozen=True, slots=True)
class CopyReport:
    """What became of the objects; names as they are in the database that receives them."""

    copied: tuple[str, ...]
    known: tuple[str, ...]  #: were there already, the same
    refused: tuple[RefusedCopy, ...]


def copy_objects(
    source: Connection,
    target: Connection,
    *,
    names: Sequence[str] = (),
    renamed: Mapping[str, str] | None = None,
    origin: Origin | None = None,
    skip_refused: bool = False,
    homes: tuple[URL, URL] | None = None,
) -> CopyReport:
    """Copy objects with cells, provenance, names of files, and how their prints came out.

    Parameters
    ----------
    source
        Of a `reading` transaction.
    target
        Of a `writing` transaction.
    names
        Which objects; empty for all.
    renamed
        New names of objects, by their names in `source`.
    origin
        Noted with each object that is copied; without it, their own is kept.
    skip_refused
        Copy the others where some are refused.
    homes
        Where people have the two databases, if not where the connections are: from there
        the files of parts are named.

    Raises
    ------
    DatabaseError
        An object is refused (unless `skip_refused`), or no object has a name asked for.
    """
    new_names = dict(renamed or {})
    for name in (*names, *new_names):
        object_entry(source, name)
    homes = homes or (source.engine.url, target.engine.url)
    arrays: dict[int, ArrayHere] = {}
    copied, known, refused = [], [], []
    for entry in list_objects(source):
        if names and entry.name not in names:
            continue
        name = new_names.get(entry.name, entry.name)
        try:
            if _copy_object(source, target, entry, name, arrays, origin, homes):
                copied.append(name)
            else:
                known.append(name)
        except CopyRefusedError as error:
            refused.append(RefusedCopy(name, error.cause, error.fix))
    if refused and not skip_refused:
        raise _refusal(refused, place_of(homes[1]))
    return CopyReport(tuple(copied), tuple(known), tuple(refused))


def _copy_object(
    source: Connection,
    target: Connection,
    entry: ObjectEntry,
    name: str,
    arrays: dict[int, ArrayHere],
    origin: Origin | None,
    homes: tuple[URL, URL],
) -> bool:
    """Copy one object, if it is new; check all of it before the first row is written."""
    present = find_object(target, name)
    if present is not None:
        if same_object(source, entry, target, present):
            return False
        fix = f"import it under a name of its own: --rename '{entry.name}=NEW'"
        raise CopyRefusedError("is the name of another object here", fix)
    if entry.array_id not in arrays:
        arrays[entry.array_id] = array_here(source, target, entry.array_id)
    here = arrays[entry.array_id]
    (row,) = rows_of(source, tables.objects, entry.object_id)
    check_alphabet(source, row["alphabet_id"])
    rows = geometry(source, entry.object_id)
    check_cells(target, name, here, rows[tables.cells])

    array_id, alphabet_id = (
        definition_number(target, table, **definition_of(source, table, row))
        for table in (tables.arrays, tables.alphabets)
    )
    del row["object_id"]
    row |= {"name": name, "array_id": array_id, "alphabet_id": alphabet_id}
    inserted = insert(tables.objects).values(row).returning(tables.objects.c.object_id)
    new = {"object_id": target.execute(inserted).scalar_one()}
    for table, old in rows.items():
        changed = new | ({"array_id": array_id} if table is tables.cells else {})
        insert_rows(target, table, [row | changed for row in old])
    cells = rows[tables.cells]
    at = tuple(np.array([cell[key] for cell in cells], np.int64) for key in ("row", "column"))
    take_cells(target, array_id, (at[0], at[1]))
    parts = rows_of(source, tables.parts, entry.object_id)
    for part in parts:
        part["file"] = part_file(homes[1], str(part_path(homes[0], part["file"])))
    insert_rows(target, tables.parts, [part | new for part in parts])
    came = {} if origin is None else {"imported_from": origin.name, "imported_utc": origin.utc}
    prints = rows_of(source, tables.as_built, entry.object_id)
    for print_ in prints:
        del print_["as_built_id"]
    insert_rows(target, tables.as_built, [print_ | new for print_ in prints])
    provenance = rows_of(source, tables.provenance, entry.object_id)
    insert_rows(target, tables.provenance, [row | new | came for row in provenance])
    return True


def _refusal(refused: Sequence[RefusedCopy], place: str) -> DatabaseError:
    """Return the error that names every object that is refused."""
    causes = "; ".join(f"'{each.name}' {each.cause}" for each in refused)
    fixes = "; ".join(dict.fromkeys(each.fix for each in refused))
    return DatabaseError(f"nothing was imported: {causes}", fix=fixes, place=place)
