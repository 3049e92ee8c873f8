"""Databases of earlier schema versions, as they were written then, become today's."""

import os
import shutil
import signal
import sqlite3
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import select, text

from generator.array.definition import array_from
from generator.database import migrate, tables
from generator.database.as_built import AsBuilt, read_as_built, write_as_built
from generator.database.cells import held_cells, occupied_cells
from generator.database.migrations import v3
from generator.database.open import database_exists, open_database
from generator.database.read import list_objects, read_array, read_layout, read_object
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError

FIRST = Path(__file__).parents[3] / "fixtures" / "database"
NAMES = ["Cube", "Prism", "Small box-1", "Small box-2"]
NAMES_OF = {1: NAMES, 2: ["Brick", "Cube", "Prism", "Pyramid", "Small box-1", "Small box-2"]}
TAKEN_OF = {1: [96 + 40 + 40, 90], 2: [96 + 40 + 40, 90, 76, 88]}  # cells, by array


def of_version(number, lab_url):
    """Put a database of an earlier version: the committed file, or the committed dump."""
    if "://" not in lab_url:
        shutil.copy(FIRST / f"v{number}.db", lab_url)
        return lab_url
    import psycopg

    with psycopg.connect(lab_url, autocommit=True) as connection:
        connection.execute((FIRST / f"v{number}.sql").read_bytes())
    return lab_url


@pytest.fixture
def first_version(lab_url):
    return of_version(1, lab_url)


@pytest.fixture(params=sorted(NAMES_OF))
def version(request):
    return request.param


@pytest.fixture
def earlier(version, lab_url):
    return of_version(version, lab_url)


@pytest.fixture
def first_file(tmp_path):
    shutil.copy(FIRST / "v1.db", tmp_path / "lab.db")
    return tmp_path / "lab.db"


def test_objects_of_earlier_versions_are_all_there(version, earlier):
    engine = open_database(earlier)
    with read_transaction(engine) as connection:
        stored = {row.key: row.value for row in connection.execute(select(tables.meta))}
        assert stored == {"format": "encoded-objects", "schema_version": "3"}  # no lab key
        assert [entry.name for entry in list_objects(connection)] == NAMES_OF[version]
        for entry in list_objects(connection):
            imported = version == 2 and entry.name == "Pyramid"
            assert bool(entry.retired_utc) == (version == 2 and entry.name == "Small box-2")
            assert entry.imported_from == ("other.db" if imported else "")
            held = read_object(connection, entry.name)
            array = array_from(held.array.definition)
            assert array.definition() == held.array.definition
            assert len(held.faces) == entry.number_of_faces == len(held.layout.faces)
            assert sum(len(face.rows) for face in held.layout.faces) == entry.symbols > 0
            for face in held.layout.faces:
                np.testing.assert_array_equal(array.symbols(face.rows, face.columns), face.labels)
        for array_id, number in enumerate(TAKEN_OF[version], 1):
            taken = np.stack(occupied_cells(connection, array_id), axis=1)
            np.testing.assert_array_equal(taken, held_cells(connection, array_id)[:, :2])
            assert len(taken) == number
        assert read_array(connection, 2).profile == "thesis"
        assert connection.execute(select(tables.arrays.c.lab_key)).scalars().all() == [None] * len(
            TAKEN_OF[version]
        )


def test_a_migrated_database_keeps_how_prints_came_out(earlier):
    measured = AsBuilt(1, None, "mk4", "PLA", 0.997, 0.998, -0.0, 1.43, np.eye(4), 25)
    with write_transaction(open_database(earlier)) as connection:
        write_as_built(connection, measured)
        write_as_built(connection, replace(measured, printer="x1"))
        found = read_as_built(connection, 1)
    assert [one.printer for one in found] == ["x1"]  # a part is known as it was felt last
    assert repr(found[0].skew_rad) == "-0.0"


def test_the_migrated_schema_is_the_one_that_new_databases_get(earlier, new_database):
    for url in (earlier, new_database("sqlite")):
        with read_transaction(open_database(url)) as connection:
            context = MigrationContext.configure(connection, opts={"compare_type": False})
            assert compare_metadata(context, tables.metadata) == []
    if "://" in earlier:
        return
    with sqlite3.connect(earlier) as old, sqlite3.connect(url) as new:
        for table in tables.metadata.tables:
            listed = f'PRAGMA table_info("{table}")'
            columns = [sorted(row[1:] for row in c.execute(listed)) for c in (old, new)]
            assert columns[0] == columns[1]


