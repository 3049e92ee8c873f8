"""Writers that are killed or that meet each other: an object is there whole, or not at all."""

import random
import sqlite3
import time

import numpy as np
import pytest
from reference.writer import started, written
from sqlalchemy import text

from generator.database.cells import held_cells, occupied_cells
from generator.database.open import open_database
from generator.database.read import list_objects, read_layout
from generator.database.transaction import read_transaction, write_transaction


def whole_objects(url):
    """Check that the database is sound and every object complete; return their symbols."""
    engine = open_database(url)
    with write_transaction(engine):
        pass  # a server ends the turn of a killed writer once it has noticed
    with read_transaction(engine) as connection:
        entries = list_objects(connection)
        for entry in entries:
            layout = read_layout(connection, entry.name)
            assert [len(face.rows) for face in layout.faces] == [entry.symbols // 6] * 6
            assert (entry.number_of_vertices, entry.number_of_faces) == (8, 6)
        orphans = "FROM cells WHERE object_id NOT IN (SELECT object_id FROM provenance)"
        assert connection.execute(text(f"SELECT count(*) {orphans}")).scalar_one() == 0
        cells = held_cells(connection, 1)[:, :2]
        assert np.array_equal(np.stack(occupied_cells(connection, 1), axis=1), cells)
    if "://" not in url:
        plain = sqlite3.connect(url)
        assert plain.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert plain.execute("PRAGMA foreign_key_check").fetchall() == []
        plain.close()
    return {entry.name: entry.symbols for entry in entries}


def test_a_writer_killed_at_any_moment_leaves_all_or_nothing(lab_url):
    symbols = 200  # per face: a transaction long enough to be hit in its middle
    written(lab_url, 0, 1, 1)
    start = time.perf_counter()
    written(lab_url, 1, 1, symbols)
    duration = time.perf_counter() - start
    before = whole_objects(lab_url)
    for number, moment in enumerate(random.Random(6).sample(range(1000), 10), start=2):
        writer = started(lab_url, number, 1, symbols)
        time.sleep(duration * 1.1 * moment / 1000)
        writer.kill()
        writer.join()
        found, name = whole_objects(lab_url), f"object {number}"
        assert found in (before | {name: 6 * symbols}, before)
        assert name in found or writer.exitcode != 0
        before = found
    written(lab_url, 99, 1, 10)  # after all that the database takes objects as ever
    assert "object 99" in whole_objects(lab_url)


@pytest.mark.parametrize("engine", ["sqlite", "postgresql"])
def test_a_kill_while_the_database_is_made_leaves_it_usable(new_database, engine):
    for moment in range(5):
        url = new_database(engine)
        writer = started(url, 0, 1, 1)
        time.sleep(0.004 * moment)
        writer.kill()
        writer.join()
        assert set(whole_objects(url)) <= {"object 0"}


def test_writers_at_once_never_share_a_cell(lab_url):
    writers = [started(lab_url, 100 * number, 6, 30) for number in range(2)]
    for writer in writers:
        writer.join()
    assert [writer.exitcode for writer in writers] == [0, 0]
    assert len(whole_objects(lab_url)) == 12
    with read_transaction(open_database(lab_url)) as connection:
        cells = held_cells(connection, 1)
    assert len(np.unique(cells[:, :2], axis=0)) == len(cells) == 12 * 6 * 30
