"""Export objects into a file of their own, and import them in another lab.

An exported file is a SQLite database that every command reads. Importing works on a copy, so that
a file is never changed, whichever schema version it has, and brings in all objects or none. Files
of parts are not carried: they are named from where they lie. What a lab imports stands on the
arrays that it came on; labs of schema version 1 and 2 hold the same cells, and refuse each other's.
"""

from __future__ import annotations

import os
import sqlite3
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy import URL, Connection, Engine

from generator.array.lab_key import read_lab_key
from generator.database.lab import require_lab_key
from generator.database.migrate import snapshot
from generator.database.open import database_exists, normal_url, open_database
from generator.database.transaction import (
    place_of,
    read_transaction,
    retry_on_conflict,
    write_transaction,
)
from generator.database.transfer import CopyReport, copy_objects
from generator.errors import DatabaseError


def export_objects(
    url: str, file: Path, *, names: Sequence[str] = (), force: bool = False
) -> CopyReport:
    """Write objects of a database into a new database file, whole or not at all; () for all.

    Raises
    ------
    DatabaseError
        No object has a name asked for, the file is there already (without `force`) or cannot be
        written.
    """
    engine = open_database(url, writable=False)
    file = file.absolute()
    if _same_database(engine.url, normal_url(str(file))):
        raise DatabaseError(
            "a database cannot be exported into itself",
            fix="name another file, such as for-the-other-lab.db",
            place=str(file),
        )
    if file.exists() and not force:
        fix = "choose another name, or replace it with --force"
        raise DatabaseError("the file is there already", fix=fix, place=str(file))
    if not file.parent.is_dir():
        fix = f"make it with: mkdir -p {file.parent}"
        raise DatabaseError(f"folder {file.parent} does not exist", fix=fix, place=str(file))
    partial = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        made = open_database(str(partial))
        made.update_execution_options(home=normal_url(str(file)))
        with read_transaction(engine) as source, write_transaction(made) as target:
            carried = copy_objects(source, target, names=names)
        if force:
            partial.replace(file)
        else:
            os.link(partial, file)  # fails, unlike a rename, if the file has come up meanwhile
    except OSError as error:
        fix = "choose a folder that may be written"
        raise DatabaseError(f"cannot write: {error.strerror}", fix=fix, place=str(file)) from error
    finally:
        partial.unlink(missing_ok=True)
    return carried


def import_objects(
    url: str,
    given: str,
    *,
    names: Sequence[str] = (),
    renamed: Mapping[str, str] | None = None,
    skip_refused: bool = False,
    dry_run: bool = False,
    lab_key: str = "",
) -> CopyReport:
    """Bring the objects of another database into this one.

    Parameters
    ----------
    url
        The database that receives them; made when it is new.
    given
        A file or URL that holds them; it is not changed.
    names, renamed
        Which objects (empty for all), and their new names by their old ones.
    skip_refused
        Import the others where some are refused.
    dry_run
        Say what would be done, and do nothing.
    lab_key
        Of a database that is new: that of `given` moves a lab as a whole; drawn if left out.

    Raises
    ------
    DatabaseError
        An object is refused: its cells or its name are held here, or it was damaged.
    LabKeyError
        It is no key, or the database has another.
    """
    lab_key = lab_key and read_lab_key(lab_key)
    home = normal_url(given)
    engine_home = normal_url(url)
    if _same_database(home, engine_home):
        fix = "name the file that another lab exported"
        cause = "a database cannot be imported into itself"
        raise DatabaseError(cause, fix=fix, place=place_of(home))
    from_file = home.get_backend_name() == "sqlite"
    name = Path(home.database or "").name if from_file else place_of(home)
    utc = datetime.now(UTC).isoformat(timespec="seconds")
    origin = {"imported_from": name, "imported_utc": utc}
    with _open_unchanged(given, home) as source_engine, read_transaction(source_engine) as source:

        def work(target: Connection) -> CopyReport:
            if lab_key:
                require_lab_key(target, lab_key)
            carried = copy_objects(
                source, target, names=names, renamed=renamed, origin=origin,
                skip_refused=skip_refused,
            )  # fmt: skip
            if dry_run:
                target.rollback()
            return carried

        if not database_exists(url):  # what is refused leaves no database behind
            with tempfile.TemporaryDirectory() as folder:
                trial = open_database(str(Path(folder) / "lab.db"), lab_key=lab_key)
                trial.update_execution_options(home=engine_home)
                carried = retry_on_conflict(trial, work)
            if dry_run:
                return carried
        return retry_on_conflict(open_database(url, lab_key=lab_key), work)


@contextmanager
def _open_unchanged(url: str, home: URL) -> Iterator[Engine]:
    """Open a database that is not changed: of a file, a copy of its own."""
    if home.get_backend_name() != "sqlite":
        yield open_database(url, writable=False)
        return
    path = Path(home.database or "").absolute()
    if not database_exists(url):
        there = "no objects are registered here" if path.exists() else "this file does not exist"
        fix = "name a file that was written by: encode-object export FILE"
        raise DatabaseError(there, fix=fix, place=str(path))
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "lab.db"
        try:
            snapshot(path, copy)
            with closing(sqlite3.connect(copy)) as plain:
                said = plain.execute("PRAGMA integrity_check").fetchone()[0]
                lost = plain.execute("PRAGMA foreign_key_check").fetchone()
        except sqlite3.Error as error:
            said, lost = str(error), None
        if said != "ok" or lost:
            cause = (
                f"the file is damaged: {said if said != 'ok' else f'rows of {lost[0]} are lost'}"
            )
            raise DatabaseError(cause, fix="export it once more", place=str(path))
        engine = open_database(str(copy), writable=False, keep_older=False)
        engine.update_execution_options(home=home)
        yield engine


def _same_database(one: URL, other: URL) -> bool:
    """Whether two URLs name one database."""
    if one == other:
        return True
    if {one.get_backend_name(), other.get_backend_name()} != {"sqlite"}:
        return False
    paths = Path(one.database or ""), Path(other.database or "")
    return all(path.exists() for path in paths) and paths[0].samefile(paths[1])
