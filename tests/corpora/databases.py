"""Databases of every schema version, and what today's code makes of them and writes itself.

A file of version 1, 2, 3 -> all rows after it was opened and brought to today's schema, what
`encode-object list | show | lab --json` says, the copy that is kept, the refusal of a newer one;
and all rows of objects that are registered, retired, freed, exported and imported anew. On
PostgreSQL the same: dumps of versions 1 and 2, and fresh objects.

Entries hold a table each: columns, rows in the order of their values, times and versions of the
tool replaced by words. Of more than 24 rows the number, a hash and the first three are kept.
"""

import gzip
import hashlib
import json
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import postgres
from corpora.commands import DATA, FIXTURES, LAB_KEY, Commands, normal_text, started_commands

NAME = "databases"
PARTS = ("sqlite", "postgresql")
SHOWN = 24  #: rows of a table that stand in the corpus as they are

MADE = """
name: Bench
output: {formats: [stl]}
objects:
  - {name: Cube, shape: {cube: 42 mm}}
  - {name: Rod, shape: {cylinder: {diameter: 40 mm, height: 40 mm}}}
  - {name: Slab, shape: {box: [40 mm, 30 mm, 14 mm]}, copies: 2}
"""
THESIS = """
name: Prism
profile: thesis
shape: {triangular_prism: {side: 60 mm, height: 60 mm}}
output: {formats: [stl]}
"""

Rows = tuple[list[str], list[tuple[Any, ...]]]


def collect(part: str) -> Iterator[tuple[str, Any]]:
    """Yield the entries of a part."""
    with started_commands() as commands:
        made = _sqlite if part == "sqlite" else _postgresql
        for entry, value in made(commands, commands.folder):
            yield f"{part}/{entry}", value


def _sqlite(commands: Commands, work: Path) -> Iterator[tuple[str, Any]]:
    for version in (1, 2, 3):
        name = f"v{version}.db"
        (work / name).write_bytes(_file_of(version))
        yield from _objects(commands, f"v{version}", name)
        yield from _tables(f"v{version}/dump", *_sqlite_rows(work / name), work)
        kept = sorted(path.name for path in work.glob(f"v{version}.v*"))
        same = [(work / one).read_bytes() == _file_of(version) for one in kept]
        yield f"v{version}/copies", {"names": kept, "as it was": same}
    for cause, sql in _FOREIGN.items():
        name = f"{cause}.db"
        (work / name).write_bytes(_file_of(3))
        with closing(sqlite3.connect(work / name)) as connection, connection:
            connection.execute(sql)
        before = (work / name).read_bytes()
        yield f"refused/{cause}", _said(commands, "list", "--database", name)
        yield f"refused/{cause}/untouched", (work / name).read_bytes() == before
    yield from _fresh(commands, "fresh", "lab.db", "other.db")
    yield from _tables("fresh/dump", *_sqlite_rows(work / "lab.db"), work)
    yield from _tables("fresh/exported", *_sqlite_rows(work / "out.db"), work)
    yield from _tables("fresh/imported", *_sqlite_rows(work / "other.db"), work)
    with closing(sqlite3.connect(work / "lab.db")) as connection:
        schema = connection.execute("SELECT type, name, sql FROM sqlite_master ORDER BY 1, 2")
        for kind, name, sql in schema.fetchall():
            yield f"schema/{kind}/{name}", sql


_FOREIGN = {
    "newer": "UPDATE meta SET value = '4' WHERE key = 'schema_version'",
    "no-version": "DELETE FROM meta WHERE key = 'schema_version'",
    "wordy-version": "UPDATE meta SET value = 'three' WHERE key = 'schema_version'",
    "other-format": "UPDATE meta SET value = 'recipes' WHERE key = 'format'",
    "no-table": "DROP TABLE occupancy",
}


def _postgresql(commands: Commands, work: Path) -> Iterator[tuple[str, Any]]:
    import psycopg

    with postgres.running() as address:

        def rows(schema: str) -> tuple[list[str], Callable[[str], Rows]]:
            return _postgresql_rows(address, schema)

        place = address.partition("@")[2].partition("/")[0]
        for version in (1, 2):
            url = postgres.new_schema(address, f"v{version}")
            with psycopg.connect(url, autocommit=True) as connection:
                connection.execute((FIXTURES / f"database/v{version}.sql").read_bytes())
            for entry, value in _objects(commands, f"v{version}", url):
                yield entry, _placeless(value, place)
            yield from _tables(f"v{version}/dump", *rows(f"v{version}"), work)
        lab, other = (postgres.new_schema(address, name) for name in ("lab", "other"))
        for entry, value in _fresh(commands, "fresh", lab, other):
            yield entry, _placeless(value, place)
        yield from _tables("fresh/dump", *rows("lab"), work)
        yield from _tables("fresh/imported", *rows("other"), work)


