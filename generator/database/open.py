"""Open the database, and make its schema when it is new.

A URL or a file name -> Engine. A SQLite database is one file in rollback-journal mode,
not WAL: people copy `lab.db` and keep it on shared drives, and a WAL database is three
files of which a copied one lacks the newest objects.
"""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path
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
    select,
)

from generator.database.tables import FORMAT, SCHEMA_VERSION, meta, metadata
from generator.database.transaction import (
    WAIT_S,
    begin_sqlite,
    place_of,
    reading,
    writing,
)
from generator.database.url import normal_url
from generator.errors import DatabaseError


def open_database(url: str, *, writable: bool = True, wait_s: float = WAIT_S) -> Engine:
    """Return an engine on a database whose schema this tool knows.

    Parameters
    ----------
    url
        A file (`lab.db`), `sqlite:///lab.db`, or `postgresql://user@host/name`.
    writable
        Make the database when it is new, and refuse one that cannot be written.
        Without it nothing is ever made or changed.
    wait_s
        How long to wait for other writers, seconds.

    Raises
    ------
    DatabaseError
        A place that does not exist or may not be written, a file that is no database
        or another program's, a newer schema.
    """
    normal = normal_url(url)
    engine = _engine(normal, writable, wait_s)
    with reading(engine) as connection:
        version = _schema_version(connection)
    if version is None:
        if not writable:
            fix = "register an object with encode-object first, or name another database"
            raise DatabaseError("no objects are registered here", fix=fix, place=place_of(normal))
        with writing(engine) as connection:
            if _schema_version(connection) is None:  # nobody else made it meanwhile
                _create_schema(connection)
    return engine


def database_exists(url: str) -> bool:
    """Whether there is a database whose objects can be read; makes and changes nothing.

    Raises
    ------
    DatabaseError
        As `open_database`: what is there is no database, or its folder does not exist.
    """
    normal = normal_url(url)
    if normal.get_backend_name() == "sqlite":
        path = Path(normal.database or "").absolute()
        _check_place(path)
        if not path.exists():
            return False
    with reading(_engine(normal, writable=False, wait_s=WAIT_S)) as connection:
        return _schema_version(connection) is not None


def _engine(url: URL, writable: bool, wait_s: float) -> Engine:
    if url.get_backend_name() != "sqlite":
        return _postgresql_engine(url, wait_s)
    path = Path(url.database or "").absolute()
    _check_place(path)
    if writable:
        _check_writable(path)
    elif not path.exists():
        fix = "register an object with encode-object first, or correct the file name"
        raise DatabaseError("this database does not exist", fix=fix, place=str(path))
    return _sqlite_engine(url, path, writable, wait_s)


def _sqlite_engine(url: URL, path: Path, writable: bool, wait_s: float) -> Engine:
    # mode=rw also without `writable`: a reader must undo what a killed writer left behind.
    uri = f"file:{quote(str(path))}?mode={'rwc' if writable else 'rw'}"

    def connect() -> sqlite3.Connection:
        connection = sqlite3.connect(
            uri, uri=True, timeout=wait_s, isolation_level=None, check_same_thread=False
        )
        connection.execute("PRAGMA foreign_keys = ON")
        if not writable:
            connection.execute("PRAGMA query_only = ON")
        return connection

    engine = create_engine(url, creator=connect, poolclass=NullPool)
    event.listen(engine, "begin", begin_sqlite)
    return engine


def _check_place(path: Path) -> None:
    """Refuse what SQLite would refuse later, or with fewer words."""
    place = str(path)
    if not path.parent.is_dir():
        fix = f"make it with: mkdir -p {path.parent}"
        raise DatabaseError(f"folder {path.parent} does not exist", fix=fix, place=place)
    if path.is_dir():
        fix = f"name a file in it, such as {path / 'lab.db'}"
        raise DatabaseError("this is a folder, not a database file", fix=fix, place=place)


def _check_writable(path: Path) -> None:
    # The journal stands beside the file, so the folder must be writable too.
    for need in (path, path.parent) if path.exists() else (path.parent,):
        if not os.access(need, os.W_OK, effective_ids=os.access in os.supports_effective_ids):
            fix = "allow writing there, or choose another database with --database"
            raise DatabaseError(f"{need} may not be written", fix=fix, place=str(path))


def _postgresql_engine(url: URL, wait_s: float) -> Engine:
    try:
        return create_engine(
            url,
            poolclass=NullPool,
            connect_args={"connect_timeout": 10, "client_encoding": "utf8"},
            execution_options={"wait_s": wait_s},
        )
    except ImportError as error:
        fix = "install it with: pip install 'encoded-objects[postgres]'"
        raise DatabaseError("psycopg is not installed", fix=fix, place=place_of(url)) from error


def _schema_version(connection: Connection) -> int | None:
    """Return the schema's version, None in an empty database; refuse any other content."""
    url = connection.engine.url
    inspector = inspect(connection)
    names = set(inspector.get_table_names())
    ours = names & set(metadata.tables)
    # On a server other programs may have tables beside ours; a file belongs to one program.
    if not ours and (not names or url.get_backend_name() != "sqlite"):
        return None
    stored: dict[str, str] = {}
    if "meta" in ours and {"key", "value"} <= {c["name"] for c in inspector.get_columns("meta")}:
        stored = {str(key): str(value) for key, value in connection.execute(select(meta))}
    if stored.get("format") != FORMAT:
        raise DatabaseError(
            "this database belongs to another program",
            fix="name a database of its own for encoded objects, such as lab.db",
            place=place_of(url),
        )
    said = stored.get("schema_version", "")
    version = int(said) if said.isascii() and said.isdecimal() else 0
    if version < 1:
        raise DatabaseError(
            f"'{said}' is no schema version",
            fix="restore the database from a copy",
            place=place_of(url),
        )
    if version > SCHEMA_VERSION:
        raise DatabaseError(
            f"the database has schema version {version}, newer than {SCHEMA_VERSION}, the newest "
            "that this tool knows",
            fix="update with: pip install --upgrade encoded-objects",
            place=place_of(url),
        )
    return version


def _create_schema(connection: Connection) -> None:
    metadata.create_all(connection, checkfirst=False)
    rows = {"format": FORMAT, "schema_version": str(SCHEMA_VERSION)}
    connection.execute(insert(meta), [{"key": key, "value": rows[key]} for key in rows])
