"""Writers that are killed or that meet each other: an object is there whole, or not at all."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
import time

import numpy as np
import pytest
from sqlalchemy import text

from generator.database.cells import held_cells, occupied_cells
from generator.database.open import open_database
from generator.database.read import list_objects, read_layout
from generator.database.transaction import read_transaction, write_transaction

# One process loads everything and forks a writer per line that it reads, so that a kill
# costs no start-up. A line: the database, the first and the number of objects, symbols a face.
WRITERS = """
import os, sys
import numpy as np
from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle
from generator.array.profiles import PROFILES
from generator.database.cells import find_array, occupied_cells
from generator.database.open import open_database
from generator.database.register import ObjectRecord, register
from generator.database.transaction import write_transaction
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.polyhedron.shapes import cube

array = PROFILES["large"].array()
solid = cube(60.0)

def write(url, name, symbols):
    # The first cells that are free, as a layout would choose them: a race on purpose.
    with write_transaction(open_database(url)) as connection:
        taken_rows, taken_columns = occupied_cells(connection, find_array(connection, array))
        taken = taken_rows * array.columns + taken_columns
        free = np.setdiff1d(np.arange(array.rows * array.columns), taken)[: 6 * symbols]
        faces = []
        for face, cells in enumerate(np.split(free, 6)):
            rows, columns = cells // array.columns, cells % array.columns
            centres = np.stack([rows / 7, columns / 3], axis=1)
            labels = array.symbols(rows, columns)
            placement = Placement(0, 0, 0.0, 0.0, 0.0)
            faces.append(FaceLayout(face, placement, rows, columns, labels, centres, 1))
        register(connection, ObjectRecord(
            name, solid, Layout("faces", 7.0, tuple(faces)), array, "large",
            alphabet_named("dense-4"), SymbolStyle(), {"name": name}, "0"))

print("ready", flush=True)
while line := sys.stdin.readline():
    url, *numbers = line.split()
    first, count, symbols = map(int, numbers)
    writer = os.fork()
    if writer == 0:
        for number in range(first, first + count):
            write(url, f"object {number}", symbols)
        os._exit(0)
    print(writer, flush=True)
    sys.stdin.readline()  # until asked, an ended writer keeps its number
    _, status = os.waitpid(writer, 0)
    print(status, flush=True)
"""


class Writers:
    """A process that forks writers."""

    def __init__(self):
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            [sys.executable, "-c", WRITERS],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment,
        )  # fmt: skip
        assert self.process.stdout.readline() == "ready\n"

    def start(self, url, first, count, symbols):
        self.process.stdin.write(f"{url} {first} {count} {symbols}\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def status(self):
        self.process.stdin.write("status\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def close(self):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait(timeout=30)


@pytest.fixture(scope="module")
def pair():
    both = Writers(), Writers()
    yield both
    for writers in both:
        writers.close()


@pytest.fixture
def writers(pair):
    return pair[0]


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


def test_a_writer_killed_at_any_moment_leaves_all_or_nothing(lab_url, writers):
    symbols = 200  # per face: a transaction long enough to be hit in its middle
    start = time.perf_counter()
    writers.start(lab_url, 0, 1, symbols)
    assert writers.status() == 0
    duration = time.perf_counter() - start
    expected = {"object 0"}
    moments = random.Random(6).sample(range(1000), 10)
    for number, moment in enumerate(moments, start=1):
        writer = writers.start(lab_url, number, 1, symbols)
        time.sleep(duration * 1.1 * moment / 1000)
        os.kill(writer, signal.SIGKILL)
        finished = writers.status() == 0
        found = whole_objects(lab_url)
        assert set(found.values()) <= {6 * symbols}
        new = set(found) - expected
        assert new == {f"object {number}"} if finished else new <= {f"object {number}"}
        assert expected <= set(found)
        expected = set(found)
    # After all that the database takes objects as ever.
    writers.start(lab_url, 99, 1, 10)
    assert writers.status() == 0
    assert "object 99" in whole_objects(lab_url)


@pytest.mark.parametrize("engine", ["sqlite", "postgresql"])
def test_a_kill_while_the_database_is_made_leaves_it_usable(new_database, engine, writers):
    for moment in range(5):
        url = new_database(engine)
        writer = writers.start(url, 0, 1, 1)
        time.sleep(0.004 * moment)
        os.kill(writer, signal.SIGKILL)
        writers.status()
        assert set(whole_objects(url)) <= {"object 0"}


def test_writers_at_once_never_share_a_cell(lab_url, pair):
    for number, writers in enumerate(pair):
        writers.start(lab_url, 100 * number, 6, 30)
    assert [writers.status() for writers in pair] == [0, 0]
    assert len(whole_objects(lab_url)) == 12
    with read_transaction(open_database(lab_url)) as connection:
        cells = held_cells(connection, 1)
    assert len(np.unique(cells[:, :2], axis=0)) == len(cells) == 12 * 6 * 30
