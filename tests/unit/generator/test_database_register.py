"""Registering and reading back; taken cells as bits; prints as they came out; writers that meet."""

import math
import os
import socket
import sqlite3
from contextlib import closing
from dataclasses import replace

import numpy as np
import psycopg
import pytest
from reference.cells import PLACES, listed
from sqlalchemy import func, select, text

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle
from generator.array.definition import array_from
from generator.array.profiles import PROFILES
from generator.database import tables
from generator.database.as_built import AsBuilt, read_as_built, write_as_built
from generator.database.cells import mark_cells, occupied_cells
from generator.database.open import open_database
from generator.database.read import find_object, list_objects
from generator.database.register import ObjectRecord, register, remove_object
from generator.database.registered import RegisteredPart
from generator.database.rows import face_type
from generator.database.transaction import (
    WriteConflictError,
    read_transaction,
    retry_on_conflict,
    write_transaction,
)
from generator.database.transfer import copy_objects
from generator.errors import DatabaseError
from generator.layout.occupancy import TILE
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.polyhedron.shapes import cube

ARRAY = PROFILES["one-touch"].array()


def layout_from(first, faces=6, symbols=64):
    """Consecutive cells from number `first`; centres that a decimal fraction cannot say."""
    made = []
    for face in range(faces):
        cells = first + face * symbols + np.arange(symbols)
        rows, columns = cells // ARRAY.columns, cells % ARRAY.columns
        placement = Placement(int(rows[0]), int(columns[0]), math.pi / (face + 1), -0.0, 1 / 3)
        labels = ARRAY.symbols(rows, columns)
        centres_mm = np.stack([rows / 7, -columns * 0.0], axis=1)
        made.append(FaceLayout(face, placement, rows, columns, labels, centres_mm, symbols - 3))
    return Layout("faces", 7.0, tuple(made))


def cube_on(first, name="Cube", **changes):
    registration = ObjectRecord(
        name, cube(60.0), layout_from(first), ARRAY, "one-touch", alphabet_named("dense-4"),
        SymbolStyle(), {"name": name, "shape": {"cube": 60.0}, "first": first}, "0.1.0",
        (RegisteredPart("F1", "stl", "cube/F1.stl", "ab" * 32, np.eye(4) / 3),),
    )  # fmt: skip
    return replace(registration, **changes)


def register_one(engine, registration, **options):
    with write_transaction(engine) as connection:
        return register(connection, registration, **options)


@pytest.fixture
def engine(lab_url):
    return open_database(lab_url)


@pytest.fixture
def cube_engine(engine):
    register_one(engine, cube_on(0))
    return engine


def test_an_error_of_the_caller_undoes_everything(engine):
    def interrupted():
        with write_transaction(engine) as connection:
            register(connection, cube_on(0))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    with read_transaction(engine) as connection:
        assert find_object(connection, "Cube") is None


def test_a_spec_keeps_its_cells_and_objects_with_other_windows_stand_on_the_same_ones(cube_engine):
    with pytest.raises(DatabaseError, match="on other cells"):
        register_one(cube_engine, cube_on(0, layout=layout_from(1)))
    # a window changes no symbol, so it must not open the array a second time
    other = array_from(ARRAY.definition() | {"window": [4, 3]})
    assert other.definition() != ARRAY.definition()
    with pytest.raises(DatabaseError, match="another object holds"):
        register_one(cube_engine, cube_on(0, "Other", array=other))


def test_impossible_registrations_are_refused_before_anything_is_written(engine):
    nowhere = layout_from(0)
    nowhere.faces[2].centres_mm[5, 1] = math.nan
    for wrong, said in (
        (cube_on(63 * 65 - 300), "beyond the array"),
        (cube_on(0, layout=nowhere), "no place"),
        (cube_on(0, style=SymbolStyle(pitch_mm=6.0)), "mm"),
    ):
        with pytest.raises(ValueError, match=said):
            register_one(engine, wrong)


def test_face_types():
    turn = np.array([[0.6, -0.8], [0.8, 0.6]]) * 1e3
    for corners, kind in (
        ([(0, 0), (2, 0), (1, 1)], "triangle"),
        ([(0, 0), (2, 0), (2, 2), (0, 2)], "square"),
        ([(0, 0), (3, 0), (3, 2), (0, 2)], "rectangle"),
        ([(0, 0), (2, 0), (3, 1), (1, 1)], "quadrilateral"),
        ([(0, 0), (2, 1), (4, 0), (2, 3)], "quadrilateral"),
        ([(0, 0), (2, 0), (3, 1), (1, 3), (0, 1)], "polygon"),
    ):
        assert face_type([np.array(corners) @ turn]) == kind


def test_the_same_schema_has_the_same_order_on_every_run(tmp_path):
    open_database(str(tmp_path / "lab.db"))
    with closing(sqlite3.connect(tmp_path / "lab.db")) as connection:
        made = connection.execute(
            "SELECT tbl_name, name FROM sqlite_master WHERE type = 'index' AND sql IS NOT NULL"
        ).fetchall()
    of_edges = [name for table, name in made if table == "edges"]
    assert len(of_edges) == 4
    assert of_edges == sorted(of_edges)


# Taken cells: the same ones come back, wherever on the array


