"""Transactions that are whole or not at all, and what a failed one means to a person.

Writers take turns from their first statement (SQLite: BEGIN IMMEDIATE, PostgreSQL: one
advisory lock for the transaction), so that the occupied cells a writer reads stay what
they are until it commits. Nobody waits for a lock longer than the engine's `wait_s`, nor for a turn
longer than `QUIET_S` without a word. What is left to conflict: a layout made before the turn came,
a writer that takes no turns, a deadlock on the server. The work is then undone and repeated on the
state that the other writer left (`retry_on_conflict`).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from threading import Timer
from typing import Concatenate, NoReturn, ParamSpec, TypeVar

import numpy as np
from sqlalchemy import URL, Connection, Engine, ExceptionContext, text
from sqlalchemy.exc import DBAPIError, OperationalError, SQLAlchemyError

from encoded_objects.base.errors import without_password
from encoded_objects.base.foreign import DAMAGE
from encoded_objects.base.output import message
from generator.errors import DatabaseError, GeneratorError

WAIT_S = 60.0  #: how long a writer waits for its turn, and a reader for a commit to end
QUIET_S = 2.0  #: from then on it says for what
BUSY_MS = 200  #: that SQLite waits by itself, deaf to Ctrl-C

_TURN = int.from_bytes(b"encoded", "big")  #: the advisory lock of writers on PostgreSQL


class WriteConflictError(DatabaseError):
    """Another writer was first; `retry_on_conflict` repeats the work on the state it left."""


@contextmanager
def write_transaction(engine: Engine) -> Iterator[Connection]:
    """Open a transaction that alone may write; commits at the end, undone on any error.

    Raises
    ------
    DatabaseError
        Other writers keep the database for too long, the place is read-only or full, or the
        database refuses a row (a cell that another object holds).
    """
    with explain_failures(engine), engine.connect() as connection:
        connection.execution_options(writing=True)
        with connection.begin():
            take_turn(connection)
            yield connection


@contextmanager
def read_transaction(engine: Engine) -> Iterator[Connection]:
    """Open a transaction that sees one state of the database, whatever others write."""
    with explain_failures(engine), engine.connect() as connection:
        if connection.dialect.name == "postgresql":
            connection.execution_options(
                isolation_level="REPEATABLE READ", postgresql_readonly=True
            )
        with connection.begin():
            _limit_wait(connection)
            yield connection


@contextmanager
def explain_failures(engine: Engine) -> Iterator[None]:
    """Raise what an engine's driver reports as a DatabaseError; what others report passes.

    SQLite's messages name tables, which in a damaged file are no text: these are reported too.
    """
    try:
        yield
    except (SQLAlchemyError, UnicodeDecodeError) as error:
        _explain(error, engine)


def note_engine(context: ExceptionContext) -> None:
    """Let an error of the driver remember its engine; a listener of `handle_error`."""
    if context.sqlalchemy_exception is not None:
        context.sqlalchemy_exception.engine = context.engine  # type: ignore[attr-defined]


Given = ParamSpec("Given")
Result = TypeVar("Result")


def of_rows(
    read: Callable[Concatenate[Connection, Given], Result],
) -> Callable[Concatenate[Connection, Given], Result]:
    """Decorate what makes values of rows; rows that were never written raise a DatabaseError."""

    @wraps(read)
    def reader(connection: Connection, /, *given: Given.args, **named: Given.kwargs) -> Result:
        with explain_values(connection.engine):
            return read(connection, *given, **named)

    return reader


@contextmanager
def explain_values(engine: Engine) -> Iterator[None]:
    """Raise what damaged values of a database lead to as a DatabaseError."""
    try:
        yield
    except DatabaseError:
        raise
    except (*DAMAGE, SQLAlchemyError, GeneratorError) as error:
        _explain(error, engine)


def _explain(error: Exception, engine: Engine) -> NoReturn:
    if getattr(error, "engine", engine) is not engine:  # of another database that takes part
        raise error
    raise explain_error(error, home_of(engine)) from error


def home_of(engine: Engine) -> URL:
    """Return where people have a database; a copy in its place has the execution option `home`."""
    home: URL = engine.get_execution_options().get("home", engine.url)
    return home


def take_turn(connection: Connection) -> None:
    """Wait until no other transaction writes; held until this one ends."""
    if connection.dialect.name == "postgresql":
        wait_s = _limit_wait(connection)
        notice = Timer(QUIET_S, _say_waiting, (connection.engine.url, wait_s))
        notice.daemon = True
        notice.start()
        try:
            connection.execute(text("SELECT pg_advisory_xact_lock(:turn)"), {"turn": _TURN})
        finally:
            notice.cancel()


def _limit_wait(connection: Connection) -> float:
    """Let a server's locks be waited for as long as the engine says; returns how long."""
    wait_s = float(connection.get_execution_options().get("wait_s", WAIT_S))
    if connection.dialect.name == "postgresql":
        connection.execute(text(f"SET LOCAL lock_timeout = {int(1000 * wait_s)}"))
    return wait_s


