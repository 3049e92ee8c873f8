"""Bring a database of an earlier schema version to this one: whole, or not at all.

A new version is `migrations/vN.py`; all versions in between are one transaction, so that a killed
migration leaves the database as it was. A SQLite file is copied first (`lab.v1.db` next to
`lab.db`); of a server's database the copies are its administrator's.
"""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable
from contextlib import closing
from importlib import import_module
from itertools import count
from pathlib import Path
from urllib.parse import quote

from sqlalchemy import Connection, Engine, update

from generator.database.tables import SCHEMA_VERSION, meta
from generator.database.transaction import of_rows, place_of, write_transaction
from generator.errors import DatabaseError

_log = logging.getLogger(__name__)  # without settings of its own, warnings go to stderr


def migrate(engine: Engine, version_of: Callable[[Connection], int | None], *, keep: bool) -> None:
    """Bring a writable database to `SCHEMA_VERSION`, and say so; `keep` copies a SQLite file first.

    `version_of` reads the schema's version, again when it is our turn to write.

    Raises
    ------
    DatabaseError
        The database cannot be written, or the copy not be made; it is as it was then.
    """
    copy: Path | None = None
    try:
        with write_transaction(engine) as connection:
            version = version_of(connection)
            if version is None or version >= SCHEMA_VERSION:  # another program was first
                return
            if keep and connection.dialect.name == "sqlite":
                copy = _copy_file(Path(engine.url.database or "").absolute(), version)
            upgrade(connection, version)
    except BaseException:
        if copy is not None:
            copy.unlink(missing_ok=True)
        raise
    if keep:
        _log.warning(
            "%s: brought from schema version %d to %d%s",
            place_of(engine.url),
            version,
            SCHEMA_VERSION,
            f"; as it was: {copy}" if copy else "",
        )


@of_rows
def upgrade(connection: Connection, version: int) -> None:
    """Carry out all migrations after `version`, in the transaction of the connection."""
    for number in range(version + 1, SCHEMA_VERSION + 1):
        import_module(f"generator.database.migrations.v{number}").upgrade(connection)
    connection.execute(
        update(meta).where(meta.c.key == "schema_version").values(value=str(SCHEMA_VERSION))
    )


def _copy_file(path: Path, version: int) -> Path:
    """Copy a database file that we alone may write now; return the copy, a new file."""
    names = (f"{path.stem}.v{version}{f'-{n}' if n > 1 else ''}{path.suffix}" for n in count(1))
    for name in names:
        copy = path.with_name(name)
        try:
            copy.touch(exist_ok=False)
        except FileExistsError:
            continue
        except OSError as error:
            raise _no_copy(path, str(error.strerror)) from error
        break
    try:
        snapshot(path, copy)
    except BaseException as error:
        copy.unlink(missing_ok=True)
        if isinstance(error, sqlite3.Error | OSError):
            raise _no_copy(path, str(error)) from error
        raise
    return copy


def snapshot(path: Path, copy: Path) -> None:
    """Write one state of a SQLite database into another file, whatever others write."""
    source = f"file:{quote(str(path.absolute()))}?mode=ro"
    with closing(sqlite3.connect(source, uri=True)) as old, closing(sqlite3.connect(copy)) as new:
        old.backup(new)


def _no_copy(path: Path, reason: str) -> DatabaseError:
    return DatabaseError(
        f"no copy can be made before the database is brought to a newer schema: {reason}",
        fix=f"free some space and allow writing in {path.parent}",
        place=str(path),
    )
