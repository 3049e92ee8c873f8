"""How people name a database: a file, `sqlite:///file`, or `postgresql://user@host/name`."""

from __future__ import annotations

import os
from pathlib import Path

from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

from generator.errors import DatabaseError


def normal_url(url: str) -> URL:
    """Return the URL of a file name, `sqlite:///file` or `postgresql://...`; checks no more.

    Examples
    --------
    >>> normal_url("postgresql://lab@host/objects").drivername
    'postgresql+psycopg'
    """
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
    if parsed.drivername in ("postgresql", "postgres", "postgresql+psycopg"):
        return parsed.set(drivername="postgresql+psycopg")
    raise DatabaseError(
        f"cannot keep objects in '{parsed.drivername}'; allowed are sqlite and postgresql",
        fix="write sqlite:///lab.db or postgresql://user@host:5432/name",
    )


def without_password(url: str) -> str:
    """Return a database's address as it may be shown.

    Examples
    --------
    >>> without_password("postgresql://lab:secret@host/objects")
    'postgresql://lab:***@host/objects'
    >>> without_password("sqlite:///lab.db")
    'sqlite:///lab.db'
    """
    return make_url(url).render_as_string(hide_password=True)


def part_file(url: URL, file: str) -> str:
    """Return how a database names a part's file: from its own folder, absolute on a server.

    A folder that holds a SQLite database and its parts can so be moved and copied.
    """
    path = Path(file).absolute()
    if url.get_backend_name() != "sqlite":
        return str(path)
    return Path(os.path.relpath(path, Path(url.database or "").absolute().parent)).as_posix()


def part_path(url: URL, file: str) -> Path:
    """Return where a part's file is, from how the database names it: `part_file` undone."""
    if url.get_backend_name() != "sqlite":
        return Path(file)
    return Path(os.path.normpath(Path(url.database or "").absolute().parent / file))
