"""Opening: what is made, what is refused, in which words; older schema versions become today's."""

import os
import re
import shutil
import signal
import sqlite3
import time
from contextlib import closing
from multiprocessing import get_context
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import select, text

from generator.array.lab_key import read_lab_key
from generator.database import migrate, tables
from generator.database.cells import occupied_cells
from generator.database.lab import lab_key
from generator.database.migrations import v3
from generator.database.open import database_exists, normal_url, open_database
from generator.database.read import list_objects
from generator.database.tables import meta
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError

EARLIER = Path(__file__).parents[3] / "fixtures" / "database"


def refused(url, **options):
    with pytest.raises(DatabaseError) as caught:
        open_database(url, **options)
    assert caught.value.exit_code == 4
    assert caught.value.fix
    return str(caught.value)


@pytest.mark.parametrize(
    ("given", "backend", "database"),
    [
        ("a b/läb?#%.db", "sqlite", "a b/läb?#%.db"),
        (Path("a/lab.db"), "sqlite", "a/lab.db"),
        ("sqlite:////data/lab.db", "sqlite", "/data/lab.db"),
        ("sqlite+pysqlite:///lab.db", "sqlite", "lab.db"),
        ("postgresql://u:p@h:5433/objects", "postgresql+psycopg", "objects"),
        ("postgres://h/objects", "postgresql+psycopg", "objects"),
    ],
)
def test_urls(given, backend, database):
    url = normal_url(given)
    assert (url.drivername, url.database) == (backend, database)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("", "no database is named"),
        (None, "None is no database"),
        ("mysql://h/objects", "allowed are sqlite and postgresql"),
        ("postgresql:/objects", "half an address"),
        ("sqlite:lab.db", "half an address"),
        ("sqlite://", "names no file"),
        ("sqlite:///:memory:", "names no file"),
        ("sqlite://lab.db", "sqlite:///lab.db"),
        ("sqlite:///lab.db?mode=ro", "settings"),
        ("://", "not a database URL"),
        ("postgresql://h:port/x", "not a database URL"),
    ],
)
def test_urls_that_name_no_database(given, said):
    assert said in refused(given)


def test_a_new_database_is_one_file_and_opened_to_read_it_is_not_written(tmp_path):
    path = tmp_path / "a b?#%41.db"
    with read_transaction(open_database(str(path))) as connection:
        stored = {row.key: row.value for row in connection.execute(select(meta))}
        assert stored["lab_key"] == read_lab_key(stored["lab_key"]) == lab_key(connection)
    assert os.listdir(tmp_path) == [path.name]  # one file, so that it can be copied
    again = open_database(str(path), writable=False)
    with (
        pytest.raises(DatabaseError, match="may not be written"),
        write_transaction(again) as connection,
    ):
        connection.execute(text("DELETE FROM meta"))


def test_a_database_exists_once_it_was_made(tmp_path):
    path = tmp_path / "lab.db"
    assert "does not exist" in refused(path, writable=False)
    assert not database_exists(str(path))
    assert list(tmp_path.iterdir()) == []  # a reader makes nothing
    path.touch()
    assert "no objects are registered here" in refused(path, writable=False)
    assert not database_exists(str(path))
    assert path.stat().st_size == 0
    open_database(str(path))  # an empty file becomes a database
    assert database_exists(str(path))
    with pytest.raises(DatabaseError, match="does not exist"):
        database_exists(str(tmp_path / "missing" / "lab.db"))
    assert "a folder" in refused(tmp_path)


FOREIGN = [b"\n", b"solid cube\nendsolid\n" * 200, b"\x00" * 5000, b"name: Cube\n"]
SCHEMAS = ["objects (x)", "meta (version)", "meta (key TEXT, value TEXT)"]


@pytest.mark.parametrize("content", [*FOREIGN, *SCHEMAS, 100, 4096, 12288, 40000])
def test_a_file_that_is_no_whole_database_is_left_alone(tmp_path, content):
    """Of another sort, of another program, or cut off after so many bytes."""
    path = tmp_path / "lab.db"
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif isinstance(content, str):
        with closing(sqlite3.connect(path)) as connection, connection:
            connection.execute(f"CREATE TABLE {content}")
    else:
        open_database(str(path))
        os.truncate(path, content)
    before = path.read_bytes()
    assert re.search("damaged|not a database|another program", refused(path))
    assert path.read_bytes() == before


def test_a_read_only_place_is_refused_for_writing_alone(unprivileged):
    folder, path = unprivileged, unprivileged / "lab.db"
    open_database(str(path))
    folder.chmod(0o555)
    assert "may not be written" in refused(folder / "new.db")
    assert "may not be written" in refused(path)  # its journal would stand in the folder
    folder.chmod(0o755)
    path.chmod(0o444)
    assert "may not be written" in refused(path)
    folder.chmod(0o555)
    with read_transaction(open_database(str(path), writable=False)) as connection:
        assert len(connection.execute(select(meta)).all()) == 3