def test_a_reader_finds_an_older_database_and_migrates_it(first_version):
    assert database_exists(first_version)
    with read_transaction(open_database(first_version, writable=False)) as connection:
        assert read_layout(connection, "Cube").kind == "faces"
    with (
        pytest.raises(DatabaseError, match="may not be written"),
        write_transaction(open_database(first_version, writable=False)) as connection,
    ):
        connection.execute(text("DELETE FROM cells"))


def test_a_copy_is_never_written_over_another_one(first_file):
    (first_file.parent / "lab.v1.db").write_text("something else")
    open_database(str(first_file))
    assert (first_file.parent / "lab.v1.db").read_text() == "something else"
    assert database_exists(str(first_file.parent / "lab.v1-2.db"))


def test_a_migration_that_fails_changes_nothing(first_version, monkeypatch):
    class NoMemoryError(Exception):
        pass

    def failing(connection):
        done(connection)
        raise NoMemoryError

    done = v3.upgrade
    monkeypatch.setattr(v3, "upgrade", failing)
    before = None if "://" in first_version else Path(first_version).read_bytes()
    with pytest.raises(NoMemoryError):
        open_database(first_version)
    if before is not None:
        assert Path(first_version).read_bytes() == before
        assert os.listdir(Path(first_version).parent) == ["lab.db"]
    monkeypatch.undo()
    with read_transaction(open_database(first_version)) as connection:
        assert [entry.name for entry in list_objects(connection)] == NAMES


def test_no_copy_no_migration(first_file, monkeypatch):
    def full(path, copy):
        raise sqlite3.OperationalError("database or disk is full")

    monkeypatch.setattr(migrate, "snapshot", full)
    before = first_file.read_bytes()
    with pytest.raises(DatabaseError, match=r"no copy can be made .* disk is full"):
        open_database(str(first_file))
    assert first_file.read_bytes() == before
    assert os.listdir(first_file.parent) == ["lab.db"]


def forked(action):
    """Run an action in a process of its own, forked from this one; return its number."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            action()
            code = 0
        finally:
            os._exit(code)
    return child


def test_a_migration_killed_before_its_commit_leaves_the_old_version(first_version, monkeypatch):
    done = v3.upgrade

    def killing(connection):
        done(connection)
        os.kill(os.getpid(), signal.SIGKILL)

    with monkeypatch.context() as patched:
        patched.setattr(v3, "upgrade", killing)
        _, status = os.waitpid(forked(lambda: open_database(first_version)), 0)
    assert os.WTERMSIG(status) == signal.SIGKILL
    with read_transaction(open_database(first_version)) as connection:  # migrates at last
        assert [entry.name for entry in list_objects(connection)] == NAMES
        assert len(occupied_cells(connection, 1)[0]) == 176


def test_many_may_open_an_older_database_at_once(first_version, monkeypatch):
    done = v3.upgrade
    upgraded, note = os.pipe()

    def noting(connection):
        done(connection)
        os.write(note, b"1")

    monkeypatch.setattr(v3, "upgrade", noting)
    several = [forked(lambda: open_database(first_version)) for _ in range(3)]
    assert [os.waitpid(child, 0)[1] for child in several] == [0, 0, 0]
    os.close(note)
    assert os.read(upgraded, 100) == b"1"
    os.close(upgraded)
    if "://" not in first_version:
        assert sorted(os.listdir(Path(first_version).parent)) == ["lab.db", "lab.v1.db"]


def test_an_older_database_that_may_not_be_written_says_what_to_do():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(FIRST / "v1.db", folder / "lab.db")
        folder.chmod(0o555)
        (folder / "lab.db").chmod(0o444)
        root = os.geteuid() == 0
        if root:  # root may write anywhere
            os.seteuid(65534)
        try:
            with pytest.raises(DatabaseError, match="schema version 1, must be brought to 3") as e:
                open_database(str(folder / "lab.db"), writable=False)
        finally:
            if root:
                os.seteuid(0)
            folder.chmod(0o755)
        assert "encode-object list" in e.value.fix
        assert (folder / "lab.db").read_bytes() == (FIRST / "v1.db").read_bytes()
