"""Open the database, make its schema when it is new and bring it up to date when it is old.

Another program's database is left alone, a newer schema is refused.
"""

from __future__ import annotations

import logging
import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sqlalchemy import (
    URL,
    Connection,
    Engine,
    NullPool,
    create_engine,
    event,
    insert,
    inspect,
    make_url,
    select,
    text,
)
from sqlalchemy.exc import ArgumentError
from sqlalchemy.schema import CreateIndex, CreateTable

from encoded_objects.base.errors import install_line
from encoded_objects.base.foreign import regular_size
from generator.array.lab_key import draw_lab_key
from generator.database.migrate import migrate
from generator.database.tables import FORMAT, SCHEMA_VERSION, meta, metadata, objects
from generator.database.transaction import (
    WAIT_S,
    begin_sqlite,
    note_engine,
    of_rows,
    place_of,
    read_transaction,
    write_transaction,
)
from generator.errors import DatabaseError


def normal_url(url: str | Path) -> URL:
    """Return the URL of a file, `sqlite:///file` or `postgresql://...`; checks no more.

    >>> normal_url("postgresql://lab@host/objects").drivername
    'postgresql+psycopg'
    """
    url = str(url) if isinstance(url, Path) else url
    if not isinstance(url, str):
        raise DatabaseError(f"{url!r} is no database", fix="give a file such as lab.db")
    if not url.strip():
        raise DatabaseError("no database is named", fix="give a file such as lab.db")
    if "://" not in url:
        if url.startswith(("sqlite:", "postgresql:", "postgres:")):
            fix = "write sqlite:///lab.db or postgresql://user@host:5432/name"
            raise DatabaseError(f"'{url}' is half an address", fix=fix)
        return URL.create("sqlite", database=str(Path(url).expanduser()))
    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError) as error:
        fix = "write sqlite:///lab.db or postgresql://user@host:5432/name"
        raise DatabaseError(f"'{url}' is not a database URL", fix=fix) from error
    if parsed.drivername in ("sqlite", "sqlite+pysqlite"):
        if parsed.host:
            fix = f"write three strokes: sqlite:///{parsed.host}"
            raise DatabaseError(f"'{url}' names a host and no file", fix=fix)
        if not parsed.database or parsed.database == ":memory:":
            fix = "give a file, such as sqlite:///lab.db"
            raise DatabaseError(f"'{url}' names no file, so nothing would be kept", fix=fix)
        if parsed.query:
            fix = "write sqlite:///lab.db alone; a file with '?' in its name as a plain file name"
            raise DatabaseError(f"'{url}' has settings that are not known", fix=fix)
        return URL.create("sqlite", database=parsed.database)
    if "@" in (parsed.host or ""):
        raise DatabaseError(f"'{url}' has an @ in its password", fix="write it as %40")
    if parsed.drivername in ("postgresql", "postgres", "postgresql+psycopg"):
        return parsed.set(drivername="postgresql+psycopg")
    raise DatabaseError(
        f"cannot keep objects in '{parsed.drivername}'; allowed are sqlite and postgresql",
        fix="write sqlite:///lab.db or postgresql://user@host:5432/name",
    )


def part_file(url: URL, file: str) -> str:
    """Return how a database names a part's file: from its own folder, absolute on a server.

    A folder that holds a SQLite database and its parts can be moved and copied.
    """
    path = Path(file).absolute()
    if url.get_backend_name() != "sqlite":
        return str(path)
    return Path(os.path.relpath(path, Path(url.database or "").absolute().parent)).as_posix()


def part_path(url: URL, file: str) -> Path:
    """Return the path of a part's file from its name in the database; undoes `part_file`."""
    if url.get_backend_name() != "sqlite":
        return Path(file)
    return Path(os.path.normpath(Path(url.database or "").absolute().parent / file))


# A server finds out within a minute that a bench has lost its power or its network, undoes
# what the bench had begun and lets the next writer go on; by default it takes two hours.
_POSTGRESQL = {
    "connect_timeout": 10,
    "client_encoding": "utf8",
    "options": "-c tcp_keepalives_idle=20 -c tcp_keepalives_interval=10 -c tcp_keepalives_count=3",
}


def database_engine(url: URL, writable: bool, wait_s: float) -> Engine:
    """Return an engine on a database of either kind, or raise `DatabaseError`."""
    if url.get_backend_name() != "sqlite":
        return _postgresql_engine(url, writable, wait_s)
    path = Path(url.database or "").absolute()
    check_place(path)
    if writable:
        _check_writable(path)
    elif not path.exists():
        fix = "register an object with encode-object first, or correct the file name"
        raise DatabaseError("this database does not exist", fix=fix, place=str(path))
    return _sqlite_engine(url, path, writable, wait_s)