def test_an_older_database_that_may_not_be_written_says_what_to_do(unprivileged):
    path = Path(of_version(1, str(unprivileged / "lab.db")))
    path.chmod(0o444)
    unprivileged.chmod(0o555)
    with pytest.raises(DatabaseError, match="schema version 1, must be brought to 3") as caught:
        open_database(str(path), writable=False)
    assert "encode-object list" in caught.value.fix
    assert path.read_bytes() == (EARLIER / "v1.db").read_bytes()


def forked(action, times=1):
    """Run an action in processes of their own, forked from this one at once; their exit codes."""
    children = [get_context("fork").Process(target=action) for _ in range(times)]
    for child in children:
        child.start()
    for child in children:
        child.join()
    return [child.exitcode for child in children]


def test_many_may_make_a_database_at_once(tmp_path):
    path = str(tmp_path / "lab.db")
    assert forked(lambda: open_database(path), times=3) == [0, 0, 0]
    with read_transaction(open_database(path, writable=False)) as connection:
        assert len(connection.execute(select(meta)).all()) == 3


@pytest.fixture(scope="module")
def guarded_server(postgresql_server):
    """Address of the server, on which lab needs a password and eve is not let in."""
    import psycopg

    with psycopg.connect(postgresql_server, autocommit=True) as connection:
        file = Path(connection.execute("SHOW hba_file").fetchone()[0])
        before = file.read_text()
        rules = "host all lab all scram-sha-256\nhost all eve all reject\n"
        file.write_text(rules + before)
        connection.execute("CREATE ROLE lab LOGIN PASSWORD 'right'")
        connection.execute("CREATE ROLE guest LOGIN")
        connection.execute("CREATE ROLE crowd LOGIN CONNECTION LIMIT 0")
        connection.execute("CREATE DATABASE closed")
        connection.execute("REVOKE CONNECT ON DATABASE closed FROM PUBLIC")
        connection.execute("SELECT pg_reload_conf()")
        address = postgresql_server.partition("@")[2].partition("/")[0]
        for _ in range(200):  # the server takes the rules over in its own time
            try:
                psycopg.connect(f"postgresql://lab:wrong@{address}/postgres").close()
            except psycopg.OperationalError:
                break
            time.sleep(0.05)
        yield address
        file.write_text(before)
        connection.execute("DROP DATABASE closed")
        for role in ("lab", "guest", "crowd"):
            connection.execute(f"DROP ROLE {role}")
        connection.execute("SELECT pg_reload_conf()")


# Port 9 (discard) of the loopback: nothing listens there.
@pytest.mark.parametrize(
    ("url", "cause", "fix"),
    [
        ("lab:secret@127.0.0.1:9/postgres", "no PostgreSQL server runs on 127.0.0.1:9", "start it"),
        ("lab:secret@{}/postgres", "refuses the user 'lab' or the password", "correct them"),
        ("lab@{}/postgres", "refuses the user 'lab' or the password", "~/.pgpass"),
        ("eve:secret@{}/postgres", "does not let the user 'eve' in", "correct the user"),
        ("nobody:secret@{}/postgres", "does not let the user 'nobody' in", "administrator"),
        ("postgres:secret@{}/nowhere", "has no database 'nowhere'", "createdb nowhere"),
        ("lab:secret@no.such.host.invalid/x", "there is no host 'no.such.host.invalid'", "host"),
        ("lab:secret@127.0.0.1:99999/x", "invalid port number", "port"),
        ("guest:secret@{}/postgres", "permission denied for schema public", "docs/lab.md"),
        ("guest:secret@{}/closed", "may not connect to the database 'closed'", "GRANT CONNECT"),
        ("crowd:secret@{}/postgres", "takes no more connections now", "in a moment"),
    ],
)  # fmt: skip
def test_a_server_that_is_not_reached_says_why(guarded_server, url, cause, fix):
    whole = f"postgresql://{url.format(guarded_server)}"
    with pytest.raises(DatabaseError) as caught:
        open_database(whole)
    error = caught.value
    assert error.exit_code == 4
    assert cause in error.cause
    assert fix in error.fix
    assert error.place == whole.replace("secret", "***")
    assert "secret" not in str(error)
    right = f"postgresql://lab:right@{guarded_server}/postgres"
    with pytest.raises(DatabaseError, match="no objects are registered"):
        open_database(right, writable=False)