def begin_sqlite(connection: Connection) -> None:
    """Begin a SQLite transaction, as soon as no other program keeps the file locked."""
    options = connection.get_execution_options()
    wait_s, first = options["wait_s"], "BEGIN IMMEDIATE"
    if not options.get("writing"):
        connection.exec_driver_sql("BEGIN")
        first = "SELECT 1 FROM sqlite_master"  # which takes a reader's lock
    connection.exec_driver_sql(f"PRAGMA busy_timeout = {min(BUSY_MS, int(1000 * wait_s))}")
    began, said = time.monotonic(), False
    while True:
        try:
            connection.exec_driver_sql(first)
            break
        except OperationalError as error:
            waited = time.monotonic() - began
            busy = getattr(error.orig, "sqlite_errorname", "") == "SQLITE_BUSY"
            if not busy or waited >= wait_s:
                raise
            if waited >= QUIET_S and not said:
                _say_waiting(connection.engine.url, wait_s)
                said = True
    connection.exec_driver_sql(f"PRAGMA busy_timeout = {int(1000 * wait_s)}")


def _say_waiting(url: URL, wait_s: float) -> None:
    message(
        f"{place_of(url)}: another program keeps the database locked; waiting up to {wait_s:.0f} s "
        "(Ctrl-C ends it)"
    )


def place_of(url: URL) -> str:
    """Return how messages name a database: a SQLite file by its path, others without password."""
    if url.get_backend_name() == "sqlite":
        return url.database or "sqlite"
    return without_password(url.set(drivername=url.get_backend_name()).render_as_string())


def explain_error(error: Exception, url: URL) -> DatabaseError:
    """Return the cause and the way out of what the database driver reports, or a row says."""
    place = place_of(url)
    restore = _RESTORE if url.get_backend_name() == "sqlite" else _RESTORE_SERVER
    if not isinstance(error, DBAPIError):
        reason = str(error).partition("\n")[0][:100]
        cause = f"the database is damaged, it holds what was never written: {reason}"
        return DatabaseError(cause, fix=restore, place=place)
    # SQLite names its errors (SQLITE_BUSY), PostgreSQL numbers them (SQLSTATE 55P03).
    code = getattr(error.orig, "sqlite_errorname", None) or getattr(error.orig, "sqlstate", None)
    if code is None and error.connection_invalidated:
        code = _GONE
    said = str(error.orig).strip().splitlines()
    first_line = said[0] if said else type(error.orig).__name__
    for codes, cause, fix in _MEANINGS:
        if code is not None and code.startswith(codes):
            return DatabaseError(cause.format(first_line), fix=fix, place=place)
    if code in _RACES:
        fix = "run the same command again"
        return WriteConflictError("another writer was first", fix=fix, place=place)
    if code is not None and code.startswith(("SQLITE_CONSTRAINT", "23")):
        for table, cause, fix in _CONFLICTS:
            if code in _NOT_UNIQUE and table in first_line:
                return WriteConflictError(cause, fix=fix, place=place)
        cause = f"the database refuses the object: {first_line}"
        return DatabaseError(cause, fix=restore, place=place)
    if code is None and url.get_backend_name() == "sqlite":
        return DatabaseError(f"the database is damaged: {first_line}", fix=_RESTORE, place=place)
    if code is None:
        return connection_error(str(error.orig), url, place)
    return DatabaseError(f"the database failed: {first_line} ({code})", fix=restore, place=place)


_RACES = ("40001", "40P01")  # serialization failure, deadlock
_NOT_UNIQUE = ("SQLITE_CONSTRAINT_PRIMARYKEY", "SQLITE_CONSTRAINT_UNIQUE", "23505")
_CONFLICTS = (
    ("cells", "the object needs cells of the array that another object holds",
     "place it again on the cells that are free now"),
    ("objects", "an object of this name was registered meanwhile", "run the same command again"),
)  # fmt: skip

_GONE = "08006"  # SQLSTATE: connection failure

_RESTORE_SERVER = "see the server's log; restore the database from a copy if it is damaged"
_RESTORE = "restore it from a copy, or rescue what is left with `sqlite3 FILE .recover`"