def check_place(path: Path) -> None:
    """Refuse what SQLite would refuse later, or with fewer words."""
    place = str(path)
    if not path.parent.is_dir():
        fix = f"make it with: mkdir -p {path.parent}"
        raise DatabaseError(f"folder {path.parent} does not exist", fix=fix, place=place)
    if path.is_dir():
        fix = f"name a file in it, such as {path / 'lab.db'}"
        raise DatabaseError("this is a folder, not a database file", fix=fix, place=place)
    try:
        # also a link that leads nowhere: SQLite would make its target
        size = regular_size(path) if os.path.lexists(path) else 0
    except OSError as error:
        cause = f"this is no database: {error.strerror}"
        raise DatabaseError(cause, fix="name a file, such as lab.db", place=place) from error
    if size == 1:  # which SQLite takes for an empty database
        fix = "name another file, or move this one away"
        raise DatabaseError("this file is not a database", fix=fix, place=place)


def _sqlite_engine(url: URL, path: Path, writable: bool, wait_s: float) -> Engine:
    # mode=rw also without `writable`: a reader must undo what a killed writer left behind.
    uri = f"file:{quote(str(path))}?mode={'rwc' if writable else 'rw'}"

    def connect() -> sqlite3.Connection:
        connection = sqlite3.connect(
            uri, uri=True, timeout=wait_s, isolation_level=None, check_same_thread=False
        )
        connection.execute("PRAGMA foreign_keys = ON")
        connection.execute("PRAGMA trusted_schema = OFF")
        if not writable:
            connection.execute("PRAGMA query_only = ON")
        return connection

    wait = {"wait_s": wait_s}
    engine = create_engine(url, creator=connect, poolclass=NullPool, execution_options=wait)
    event.listen(engine, "begin", begin_sqlite)
    event.listen(engine, "handle_error", note_engine)
    return engine


def _check_writable(path: Path) -> None:
    # The journal stands next to the file, so the folder must be writable too.
    for need in (path, path.parent) if path.exists() else (path.parent,):
        if not os.access(need, os.W_OK, effective_ids=os.access in os.supports_effective_ids):
            fix = "allow writing there, or choose another database with --database"
            raise DatabaseError(f"{need} may not be written", fix=fix, place=str(path))


def _postgresql_engine(url: URL, writable: bool, wait_s: float) -> Engine:
    logging.getLogger("psycopg").setLevel(logging.ERROR)  # what failed is ours to say
    try:
        engine = create_engine(
            url,
            poolclass=NullPool,
            connect_args={name: _POSTGRESQL[name] for name in _POSTGRESQL if name not in url.query},
            execution_options={"wait_s": wait_s},
        )
    except ImportError as error:
        fix = install_line("postgres")
        raise DatabaseError("psycopg is not installed", fix=fix, place=place_of(url)) from error
    event.listen(engine, "handle_error", note_engine)
    if not writable:
        event.listen(engine, "connect", _read_only)
    return engine


def _read_only(connection: Any, _record: object) -> None:
    connection.read_only = True


def open_database(
    url: str | Path,
    *,
    writable: bool = True,
    wait_s: float = WAIT_S,
    keep_older: bool = True,
    lab_key: str = "",
) -> Engine:
    """Return an engine on a database with the schema of this tool; an older one is brought to it.

    Parameters
    ----------
    url
        A file (`lab.db`), `sqlite:///lab.db`, or `postgresql://user@host/name`.
    writable
        Make the database when it is new, and refuse one that cannot be written.
        Without it no object is ever made or changed.
    wait_s
        How long to wait for other writers, seconds.
    keep_older
        Copy a SQLite file of an earlier schema version before it is changed, and say so.
    lab_key
        Of a database that is new, as `read_lab_key` returns it; drawn if left out.

    Raises
    ------
    DatabaseError
        A place that does not exist or may not be written, a file that is no database
        or another program's, a newer schema, an older one that may not be written.
    """
    engine = database_engine(normal_url(url), writable, wait_s)
    if _update_schema(engine, wait_s, keep_older):
        return engine
    if not writable:
        fix = "register an object with encode-object first, or name another database"
        if engine.dialect.name == "postgresql":  # which hides tables of a schema without rights
            fix += "; or have its owner grant this user its schema (docs/lab.md, Rights)"
        place = place_of(engine.url)
        raise DatabaseError("no objects are registered here", fix=fix, place=place)
    with write_transaction(engine) as connection:
        if _schema_version(connection) is None:  # nobody else made it meanwhile
            _create_schema(connection, lab_key or draw_lab_key())
    return engine


