"""Writers that meet: who loses places anew, a bounded number of times, and says so in the end."""

import os
import resource
import socket
import threading

import numpy as np
import psycopg
import pytest
from sqlalchemy import text

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle
from generator.array.profiles import PROFILES
from generator.database.cells import find_array, held_cells, occupied_cells
from generator.database.open import open_database
from generator.database.read import find_object, list_objects
from generator.database.register import ObjectRecord, register
from generator.database.transaction import (
    WriteConflictError,
    read_transaction,
    retry_on_conflict,
    write_transaction,
)
from generator.errors import DatabaseError
from generator.layout.layout import lay_out
from generator.polyhedron.shapes import tetrahedron

ARRAY = PROFILES["one-touch"].array()
SOLID = tetrahedron(40.0)
CLEARANCES = [[np.full(len(loop), 1.0) for loop in face.loops] for face in SOLID.faces]


def placed(connection):
    taken = occupied_cells(connection, find_array(connection, ARRAY))
    return lay_out(SOLID, ARRAY, 7.0, 2.7, CLEARANCES, taken)


def registration(name, layout, **spec):
    return ObjectRecord(
        name, SOLID, layout, ARRAY, "one-touch", alphabet_named("dense-4"), SymbolStyle(),
        {"name": name, **spec}, "0",
    )  # fmt: skip


def test_the_loser_of_a_race_places_anew(lab_url):
    """Both choose their cells before their turn: the same ones."""
    engine = open_database(lab_url)
    both_placed = threading.Barrier(2, timeout=30)
    tries = {"a": 0, "b": 0}

    def write(name):
        with read_transaction(open_database(lab_url)) as connection:
            early = placed(connection)
        both_placed.wait()

        def work(connection):
            tries[name] += 1
            layout = early if tries[name] == 1 else placed(connection)
            return register(connection, registration(name, layout))

        retry_on_conflict(engine, work)

    writers = [threading.Thread(target=write, args=(name,)) for name in tries]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join(60)
    assert sorted(tries.values()) == [1, 2]
    with read_transaction(engine) as connection:
        entries = list_objects(connection)
        cells = held_cells(connection, 1)
    assert [entry.name for entry in entries] == ["a", "b"]
    assert len(np.unique(cells[:, :2], axis=0)) == sum(entry.symbols for entry in entries) > 40


@pytest.fixture
def engine(lab_url):
    return open_database(lab_url)


@pytest.fixture
def first(engine):
    """The layout of an object that is there already."""
    with write_transaction(engine) as connection:
        layout = placed(connection)
        register(connection, registration("first", layout))
    return layout


def test_a_lost_race_leaves_nothing_behind(engine, first):
    seen = []

    def work(connection):
        seen.append([entry.name for entry in list_objects(connection)])
        layout = first if len(seen) < 3 else placed(connection)
        return register(connection, registration("second", layout))

    retry_on_conflict(engine, work, rng=np.random.default_rng(1))
    assert seen == [["first"]] * 3


def test_who_always_loses_gives_up_and_says_why(engine, first):
    tries = []

    def work(connection):
        tries.append(1)
        return register(connection, registration("second", first))

    with pytest.raises(WriteConflictError, match="another object holds") as caught:
        retry_on_conflict(engine, work, tries=3, rng=np.random.default_rng(1))
    assert len(tries) == 3
    assert caught.value.exit_code == 4
    assert caught.value.fix


def test_errors_that_are_no_race_are_not_tried_again(engine):
    tries = []

    def work(connection):
        tries.append(1)
        layout = placed(connection)
        register(connection, registration("one", layout))
        return register(connection, registration("one", layout, other=1))

    with pytest.raises(DatabaseError, match="another spec"):
        retry_on_conflict(engine, work)
    assert len(tries) == 1
    with read_transaction(engine) as connection:
        assert list_objects(connection) == ()


