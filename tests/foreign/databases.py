"""Databases and what is imported from them."""

import json
import sqlite3
from contextlib import closing, suppress
from functools import cache

from foreign.case import FIXTURES, FaultError, Kind, kept
from foreign.damage import NUMBERS, anything, damaged


@cache
def labs():
    """Return databases: a lab of a cube and a tag, and those of earlier versions."""
    from encoded_objects import encode

    folder = kept()[0] / "lab"
    folder.mkdir(exist_ok=True)
    for name, shape in (("Cube", "cube: 60 mm"), ("Box", "box: 40 x 30 x 20 mm")):
        spec = f"name: {name}\nshape: {{{shape}}}\n"
        encode(spec, database=str(folder / "lab.db"), folder=folder, formats=("stl",))
    made = {"lab": (folder / "lab.db").read_bytes()}
    for version in ("v1", "v2"):
        made[version] = (FIXTURES / "database" / f"{version}.db").read_bytes()
    return made


def _sql(rng, path):
    """Change a database as no writer of ours would."""
    with closing(sqlite3.connect(path)) as base:
        base.execute("PRAGMA foreign_keys = OFF")
        named = "select name from sqlite_master where type = 'table' order by 1"
        tables = [row[0] for row in base.execute(named) if not row[0].startswith("sqlite")]
        for _ in range(rng.choice((1, 1, 2, 3))):
            table = rng.choice(tables)
            columns = [row[1] for row in base.execute(f"pragma table_info({table})")]
            if not columns:
                continue
            column, value = rng.choice(columns), rng.choice((anything(rng, 2), *NUMBERS, "x"))
            if isinstance(value, int) and not -(2**63) <= value < 2**63:
                value = 2**63 - 1
            if isinstance(value, str):
                value = value.encode("utf-8", "replace").decode()
            value = rng.choice((value, value, b"\xff\0", json.dumps(anything(rng)), "0" * 70_000))
            where = rng.choice(("", f" where rowid % {rng.choice((2, 3, 7))} = 0", " limit 1"))
            with suppress(sqlite3.Error):
                do = rng.randrange(12)
                if do < 6:
                    if where == " limit 1":
                        where = f" where {column} = (select {column} from {table} limit 1)"
                    base.execute(f"update {table} set {column} = ?{where}", (value,))
                elif do == 6:
                    base.execute(f"delete from {table}" + where.replace(" limit 1", ""))
                elif do == 7:
                    base.execute(f"drop table {table}")
                elif do == 8:
                    base.execute(f"alter table {table} rename column {column} to other")
                else:
                    base.execute(rng.choice((
                        f"alter table {table} rename to gone",
                        "create view extra as select * from extra",
                        f"create trigger t after insert on {table} begin select 1; end",
                        "update sqlite_master set sql = 'x'", "pragma user_version = 999",
                        "update meta set value = '99' where key = 'schema_version'",
                        "update meta set value = '0' where key = 'schema_version'",
                        "update meta set value = '../x' where key = 'lab_key'",
                        "create table sqlite (a)",
                        *(f"update objects set name = '{name}'" for name in ("../x", "a/b", "..")),
                        *(f"update parts set file = '{file}'" for file in (
                            "../../secret.txt", "/etc/passwd", "lab.db", "../../../x.stl")),
                    )))  # fmt: skip
        if rng.random() < 0.1:
            base.execute("pragma writable_schema = on")
            base.execute("update sqlite_master set sql = replace(sql, ?, ?)", rng.choice((
                ("INTEGER", "BLOB"), ("NOT NULL", ""), ("CREATE TABLE", "CREATE VIEW"), ("(", "((")
            )))  # fmt: skip
        base.commit()


def write_database(rng, folder):
    path = folder / "lab.db"
    content = labs()[rng.choice(("lab", "lab", "lab", "v1", "v2"))]
    if rng.random() < 0.5:
        path.write_bytes(damaged(rng, content))
    else:
        path.write_bytes(content)
        with suppress(sqlite3.Error):
            _sql(rng, path)
    if rng.random() < 0.1:
        (folder / f"lab.db-{rng.choice(('wal', 'journal', 'shm'))}").write_bytes(rng.randbytes(999))
    return path


def read_database(path, _out):
    from generator.command.object_report import fullness_text
    from generator.database.lab import read_fullness
    from generator.database.open import open_database
    from generator.database.read import list_objects, read_object, read_parts
    from generator.database.transaction import read_transaction
    from recognizer.touch.lab import open_lab

    with read_transaction(open_database(str(path), writable=False)) as connection:
        for entry in list_objects(connection):
            read_object(connection, entry.name)
            read_parts(connection, entry.object_id)
        fullness_text(read_fullness(connection))
    for array in open_lab(str(path)).arrays:
        for number in range(len(array.faces)):
            array.face(number)


def read_exchange(path, out):
    """Import a database into a new one; its names and parts must be as a spec's are."""
    from generator.database.exchange import import_objects
    from generator.database.open import open_database, part_path
    from generator.database.read import list_objects, read_object, read_parts
    from generator.database.transaction import read_transaction
    from generator.errors import DatabaseError
    from generator.spec.settings import object_name

    home = out / "home.db"
    import_objects(str(home), str(path))
    engine = open_database(str(home), writable=False)
    with read_transaction(engine) as connection:
        for entry in list_objects(connection):
            try:
                object_name(entry.name)
            except ValueError as bad:
                raise FaultError("wrong value", f"an object called {entry.name[:40]!r}") from bad
            try:
                read_object(connection, entry.name)
                read_parts(connection, entry.object_id)
            except (ValueError, TypeError, LookupError, DatabaseError) as bad:
                raise FaultError(
                    "wrong value", f"what was imported cannot be read: {bad!r:.60}"
                ) from bad
            for part in read_parts(connection, entry.object_id):
                if not part_path(engine.url, part.file).is_relative_to(path.parent):
                    raise FaultError("leak", "a part outside the folder of the file")


KINDS = {
    "database": Kind(write_database, read_database, (4, 2), sound=(labs,)),
    "import": Kind(write_database, read_exchange, (4,), sound=(labs,)),
}
