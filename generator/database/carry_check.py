"""Whether an object of one database may stand in another one: the same, new, or refused.

Object + receiving database -> nothing, or `CopyRefusedError` with cause and way out. What the
cells say is checked against the array itself, so that a damaged or hand-made database brings
nothing in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Table, select

from generator.array import array_from
from generator.array.contract import SymbolArray
from generator.database import tables
from generator.database.canonical import digest
from generator.database.cells import array_key, faces_at, find_array, occupied_cells
from generator.database.read import read_array
from generator.database.registered import ObjectEntry
from generator.errors import GeneratorError

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
        array = array_from(read_array(source, array_id).definition)
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


def check_cells(target: Connection, name: str, here: ArrayHere, cells: Rows) -> None:
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
            f"make '{name}' again here from its spec, on cells of its own, and print it again; or "
            "import the others with --skip-refused. Labs with a key each (encode-object lab) have "
            "arrays of their own; without one, or with the same, share one database instead, "
            "postgresql://HOST/NAME",
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
    objects = tables.objects.c
    return connection.execute(
        select(
            tables.arrays.c.definition_sha256,
            tables.alphabets.c.definition_sha256,
            objects.pitch_mm,
            objects.height_mm,
            objects.stroke_mm,
            objects.draft_rad,
            objects.chamfer_mm,
        )
        .select_from(tables.objects)
        .join(tables.arrays)
        .join(tables.alphabets)
        .where(objects.object_id == entry.object_id)
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
