"""Opening: what is made, what is refused, and in which words."""

import os
import sqlite3
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from sqlalchemy import select, text

from generator.array.lab_key import read_lab_key
from generator.database.lab import lab_key
from generator.database.open import database_exists, normal_url, open_database
from generator.database.tables import SCHEMA_VERSION, meta, metadata
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError


def refused(url, **options):
    with pytest.raises(DatabaseError) as caught:
        open_database(str(url), **options)
    assert caught.value.exit_code == 4
    assert caught.value.fix
    return str(caught.value)


@pytest.mark.parametrize(
    ("given", "backend", "database"),
    [
        ("lab.db", "sqlite", "lab.db"),
        ("a b/läb?#%.db", "sqlite", "a b/läb?#%.db"),
        ("sqlite:///lab.db", "sqlite", "lab.db"),
        ("sqlite:////data/lab.db", "sqlite", "/data/lab.db"),
        ("sqlite+pysqlite:///lab.db", "sqlite", "lab.db"),
        ("postgresql://u:p@h:5433/objects", "postgresql+psycopg", "objects"),
        ("postgresql+psycopg://h/objects", "postgresql+psycopg", "objects"),
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


def test_a_new_database_has_all_tables_and_its_version(tmp_path):
    path = tmp_path / "a b?#%41.db"
    engine = open_database(str(path))
    assert path.is_file()
    with read_transaction(engine) as connection:
        stored = {row.key: row.value for row in connection.execute(select(meta))}
        key = stored.pop("lab_key")
        assert read_lab_key(key) == key == lab_key(connection)
        assert stored == {"format": "encoded-objects", "schema_version": str(SCHEMA_VERSION)}
        for table in metadata.sorted_tables:
            connection.execute(select(table)).all()
    assert os.listdir(tmp_path) == [path.name]  # one file, so that it can be copied
    again = open_database(str(path), writable=False)
    with (
        pytest.raises(DatabaseError, match="may not be written"),
        write_transaction(again) as connection,
    ):
        connection.execute(text("DELETE FROM meta"))


def test_an_empty_file_becomes_a_database(tmp_path):
    path = tmp_path / "lab.db"
    path.touch()
    assert "no objects are registered here" in refused(path, writable=False)
    assert path.stat().st_size == 0
    open_database(str(path))
    assert path.stat().st_size > 0


def test_a_database_exists_once_it_was_made(tmp_path):
    path = tmp_path / "lab.db"
    assert not database_exists(str(path))
    path.touch()
    assert not database_exists(str(path))
    assert path.stat().st_size == 0
    open_database(str(path))
    assert database_exists(str(path))
    path.write_bytes(b"solid" * 1000)
    with pytest.raises(DatabaseError, match="not a database"):
        database_exists(str(path))
    with pytest.raises(DatabaseError, match="does not exist"):
        database_exists(str(tmp_path / "missing" / "lab.db"))


def test_a_reader_makes_nothing(tmp_path):
    assert "does not exist" in refused(tmp_path / "lab.db", writable=False)
    assert list(tmp_path.iterdir()) == []


def test_places_that_hold_no_database(tmp_path):
    assert "mkdir" in refused(tmp_path / "missing" / "lab.db")
    assert "a folder" in refused(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "content", [b"solid cube\nendsolid\n" * 200, b"\x00" * 5000, b"name: Cube\n"]
)
def test_a_file_that_is_no_database_is_left_alone(tmp_path, content):
    path = tmp_path / "lab.db"
    path.write_bytes(content)
    assert "not a database" in refused(path)
    assert path.read_bytes() == content


def test_a_truncated_database_is_refused(tmp_path):
    whole = tmp_path / "whole.db"
    open_database(str(whole))
    path = tmp_path / "lab.db"
    for size in (100, 4096, 12288, 40000):
        path.write_bytes(whole.read_bytes()[:size])
        said = refused(path)
        assert "damaged" in said or "not a database" in said or "another program" in said


def test_another_programs_database_is_left_alone(tmp_path):
    for schema in (
        "CREATE TABLE bookmarks (url TEXT)",
        "CREATE TABLE objects (x)",
        "CREATE TABLE meta (version)",
        "CREATE TABLE meta (key TEXT, value TEXT)",
    ):
        path = tmp_path / "other.db"
        path.unlink(missing_ok=True)
        connection = sqlite3.connect(path)
        connection.execute(schema)
        connection.close()
        before = path.read_bytes()
        assert "another program" in refused(path)
        assert path.read_bytes() == before


@pytest.fixture
def unprivileged():
    """A folder of its own, seen as a person who is not root: root may write anywhere."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        root = os.geteuid() == 0
        if root:
            os.chown(folder, 65534, 65534)
            os.seteuid(65534)
        try:
            yield folder
        finally:
            if root:
                os.seteuid(0)
            folder.chmod(0o755)


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


def test_a_writer_waits_for_its_turn_and_no_longer(tmp_path):
    engine = open_database(str(tmp_path / "lab.db"))
    hasty = open_database(str(tmp_path / "lab.db"), wait_s=0.05)
    with write_transaction(engine):
        with read_transaction(hasty) as connection:  # readers go on
            connection.execute(select(meta)).all()
        with (
            pytest.raises(DatabaseError, match="keep the database locked"),
            write_transaction(hasty),
        ):
            pass
    with write_transaction(hasty):
        pass


def test_many_may_make_a_database_at_once(tmp_path):
    script = (
        "import sys; from generator.database.open import open_database;"
        "sys.stdin.readline(); open_database(sys.argv[1])"
    )
    path = tmp_path / "lab.db"
    makers = [
        subprocess.Popen([sys.executable, "-c", script, str(path)], stdin=subprocess.PIPE)
        for _ in range(3)
    ]
    for maker in makers:
        maker.stdin.write(b"go\n")
        maker.stdin.flush()
    for maker in makers:
        maker.stdin.close()
        assert maker.wait(timeout=60) == 0
    with read_transaction(open_database(str(path), writable=False)) as connection:
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
        connection.execute("DROP ROLE lab")
        connection.execute("DROP ROLE guest")
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
        ("guest:secret@{}/postgres", "may not be written", "choose another"),
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


def test_the_right_password_opens_the_server(guarded_server):
    with pytest.raises(DatabaseError, match="no objects are registered"):
        open_database(f"postgresql://lab:right@{guarded_server}/postgres", writable=False)