def _file_of(version: int) -> bytes:
    if version < 3:
        return (FIXTURES / f"database/v{version}.db").read_bytes()
    return gzip.decompress((DATA / f"databases/v{version}.db.gz").read_bytes())


def _objects(commands: Commands, entry: str, url: str) -> Iterator[tuple[str, Any]]:
    """Yield what the commands say of a database; the first one migrates it."""
    database = ("--database", url)
    yield f"{entry}/list first", _said(commands, "list", *database)
    listed = _said(commands, "list", *database)
    yield f"{entry}/list", listed
    yield f"{entry}/lab", _said(commands, "lab", *database)
    for one in listed["stdout"]["objects"]:
        yield f"{entry}/show {one['name']}", _said(commands, "show", one["name"], *database)


def _fresh(commands: Commands, entry: str, url: str, other: str) -> Iterator[tuple[str, Any]]:
    """Yield what commands say that register objects and carry them to another database."""
    (commands.folder / "made.yaml").write_text(MADE)
    (commands.folder / "prism.yaml").write_text(THESIS)
    here, key = ("--database", url), ("--lab-key", LAB_KEY)
    steps = (
        ("made.yaml", *here, *key, "-o", "parts"),
        ("prism.yaml", *here, "-o", "parts"),
        ("made.yaml", *here, "-o", "parts"),
        ("retire", "Slab-2", *here),
        ("retire", "Slab-1", "--free", "--yes", *here),
        ("export", "out.db", *here, "--force"),
        ("import", "out.db", "--database", other, "--rename", "Rod=Stick"),
    )
    for number, words in enumerate(steps):
        yield f"{entry}/{number} {words[0]}", _said(commands, *words)
    for database, named in ((url, "lab"), (other, "other")):
        yield f"{entry}/list {named}", _said(commands, "list", "--database", database)


def _said(commands: Commands, *words: str) -> dict[str, Any]:
    return commands.entry("encode-object", *words, "--json")


def _placeless(value: Any, place: str) -> Any:
    """Return a value without the port of the server, which is any free one."""
    return json.loads(json.dumps(value).replace(place, "SERVER"))


def _sqlite_rows(path: Path) -> tuple[list[str], Callable[[str], Rows]]:
    connection = sqlite3.connect(path)
    listed = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
    names = sorted(name for (name,) in listed)

    def rows(table: str) -> Rows:
        cursor = connection.execute(f'SELECT * FROM "{table}"')
        return [column[0] for column in cursor.description], cursor.fetchall()

    return names, rows


def _postgresql_rows(address: str, schema: str) -> tuple[list[str], Callable[[str], Rows]]:
    import psycopg

    connection = psycopg.connect(address, autocommit=True)
    listed = connection.execute("SELECT tablename FROM pg_tables WHERE schemaname = %s", [schema])
    names = sorted(name for (name,) in listed.fetchall())

    def rows(table: str) -> Rows:
        cursor = connection.execute(f'SELECT * FROM {schema}."{table}"'.encode())
        assert cursor.description is not None
        return [column.name for column in cursor.description], cursor.fetchall()

    return names, rows


def _tables(
    entry: str, names: list[str], rows: Callable[[str], Rows], work: Path
) -> Iterator[tuple[str, Any]]:
    """Yield an entry for each table, in the normal form."""
    for table in names:
        columns, found = rows(table)
        order = sorted(range(len(columns)), key=lambda k: columns[k])
        lines = sorted(
            json.dumps([_cell(columns[k], row[k], work) for k in order], allow_nan=False)
            for row in found
        )
        value: dict[str, Any] = {"columns": [columns[k] for k in order], "number": len(lines)}
        if len(lines) > SHOWN:
            value["sha256"] = hashlib.sha256("\n".join(lines).encode()).hexdigest()
            lines = lines[:3]
        yield f"{entry}/{table}", value | {"rows": [json.loads(line) for line in lines]}


def _cell(column: str, value: Any, work: Path) -> Any:
    if isinstance(value, bytes | memoryview):
        return "sha256 " + hashlib.sha256(bytes(value)).hexdigest()
    if column == "tool_version":
        return "VERSION"
    return normal_text(value, work) if isinstance(value, str) else value
