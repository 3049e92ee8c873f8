"""Copy objects from one lab's database into another, with the cells that they have.

Connection + names -> rows of the other database: the same numbers of vertices, faces and
cells, another number of the object. An object is refused when one of its cells is held there
or its name is; when it is there already, the same on the same cells, nothing is done. What the
cells say is checked against the array itself, so that a damaged or hand-made database brings
nothing in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import URL, Connection, Table, insert, select

from encoded_objects.base.files import name_fault
from encoded_objects.base.foreign import DAMAGE
from generator.array.contract import SymbolArray
from generator.database import tables
from generator.database.cells import array_key, faces_at, find_array, mark_cells, occupied_cells
from generator.database.open import part_file, part_path
from generator.database.read import (
    find_object,
    list_objects,
    make_array,
    object_entry,
    read_object,
)
from generator.database.registered import ObjectEntry, digest
from generator.database.rows import definition_number, definition_of, insert_rows
from generator.database.transaction import home_of, of_rows, place_of
from generator.errors import DatabaseError, GeneratorError

Rows = list[dict[str, Any]]
Ints = NDArray[np.int64]

GEOMETRY = (
    tables.vertices,
    tables.faces,
    tables.edges,
    tables.faces_to_vertices,
    tables.edges_to_vertices,
    tables.placements,
    tables.cells,
)  #: what makes two objects the same, in an order that foreign keys allow

PART_SUFFIXES = {kind: f".{kind}" for kind in ("step", "stl", "3mf", "glb")}
"""Ending of the files of parts, by their format."""

_PLACE = ("row", "column")
_DAMAGED = "export it once more, from the lab that registered it"


class CopyRefusedError(Exception):
    """An object may not stand in the receiving database."""

    def __init__(self, cause: str, fix: str) -> None:
        super().__init__(cause)
        self.cause = cause  #: what follows the object's name
        self.fix = fix


@dataclass(frozen=True, slots=True)
class ArrayHere:
    """An array of the giving database, and what is taken of it in the receiving one."""

    array: SymbolArray
    array_id: int | None  #: in the receiving database; None where it is new
    taken: NDArray[np.uint64]  #: row * columns + column


def array_here(source: Connection, target: Connection, array_id: int) -> ArrayHere:
    """Return an array of `source` as it is in `target`; refuse one that was changed."""
    stored = source.execute(select(tables.arrays).where(tables.arrays.c.array_id == array_id)).one()
    try:
        array = make_array(source, array_id)
    except (GeneratorError, ValueError, KeyError, TypeError) as error:
        cause = f"stands on an array that cannot be made: {error}"
        raise CopyRefusedError(cause, _DAMAGED) from error
    said = (stored.definition_sha256, stored.rows, stored.columns, stored.order)
    if (array_key(array), array.rows, array.columns, array.order) != said:
        raise CopyRefusedError("stands on an array whose definition was changed", _DAMAGED)
    number = find_array(target, array)
    return ArrayHere(array, number, _keys(array, *occupied_cells(target, number)))


def check_alphabet(source: Connection, alphabet_id: int) -> None:
    """Refuse an alphabet that is not the one that was registered."""
    alphabets = tables.alphabets.c
    row = source.execute(
        select(alphabets.definition, alphabets.definition_sha256).where(
            alphabets.alphabet_id == alphabet_id
        )
    ).one()
    if digest(row.definition) != row.definition_sha256:
        raise CopyRefusedError("has an alphabet whose definition was changed", _DAMAGED)


def check_readable(source: Connection, name: str) -> None:
    """Refuse an object whose faces or parts nobody could read."""
    try:
        read_object(source, name)
    except (*DAMAGE, GeneratorError) as error:
        raise CopyRefusedError(f"cannot be read: {error}", _DAMAGED) from error


def check_cells(target: Connection, here: ArrayHere, cells: Rows) -> None:
    """Refuse cells that say what the array does not, or that another object holds."""
    r, c, labels = (
        np.array([cell[column] for cell in cells], np.int64)
        for column in ("row", "column", "label")
    )
    if ((r >= here.array.rows) | (c >= here.array.columns)).any():
        raise CopyRefusedError("has cells beyond its array", _DAMAGED)
    wrong = np.flatnonzero(here.array.symbols(r, c) != labels)
    if len(wrong):
        k = wrong[0]
        cause = f"has symbol {labels[k]} on cell ({r[k]}, {c[k]}), where the array has another"
        raise CopyRefusedError(cause, _DAMAGED)
    held = np.isin(_keys(here.array, r, c), here.taken)
    if held.any() and here.array_id is not None:
        raise CopyRefusedError(
            f"needs {np.count_nonzero(held)} cells that "
            f"{_holders(target, here.array_id, r[held], c[held])} here",
            "make it again here from its spec, on cells of its own, and print it again. "
            "Labs with a key each (encode-object lab) have arrays of their own; without one, or "
            "with the same, share one database instead, postgresql://HOST/NAME",
        )


def check_names(name: str, old: str, parts: Rows, home: URL) -> None:
    """Refuse a name that no spec may give, and files that no part of an export has.

    Parameters
    ----------
    name, old
        Of the object here, and where it comes from.
    parts
        Its rows of the table of parts.
    home
        Where it comes from; on a server parts have absolute names.
    """
    if fault := name_fault(name):
        raise CopyRefusedError(f"may not be called so: {fault[0]}", f"--rename {old!r}=NEW")
    for part in parts:
        file = PurePosixPath(part["file"])
        inside = home.get_backend_name() != "sqlite" or not (
            file.is_absolute() or ".." in file.parts
        )
        plain = part["file"].isprintable() and part["name"].isprintable()
        if not inside or not plain or PART_SUFFIXES.get(part["format"]) != file.suffix:
            raise CopyRefusedError(
                f"names a file of its part that lies elsewhere or is none: {part['file']!r}",
                f"export it from that lab: encode-object export FILE --object {old!r}",
            )


def geometry(source: Connection, object_id: int) -> dict[Table, Rows]:
    """Return an object's rows of the tables of `GEOMETRY`, in the order of their keys."""
    return {table: rows_of(source, table, object_id) for table in GEOMETRY}


