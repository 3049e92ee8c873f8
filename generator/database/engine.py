"""How a database of either kind is connected to: a SQLite file, or a PostgreSQL server.

A normal URL -> Engine, whose connections keep foreign keys, take turns when they write
(`transaction.py`) and change nothing where they only read. A SQLite database is one file in
rollback-journal mode, not WAL: people copy `lab.db` and keep it on shared drives, and a WAL
database is three files of which a copied one lacks the newest objects.
"""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sqlalchemy import URL, Engine, NullPool, create_engine, event

from encoded_objects.base.errors import install_line
from generator.database.transaction import begin_sqlite, place_of
from generator.errors import DatabaseError

# A server finds out within a minute that a bench has lost its power or its network, undoes
# what the bench had begun and lets the next writer go on; by default it takes two hours.
_POSTGRESQL = {
    "connect_timeout": 10,
    "client_encoding": "utf8",
    "options": "-c tcp_keepalives_idle=20 -c tcp_keepalives_interval=10 -c tcp_keepalives_count=3",
}


def database_engine(url: URL, writable: bool, wait_s: float) -> Engine:
    """Return an engine on a database of either kind.

    Raises
    ------
    DatabaseError
        A place that does not exist or may not be written, or a driver that is missing.
    """
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


def _check_writable(path: Path) -> None:
    # The journal stands beside the file, so the folder must be writable too.
    for need in (path, path.parent) if path.exists() else (path.parent,):
        if not os.access(need, os.W_OK, effective_ids=os.access in os.supports_effective_ids):
            fix = "allow writing there, or choose another database with --database"
            raise DatabaseError(f"{need} may not be written", fix=fix, place=str(path))


def _postgresql_engine(url: URL, writable: bool, wait_s: float) -> Engine:
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
    if not writable:
        event.listen(engine, "connect", _read_only)
    return engine


def _read_only(connection: Any, _record: object) -> None:
    connection.read_only = True
