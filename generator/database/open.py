"""Open the database, make its schema when it is new and bring it up to date when it is old.

A URL or a file name -> Engine. Another program's database is left alone, a newer schema is
refused, an older one is brought to today's.
"""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import URL, Connection, Engine, insert, inspect, select, text
from sqlalchemy.schema import CreateIndex, CreateTable

from generator.array.lab_key import draw_lab_key
from generator.database.engine import check_place, database_engine
from generator.database.migrate import migrate
from generator.database.tables import FORMAT, SCHEMA_VERSION, meta, metadata
from generator.database.transaction import WAIT_S, place_of, read_transaction, write_transaction
from generator.database.url import normal_url
from generator.errors import DatabaseError


def open_database(
    url: str,
    *,
    writable: bool = True,
    wait_s: float = WAIT_S,
    keep_older: bool = True,
    lab_key: str = "",
) -> Engine:
    """Return an engine on a database with the schema of this tool.

    A database of an earlier version is brought to this one (`migrate.py`), also for a reader.

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


def database_exists(url: str) -> bool:
    """Whether there is a database whose objects can be read; makes and changes nothing.

    Raises
    ------
    DatabaseError
        As `open_database`: what is there is no database, or its folder does not exist.
    """
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
        older = _for_migration(engine.url, version, wait_s)
        migrate(older, _schema_version, keep=keep_older)
    return version is not None


def _for_migration(url: URL, version: int, wait_s: float) -> Engine:
    try:
        return database_engine(url, writable=True, wait_s=wait_s)
    except DatabaseError as error:
        raise DatabaseError(
            f"the database has schema version {version}, must be brought to {SCHEMA_VERSION}, "
            f"and {error.cause}",
            fix="open it once where it may be written: encode-object list --database FILE",
            place=place_of(url),
        ) from error


def _schema_version(connection: Connection) -> int | None:
    """Return the schema's version, None in an empty database; refuse any other content."""
    url = connection.engine.url
    names = set(inspect(connection).get_table_names())
    ours = names & set(metadata.tables)
    # On a server other programs may have tables beside ours; a file belongs to one program.
    if not ours and (not names or url.get_backend_name() != "sqlite"):
        return None
    stored: dict[str, str] = {}
    if "meta" in ours and {"key", "value"} <= _columns_of_meta(connection):
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


def _columns_of_meta(connection: Connection) -> set[str]:
    return set(connection.execute(text("SELECT * FROM meta LIMIT 0")).keys())


def _create_schema(connection: Connection, lab_key: str) -> None:
    for table in metadata.sorted_tables:
        connection.execute(CreateTable(table))
        # `create_all` takes the indexes of a table as they lie in memory: other bytes every time
        for index in sorted(table.indexes, key=lambda one: str(one.name)):
            connection.execute(CreateIndex(index))
    rows = {"format": FORMAT, "schema_version": str(SCHEMA_VERSION), "lab_key": lab_key}
    connection.execute(insert(meta), [{"key": key, "value": rows[key]} for key in rows])