_MEANINGS: tuple[tuple[tuple[str, ...], str, str], ...] = (
    (
        ("SQLITE_BUSY", "SQLITE_LOCKED", "55P03"),
        "other programs keep the database locked",
        "wait until they have ended, then run the same command again",
    ),
    (("SQLITE_NOTADB",), "this file is not a database", "name another file, or move this one away"),
    (("SQLITE_CORRUPT",), "the database file is damaged", _RESTORE),
    (
        ("SQLITE_READONLY",),
        "the database may not be written",
        "allow writing to it and its folder, or choose another with --database",
    ),
    (
        ("42501", "3F000", "25006"),
        "the server does not let this user do that: {}",
        "have the database's owner grant it (docs/lab.md, Rights), or name another user or server",
    ),
    (
        ("SQLITE_CANTOPEN",),
        "the database file cannot be opened",
        "check that its folder exists and that you may read and write there",
    ),
    (
        ("SQLITE_FULL", "53100"),
        "no space is left for the database",
        "free some space, then run the same command again",
    ),
    (
        ("SQLITE_IOERR",),
        "the database file cannot be read or written: {}",
        "check the disk, its space and the limit of a file's size, then run the same command again",
    ),
    (
        ("57014", "53"),
        "the server did not complete the work, what was begun is undone: {}",
        "run the same command again, or ask the server's administrator",
    ),
    (
        ("57", "08"),
        "the server ended the connection, what was begun is undone: {}",
        "run the same command again",
    ),
)


TRIES = 8
FIRST_PAUSE_S = 0.02  #: doubled after every conflict, shortened by chance to half at most


def retry_on_conflict(
    engine: Engine,
    work: Callable[[Connection], Result],
    *,
    tries: int = TRIES,
    rng: np.random.Generator | None = None,
) -> Result:
    """Return what `work` returns; its transaction is committed then.

    `work` gets the connection of a `write_transaction`, again after each conflict: it must read the
    database itself and leave nothing behind that is not undone.

    Raises
    ------
    WriteConflictError
        The last of `TRIES` met a conflict, too.
    DatabaseError
        As `write_transaction`.
    """
    chance = np.random.default_rng(os.getpid()) if rng is None else rng
    for number in range(tries - 1):
        try:
            with write_transaction(engine) as connection:
                return work(connection)
        except WriteConflictError:
            time.sleep(FIRST_PAUSE_S * 2**number * chance.uniform(0.5, 1.0))
    with write_transaction(engine) as connection:
        return work(connection)


def connection_error(said: str, url: URL, place: str) -> DatabaseError:
    """Return the error for a connection that was not made, from all that the driver says.

    It has no error code: the words of libpq and of the server say why; a server that speaks another
    language than English is quoted as it is.
    """
    server = f"{url.host or 'this computer'}{f':{url.port}' if url.port else ''}"
    for phrases, cause, fix in _CONNECTION_MEANINGS:
        if any(phrase in said for phrase in phrases):
            names = {"server": server, "name": url.database or "", "user": url.username or ""}
            return DatabaseError(cause.format(**names), fix=fix.format(**names), place=place)
    lines = said.strip().splitlines() or ["the server gives no reason"]
    fix = "check that the server runs, and host, port, user and name in the URL"
    return DatabaseError(f"cannot connect: {lines[0]}", fix=fix, place=place)


_CONNECTION_MEANINGS: tuple[tuple[tuple[str, ...], str, str], ...] = (
    (
        ("starting up", "shutting down", "too many", "remaining connection slots", "not currently"),
        "the server on {server} takes no more connections now",
        "run the same command again in a moment, or ask the server's administrator",
    ),
    (
        ("permission denied for database",),
        "the user '{user}' may not connect to the database '{name}'",
        'have its owner say: GRANT CONNECT ON DATABASE "{name}" TO "{user}"',
    ),
    (
        ("password authentication failed", "no password supplied"),
        "the server refuses the user '{user}' or the password",
        "correct them in the URL, or in PGUSER, PGPASSWORD and ~/.pgpass",
    ),
    (
        ('role "', "pg_hba.conf"),
        "the server does not let the user '{user}' in",
        "correct the user in the URL, or have the server's administrator add it",
    ),
    (
        ('database "',),
        "the server has no database '{name}'",
        "create it with: createdb {name}; or correct the name in the URL",
    ),
    (
        ("failed to resolve", "could not translate host name"),
        "there is no host '{server}'",
        "correct the host in the URL",
    ),
    (
        ("Connection refused", "No such file or directory"),
        "no PostgreSQL server runs on {server}",
        "start it, or correct host and port in the URL",
    ),
    (
        ("timeout", "timed out", "unreachable", "No route to host"),
        "the server on {server} does not answer",
        "check the network and the firewall, or correct host and port in the URL",
    ),
)