def rows_of(source: Connection, table: Table, object_id: int) -> Rows:
    """Return an object's rows of a table as plain values."""
    query = select(table).where(table.c.object_id == object_id)
    return [row._asdict() for row in source.execute(query.order_by(*table.primary_key.columns))]


def same_object(
    source: Connection, entry: ObjectEntry, target: Connection, present: ObjectEntry
) -> bool:
    """Whether two objects are one: spec, array, alphabet, geometry, cells, to the last bit."""
    return (
        entry.spec_hash == present.spec_hash
        and _definitions(source, entry) == _definitions(target, present)
        and all(
            _comparable_rows(mine) == _comparable_rows(theirs)
            for mine, theirs in zip(
                geometry(source, entry.object_id).values(),
                geometry(target, present.object_id).values(),
                strict=True,
            )
        )
    )


def _definitions(connection: Connection, entry: ObjectEntry) -> Sequence[Any]:
    """Return the digests of array and alphabet, and the style."""
    return connection.execute(
        select(
            tables.arrays.c.definition_sha256,
            tables.alphabets.c.definition_sha256,
            *tables.STYLE,
        )
        .select_from(tables.objects)
        .join(tables.arrays)
        .join(tables.alphabets)
        .where(tables.objects.c.object_id == entry.object_id)
    ).one()