def test_a_writer_without_turns_on_a_server_is_a_race_too(new_database):
    """A program that does not know of turns takes the cells while we register."""
    url = new_database("postgresql")
    engine, other = open_database(url), open_database(url)
    with write_transaction(engine) as connection:  # an object to copy the rows of
        register(connection, registration("known", placed(connection)))
        row, column = held_cells(connection, 1)[0, :2].tolist()
    reached = threading.Event()
    with read_transaction(engine) as connection:
        wanted = placed(connection)

    def meddle():
        with other.connect() as connection, connection.begin():
            statement = 'UPDATE cells SET "row" = :r, "column" = :c WHERE "row" = :old_r'
            connection.execute(
                text(f'{statement} AND "column" = :old_c'),
                {"r": int(wanted.faces[3].rows[0]), "c": int(wanted.faces[3].columns[0]),
                 "old_r": row, "old_c": column},
            )  # fmt: skip
            reached.set()
            connection.execute(text("SELECT pg_sleep(0.3)"))

    thread = threading.Thread(target=meddle)
    tries = []

    def work(connection):
        tries.append(1)
        if len(tries) == 1:
            thread.start()
            assert reached.wait(10)
            return register(connection, registration("mine", wanted))
        rows, columns = held_cells(connection, 1)[:, :2].T  # the bits do not know that cell
        layout = lay_out(SOLID, ARRAY, 7.0, 2.7, CLEARANCES, (rows, columns))
        return register(connection, registration("mine", layout))

    retry_on_conflict(engine, work)
    thread.join(30)
    assert len(tries) == 2
    with read_transaction(engine) as connection:
        assert find_object(connection, "mine") is not None


@pytest.mark.parametrize("told", [True, False])
def test_a_connection_that_the_server_ends_is_no_damage(new_database, postgresql_server, told):
    engine = open_database(new_database("postgresql"))

    def work(connection):
        register(connection, registration("lost", placed(connection)))
        if told:
            process = connection.scalar(text("SELECT pg_backend_pid()"))
            with psycopg.connect(postgresql_server, autocommit=True) as other:
                other.execute("SELECT pg_terminate_backend(%s, 10000)", [process])
        else:  # as where a network fails
            line = os.dup(connection.connection.driver_connection.fileno())
            with socket.socket(fileno=line) as cut:
                cut.shutdown(socket.SHUT_RDWR)
        connection.execute(text("SELECT 1"))

    with pytest.raises(DatabaseError, match="the server ended the connection") as caught:
        retry_on_conflict(engine, work)
    assert caught.value.fix == "run the same command again"
    with read_transaction(engine) as connection:
        assert list_objects(connection) == ()


def test_work_that_a_server_does_not_complete_is_no_damage(new_database):
    engine = open_database(new_database("postgresql"))

    def work(connection):
        connection.execute(text("SET LOCAL statement_timeout = 1"))
        connection.execute(text("SELECT pg_sleep(60)"))

    with pytest.raises(DatabaseError, match=r"did not complete .* timeout"):
        retry_on_conflict(engine, work)


def test_no_room_for_a_database_is_no_damage(tmp_path):
    engine = open_database(str(tmp_path / "lab.db"))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, hard))
    try:
        with pytest.raises(DatabaseError, match=r"cannot be read or written|no space") as caught:
            retry_on_conflict(engine, lambda at: register(at, registration("one", placed(at))))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "space" in caught.value.fix
    with read_transaction(engine) as connection:
        assert list_objects(connection) == ()


def test_a_writer_waits_no_longer_than_it_is_told(lab_url):
    engine, hasty = open_database(lab_url), open_database(lab_url, wait_s=0.05)
    with write_transaction(engine):
        with read_transaction(hasty) as connection:  # readers go on
            assert list_objects(connection) == ()
        with (
            pytest.raises(DatabaseError, match="keep the database locked"),
            write_transaction(hasty),
        ):
            pass
    with write_transaction(hasty):
        pass