def test_cells_come_back_sorted_and_a_block_of_them_is_few_rows(cube_engine):
    block = tuple(index.ravel() for index in np.mgrid[10 : 10 + 4 * TILE, 0 : 4 * TILE])
    for some in (block, *PLACES.values()):
        with write_transaction(cube_engine) as connection:
            mark_cells(connection, 1, (np.arange(384) // 65, np.arange(384) % 65), taken=False)
            mark_cells(connection, 1, some, taken=True)
            assert listed(occupied_cells(connection, 1)) == sorted(listed(some))
            assert listed(occupied_cells(connection, 2)) == []
            rows = connection.execute(select(func.count()).select_from(tables.occupancy))
            assert rows.scalar_one() == 20 or some is not block
            mark_cells(connection, 1, some, taken=False)


# Prints as they came out: kept with their object, printer and material, and gone with it

COVARIANCE = np.diag([1e-8, 2e-8, 3e-8, 1e-4]) + 1e-10
MEASURED = AsBuilt(1, None, "mk4", "PLA", 0.997, 0.1 + 0.2, -0.0, 1.43, COVARIANCE, 25)


def same(one, other):
    fields = [name for name in AsBuilt.__slots__ if name != "covariance"]
    assert [repr(getattr(one, f)) for f in fields] == [repr(getattr(other, f)) for f in fields]
    assert one.covariance.tobytes() == other.covariance.tobytes()


def test_prints_are_read_bit_for_bit_and_go_with_their_object(cube_engine, new_database):
    written = [MEASURED, replace(MEASURED, part="F2"), replace(MEASURED, object_id=None)]
    with write_transaction(cube_engine) as connection:
        for one in written[::-1]:
            write_as_built(connection, one)
        found = (*read_as_built(connection, 1), *read_as_built(connection))
        for one, other in zip(found, written, strict=True):
            same(one, other)
        assert not found[0].covariance.flags.writeable
    other = open_database(new_database("sqlite"))
    with read_transaction(cube_engine) as source, write_transaction(other) as target:
        copy_objects(source, target)
        same(read_as_built(target, 1)[0], MEASURED)
    with write_transaction(cube_engine) as connection:
        remove_object(connection, 1)
        assert read_as_built(connection, 1) == ()
        assert len(read_as_built(connection)) == 1  # those of the printer stay


def test_a_later_measurement_takes_the_place_of_the_same_one_only(cube_engine):
    with write_transaction(cube_engine) as connection:
        write_as_built(connection, MEASURED)
        write_as_built(connection, replace(MEASURED, part="F2"))
        write_as_built(connection, replace(MEASURED, material="PETG", touches=50))
        for changes in ({"printer": "x1"}, {"material": "PETG"}, {}, {"touches": 75}):
            write_as_built(connection, replace(MEASURED, object_id=None, **changes))
        found = (*read_as_built(connection, 1), *read_as_built(connection))
    assert [(one.part, one.printer, one.material, one.touches) for one in found] == [
        (None, "mk4", "PETG", 50),  # a part is printed of one material
        ("F2", "mk4", "PLA", 25),
        (None, "mk4", "PETG", 25),
        (None, "mk4", "PLA", 75),
        (None, "x1", "PLA", 25),
    ]


def test_prints_that_cannot_be_are_refused(cube_engine):
    for changes in (
        {"object_id": 2},
        {"object_id": None, "part": "F1"},
        {"scale_x": 0.0},
        {"scale_y": -1.0},
        {"stroke_mm": 0.0},
        {"touches": 0},
        {"covariance": np.eye(3)},
        {"covariance": np.full((4, 4), np.nan)},
    ):
        with pytest.raises(DatabaseError), write_transaction(cube_engine) as connection:
            write_as_built(connection, replace(MEASURED, **changes))


# Writers that meet: who loses tries again, a bounded number of times, and says so in the end


def test_a_lost_race_leaves_nothing_and_who_always_loses_says_why(cube_engine):
    seen = []

    def work(connection):
        seen.append([entry.name for entry in list_objects(connection)])
        return register(connection, cube_on(0, "Second"))

    with pytest.raises(WriteConflictError, match="another object holds") as caught:
        retry_on_conflict(cube_engine, work, tries=3, rng=np.random.default_rng(1))
    assert seen == [["Cube"]] * 3
    assert caught.value.exit_code == 4
    assert caught.value.fix


def test_errors_that_are_no_race_are_not_tried_again(cube_engine):
    tries = []

    def work(connection):
        tries.append(1)
        return register(connection, cube_on(0, spec={"other": 1}))

    with pytest.raises(DatabaseError, match="another spec"):
        retry_on_conflict(cube_engine, work)
    assert len(tries) == 1


@pytest.mark.parametrize("told", [True, False])
def test_a_connection_that_the_server_ends_is_no_damage(new_database, postgresql_server, told):
    engine = open_database(new_database("postgresql"))

    def work(connection):
        register(connection, cube_on(0))
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


def test_no_room_for_a_database_is_no_damage(tmp_path, room_for):
    engine, said = open_database(str(tmp_path / "lab.db")), "cannot be read or written|no space"
    with room_for(8192), pytest.raises(DatabaseError, match=said) as caught:
        retry_on_conflict(engine, lambda at: register(at, cube_on(0)))
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