def _comparable_rows(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return rows without the numbers that differ between databases; -0.0 is not 0.0."""
    return [
        repr([value for name, value in row.items() if name not in ("object_id", "array_id")])
        for row in rows
    ]


def _keys(array: SymbolArray, rows: Ints, columns: Ints) -> NDArray[np.uint64]:
    return rows.astype(np.uint64) * np.uint64(array.columns) + columns.astype(np.uint64)


def _holders(target: Connection, array_id: int, rows: Ints, columns: Ints) -> str:
    numbers = np.unique(faces_at(target, array_id, rows, columns)[0]).tolist()
    names = target.execute(
        select(tables.objects.c.name)
        .where(tables.objects.c.object_id.in_(numbers[:4]))
        .order_by(tables.objects.c.name)
    ).scalars()
    shown = ", ".join(f"'{name}'" for name in names)
    if len(numbers) > 4:
        return f"{shown} and {len(numbers) - 4} more hold"
    return f"{shown} {'holds' if len(numbers) == 1 else 'hold'}"


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
    origin: Mapping[str, str] | None = None,
    skip_refused: bool = False,
) -> CopyReport:
    """Copy objects with cells, provenance, names of files, and how their prints came out.

    Parameters
    ----------
    source, target
        Of a read and a write transaction.
    names
        Which objects; empty for all.
    renamed
        New names of objects, by their names in `source`.
    origin
        `imported_from` and `imported_utc` of each object; without it, their own are kept.
    skip_refused
        Copy the others where some are refused.

    Raises
    ------
    DatabaseError
        An object is refused (unless `skip_refused`), or no object has a name asked for.
    """
    new_names = dict(renamed or {})
    arrays: dict[int, ArrayHere] = {}
    copied: list[str] = []
    known: list[str] = []
    refused = []
    for name in (*names, *new_names):
        object_entry(source, name)
    for entry in list_objects(source):
        if names and entry.name not in names:
            continue
        name = new_names.get(entry.name, entry.name)
        try:
            here = _copy_object(source, target, entry, name, arrays, origin)
            (known if here else copied).append(here or name)
        except CopyRefusedError as error:
            shown = name if name.isprintable() else repr(name)
            refused.append(RefusedCopy(shown, error.cause, error.fix))
    if refused and not skip_refused:
        raise _refusal(refused, place_of(home_of(target.engine)))
    return CopyReport(tuple(copied), tuple(known), tuple(refused))


@of_rows
def _copy_object(
    source: Connection,
    target: Connection,
    entry: ObjectEntry,
    name: str,
    arrays: dict[int, ArrayHere],
    origin: Mapping[str, str] | None,
) -> str:
    """Copy one object, unless it is here; check all of it before the first row is written.

    Returns the name that it has here already, empty if it had none. Files of parts are named from
    where people have the two databases.
    """
    homes = home_of(source.engine), home_of(target.engine)
    parts = rows_of(source, tables.parts, entry.object_id)
    if origin:
        check_names(name, entry.name, parts, homes[0])
    present = find_object(target, name)
    if present is not None and same_object(source, entry, target, present):
        return name
    if entry.array_id not in arrays:
        arrays[entry.array_id] = array_here(source, target, entry.array_id)
    here = arrays[entry.array_id]
    (row,) = rows_of(source, tables.objects, entry.object_id)
    check_alphabet(source, row["alphabet_id"])
    rows = geometry(source, entry.object_id)
    held = None if here.array_id is None else _held_by(target, here.array_id, rows[tables.cells])
    if held is not None and same_object(source, entry, target, held):
        return held.name
    if present is not None:
        fix = f"import it under a name of its own: --rename '{entry.name}=NEW'"
        raise CopyRefusedError("is the name of another object here", fix)
    check_cells(target, here, rows[tables.cells])
    texts = (x for found in rows.values() for one in found for x in one.values())
    if not all(text.isprintable() for text in texts if isinstance(text, str)):
        raise CopyRefusedError("has names that cannot be shown", _DAMAGED)
    check_readable(source, entry.name)

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
    at = tuple(np.array([cell[key] for cell in cells], np.int64) for key in _PLACE)
    mark_cells(target, array_id, (at[0], at[1]), taken=True)
    for part in parts:
        path = part_path(homes[0], part["file"])
        part["file"] = part_file(homes[1], str(path)) if origin else _sent_along(homes, path)
    insert_rows(target, tables.parts, [part | new for part in parts])
    prints = rows_of(source, tables.as_built, entry.object_id)
    for print_ in prints:
        del print_["as_built_id"]
    insert_rows(target, tables.as_built, [print_ | new for print_ in prints])
    provenance = rows_of(source, tables.provenance, entry.object_id)
    insert_rows(target, tables.provenance, [row | new | dict(origin or {}) for row in provenance])
    return ""


def _held_by(target: Connection, array_id: int, cells: Rows) -> ObjectEntry | None:
    """Return the object that holds the first of some cells in the receiving database."""
    numbers, _ = faces_at(target, array_id, *([cell[k] for cell in cells[:1]] for k in _PLACE))
    query = select(tables.objects.c.name).where(tables.objects.c.object_id.in_(numbers.tolist()))
    return next((find_object(target, name) for name in target.execute(query).scalars()), None)


def _sent_along(homes: tuple[URL, URL], path: Path) -> str:
    """Return how an export names the file of a part, which may be sent along: from its own folder.

    One that lies elsewhere keeps its place below the lab's folder, or its name alone.
    """
    for url in reversed(homes):
        if url.get_backend_name() == "sqlite":
            named = part_file(url, str(path))
            if not named.startswith(".."):
                return named
    return path.name


def _refusal(refused: Sequence[RefusedCopy], place: str) -> DatabaseError:
    causes = "; ".join(f"'{each.name}' {each.cause}" for each in refused)
    fixes = "; ".join(dict.fromkeys(each.fix for each in refused))
    fixes += "; or import the others with --skip-refused"
    return DatabaseError(f"nothing was imported: {causes}", fix=fixes, place=place)