def open_if_there(url: str, *, writable: bool = True) -> Engine | None:
    """Return an engine as `open_database`, None where there is no database yet; makes none."""
    normal = normal_url(url)
    if not _file_is_there(normal):
        return None
    engine = database_engine(normal, writable, WAIT_S)
    return engine if _update_schema(engine, WAIT_S, keep_older=True) else None


def existing_database(url: str) -> Engine:
    """Return an engine for writing on a database that is there; raises as `open_database`."""
    return open_if_there(url) or open_database(url, writable=False)  # which says what is missing


@contextmanager
def without_unused(url: str) -> Iterator[None]:
    """Remove a SQLite file that was made meanwhile where an error leaves no object in it."""
    normal = normal_url(url)
    there = _file_is_there(normal)
    try:
        yield
    except BaseException:
        path = Path(normal.database or "")
        if not there and path.exists():
            with (
                suppress(DatabaseError, OSError),  # the error at hand is the one to say
                write_transaction(database_engine(normal, writable=True, wait_s=1.0)) as connection,
            ):
                if connection.execute(select(objects)).first() is None:
                    path.unlink()
        raise


def database_exists(url: str) -> bool:
    """Whether there is a database whose objects can be read; raises as `open_database`."""
    normal = normal_url(url)
    if not _file_is_there(normal):
        return False
    with read_transaction(database_engine(normal, writable=False, wait_s=WAIT_S)) as connection:
        return _schema_version(connection) is not None


def _file_is_there(url: URL) -> bool:
    """Whether a SQLite database has its file; a server answers for itself."""
    if url.get_backend_name() != "sqlite":
        return True
    path = Path(url.database or "").absolute()
    check_place(path)
    return path.exists()


def _update_schema(engine: Engine, wait_s: float, keep_older: bool) -> bool:
    """Bring a database to this version of the schema; False where there is none yet."""
    with read_transaction(engine) as connection:
        version = _schema_version(connection)
    if version is not None and version < SCHEMA_VERSION:
        try:
            older = database_engine(engine.url, writable=True, wait_s=wait_s)
            migrate(older, _schema_version, keep=keep_older)
        except DatabaseError as error:
            raise DatabaseError(
                f"the database has schema version {version}, must be brought to {SCHEMA_VERSION}, "
                f"and {error.cause}",
                fix=f"{error.fix}; or have it opened once by who may write it: encode-object list",
                place=place_of(engine.url),
            ) from error
    return version is not None


@of_rows
def _schema_version(connection: Connection) -> int | None:
    """Return the schema's version, None in an empty database; refuse any other content."""
    url = connection.engine.url
    names = set(inspect(connection).get_table_names())
    ours = names & set(metadata.tables)
    # On a server other programs may have tables next to ours; a file belongs to one program.
    if not ours and (not names or url.get_backend_name() != "sqlite"):
        return None
    stored: dict[str, str] = {}
    columns = (
        connection.execute(text("SELECT * FROM meta LIMIT 0")).keys() if "meta" in ours else ()
    )
    if {"key", "value"} <= set(columns):
        stored = {str(key): str(value) for key, value in connection.execute(select(meta))}

    def refusal(cause: str, fix: str) -> DatabaseError:
        return DatabaseError(cause, fix=fix, place=place_of(url))

    if stored.get("format") != FORMAT:
        fix = "name a database of its own for encoded objects, such as lab.db"
        raise refusal("this database belongs to another program", fix)
    if url.get_backend_name() == "sqlite":
        # Statements of a stranger, which would run without end as rows are read or written.
        foreign = text("SELECT type, name FROM sqlite_master WHERE type IN ('view', 'trigger')")
        if (row := connection.execute(foreign).first()) is not None:
            raise refusal(
                f"it holds a {row.type} '{str(row.name)[:40]}', which this tool never makes",
                f"delete it: sqlite3 FILE 'DROP {row.type.upper()} ...'; or take a copy",
            )
    said = stored.get("schema_version", "")
    version = int(said) if said.isascii() and said.isdecimal() else 0
    if version < 1:
        raise refusal(f"'{said}' is no schema version", "restore the database from a copy")
    if version > SCHEMA_VERSION:
        raise refusal(
            f"the database has schema version {version}, newer than {SCHEMA_VERSION}, the newest "
            "that this tool knows",
            "update with: pip install --upgrade encoded-objects",
        )
    return version


def _create_schema(connection: Connection, lab_key: str) -> None:
    for table in metadata.sorted_tables:
        connection.execute(CreateTable(table))
        # `create_all` takes the indexes of a table as they lie in memory: other bytes every time
        for index in sorted(table.indexes, key=lambda one: str(one.name)):
            connection.execute(CreateIndex(index))
    rows = {"format": FORMAT, "schema_version": str(SCHEMA_VERSION), "lab_key": lab_key}
    connection.execute(insert(meta), [{"key": key, "value": rows[key]} for key in rows])