@pytest.fixture
def guest_of(postgresql_server):
    """Return a function that grants a new user rights in a schema; returns the URL of theirs."""
    import psycopg

    with psycopg.connect(postgresql_server, autocommit=True) as connection:
        connection.execute("CREATE ROLE reader LOGIN")

        def url(lab, *grants):
            schema = lab.rpartition("%3D")[2]
            for grant in (f"USAGE ON SCHEMA {schema}", *grants):
                connection.execute(f"GRANT {grant.format(schema)} TO reader")
            return lab.replace("postgres@", "reader@")

        yield url
        connection.execute("DROP OWNED BY reader")
        connection.execute("DROP ROLE reader")


def test_a_right_that_is_missing_is_named(new_database, guest_of):
    lab = new_database("postgresql")
    open_database(lab)
    theirs = guest_of(lab)
    for _ in range(2):
        said = refused(theirs, writable=False)
        assert "permission denied for table meta" in said
        assert "docs/lab.md, Rights" in said
        assert "written" not in said  # they only read
    open_database(guest_of(lab, "SELECT ON ALL TABLES IN SCHEMA {}"), writable=False)
    before = of_version(1, new_database("postgresql"))
    said = refused(guest_of(before, "SELECT ON ALL TABLES IN SCHEMA {}"), writable=False)
    assert "schema version 1, must be brought to 3" in said
    assert "opened once by who may write it" in said


def test_a_reader_waits_for_a_lock_no_longer_than_it_was_told(new_database):
    import psycopg

    lab = new_database("postgresql")
    open_database(lab)
    with psycopg.connect(lab) as other:
        other.execute("LOCK TABLE meta IN ACCESS EXCLUSIVE MODE")
        assert "keep the database locked" in refused(lab, writable=False, wait_s=0.2)


# Earlier schema versions; that all their rows are there afterwards, tests/corpora hold.

NAMES = ["Cube", "Prism", "Small box-1", "Small box-2"]


def of_version(number, lab_url):
    """Put a database of an earlier version: the committed file, or the committed dump."""
    if "://" not in lab_url:
        shutil.copy(EARLIER / f"v{number}.db", lab_url)
        return lab_url
    import psycopg

    with psycopg.connect(lab_url, autocommit=True) as connection:
        connection.execute((EARLIER / f"v{number}.sql").read_bytes())
    return lab_url


@pytest.fixture
def first_version(lab_url):
    return of_version(1, lab_url)


@pytest.mark.parametrize("version", [1, 2])
def test_the_migrated_schema_is_the_one_that_new_databases_get(version, lab_url, new_database):
    earlier = of_version(version, lab_url)
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


def test_a_copy_is_never_written_over_another_one(tmp_path):
    (tmp_path / "lab.v1.db").write_text("something else")
    open_database(of_version(1, str(tmp_path / "lab.db")))
    assert (tmp_path / "lab.v1.db").read_text() == "something else"
    assert database_exists(str(tmp_path / "lab.v1-2.db"))


@pytest.mark.parametrize("end", ["error", "kill"])
def test_a_migration_that_ends_early_changes_nothing(first_version, monkeypatch, end):
    done = v3.upgrade

    def ending(connection):
        done(connection)
        if end == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        raise KeyboardInterrupt

    before = None if "://" in first_version else Path(first_version).read_bytes()
    with monkeypatch.context() as patched:
        patched.setattr(v3, "upgrade", ending)
        if end == "kill":
            assert forked(lambda: open_database(first_version)) == [-signal.SIGKILL]
        else:
            with pytest.raises(KeyboardInterrupt):
                open_database(first_version)
            if before is not None:
                assert Path(first_version).read_bytes() == before
                assert os.listdir(Path(first_version).parent) == ["lab.db"]
    with read_transaction(open_database(first_version)) as connection:  # migrates at last
        assert [entry.name for entry in list_objects(connection)] == NAMES
        assert len(occupied_cells(connection, 1)[0]) == 176


def test_no_copy_no_migration(tmp_path, monkeypatch):
    def full(path, copy):
        raise sqlite3.OperationalError("database or disk is full")

    monkeypatch.setattr(migrate, "snapshot", full)
    file = Path(of_version(1, str(tmp_path / "lab.db")))
    before = file.read_bytes()
    with pytest.raises(DatabaseError, match=r"no copy can be made .* disk is full"):
        open_database(str(file))
    assert file.read_bytes() == before
    assert os.listdir(tmp_path) == ["lab.db"]


def test_many_may_open_an_older_database_at_once(first_version, monkeypatch):
    done = v3.upgrade
    upgraded, note = os.pipe()

    def noting(connection):
        done(connection)
        os.write(note, b"1")

    monkeypatch.setattr(v3, "upgrade", noting)
    assert forked(lambda: open_database(first_version), times=3) == [0, 0, 0]
    os.close(note)
    assert os.read(upgraded, 100) == b"1"
    os.close(upgraded)
    if "://" not in first_version:
        assert sorted(os.listdir(Path(first_version).parent)) == ["lab.db", "lab.v1.db"]
