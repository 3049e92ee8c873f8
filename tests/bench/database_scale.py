"""How a lab's database bears years of objects: placing, registering, looking up.

    python tests/bench/database_scale.py [--engine sqlite|postgresql] [--fill blocks|placed]
                                         [--objects 10 100 1000 10000 16667]

The array is 4095 x 4097 (GF(4), one of `large` "and up"), the objects are 60 mm cubes of 384
symbols. `blocks` fills it with 8 x 8 cells per face in growing squares: nothing is left
between them, so the search for a free place must look at all of it. `placed` has every
object of a mixture (cubes, boxes, prisms, tetrahedra) found its place by the layout: true
densities, for patient people.

At each number of objects it prints medians of wall time: one more cube placed and registered
by `in_turn` (open, taken cells, layout, rows, commit), also as CPU time of this process (a
server's is its own), reading the taken cells alone, and the object and face of a 3 x 4 window
of cells, on an open connection and with opening it. Density is used cells by those of the
smallest rectangle that holds them, and of the array.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle
from generator.array.profiles import enlarged, profile
from generator.database.cells import faces_at, find_array, occupied
from generator.database.open import open_database
from generator.database.race import in_turn
from generator.database.read import list_objects, read_layout
from generator.database.register import Registration, register
from generator.database.retire import remove
from generator.database.transaction import reading, writing
from generator.layout.layout import lay_out
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.polyhedron import shapes

CUBE = shapes.cube(60.0)
MIXTURE = (
    CUBE,
    shapes.box([60.0, 40.0, 30.0]),
    shapes.triangular_prism(60.0, 45.0),
    shapes.tetrahedron(75.0),
)
STYLE = SymbolStyle()
SIDE = 8  # symbols along an edge of the cube


def array_4095():
    known = profile("large")
    while known.array().rows < 4095:
        known = enlarged(known)
    return known.array()


ARRAY = array_4095()


def laid_out(solid, taken):
    clearances = [[np.full(len(loop), 1.0) for loop in face.loops] for face in solid.faces]
    return lay_out(solid, ARRAY, 7.0, 2.7, clearances, taken, allow_blank_faces=True)


def registration(name, solid, layout):
    return Registration(
        name, solid, layout, ARRAY, "large", alphabet_named("dense-4"), STYLE, {"name": name}, "0"
    )


def spots():
    """Yield block positions (row, column) in growing squares: every cell of a square is used."""
    side = 0
    while True:
        yield from ((k, side) for k in range(side))
        yield from ((side, k) for k in range(side + 1))
        side += 1


def block_layout(where):
    r, c = (index.ravel() for index in np.mgrid[:SIDE, :SIDE])
    centres = np.column_stack([(c + 0.5) * 7.0 + 2.0, -(r + 0.5) * 7.0 + 58.0])
    faces = []
    for face in range(6):
        row, column = (SIDE * k for k in next(where))
        rows, columns = row + r, column + c
        labels = ARRAY.symbols(rows, columns)
        place = Placement(row, column, 0.0, -2.0, -58.0)
        faces.append(FaceLayout(face, place, rows, columns, labels, centres, 30))
    return Layout("faces", 7.0, tuple(faces), (), ())


def fill(engine, have, want, where):
    for first in range(have, want, 100):
        with writing(engine) as connection:
            for number in range(first, min(first + 100, want)):
                layout = block_layout(where)
                register(connection, registration(f"object {number}", CUBE, layout))


def place(url, name, solid):
    """Place and register one object as a command does, the opening of the database included."""

    def work(connection):
        taken = occupied(connection, find_array(connection, ARRAY))
        return register(connection, registration(name, solid, laid_out(solid, taken)))

    return in_turn(open_database(url), work)


def timed(action, times, clock=time.perf_counter):
    """Return the median of the times of a clock, seconds."""
    spent = []
    for number in range(times):
        began = clock()
        action(number)
        spent.append(clock() - began)
    return float(np.median(spent))


def measured(url, objects):
    engine = open_database(url)
    names = [f"next {number}" for number in range(10)]
    placing = timed(lambda k: place(url, names[k], CUBE), 5)
    cpu = timed(lambda k: place(url, names[5 + k], CUBE), 5, time.process_time)
    with writing(engine) as connection:
        for name in names:
            remove(connection, name)
    with reading(engine) as connection:
        array_id = find_array(connection, ARRAY)
        taken = timed(lambda _: occupied(connection, array_id), 3)
        rows, columns = occupied(connection, array_id)
        listing = timed(lambda _: list_objects(connection), 1)
    chance = np.random.default_rng(3)
    window_r, window_c = (index.ravel() for index in np.mgrid[:3, :4])
    corners = chance.integers(0, len(rows), 300)

    def look(connection, k):
        return faces_at(
            connection, array_id, rows[corners[k]] + window_r, columns[corners[k]] + window_c
        )

    def look_opening(k):
        with reading(open_database(url, writable=False)) as connection:
            look(connection, k)

    with reading(engine) as connection:
        looking = timed(lambda k: look(connection, k), len(corners))
        for k in range(20):
            assert look(connection, k)[0][0] > 0
    opening = timed(look_opening, 20)
    used = len(rows)
    corner = used / ((rows.max() + 1) * (columns.max() + 1))
    print(
        f"{objects:8d} {6 * objects:8d} {used:9d} {placing:9.3f} {cpu:9.3f} {1e3 * taken:9.1f} "
        f"{1e3 * looking:9.2f} {1e3 * opening:9.1f} {listing:8.2f} "
        f"{corner:8.3f} {used / (ARRAY.rows * ARRAY.columns):8.3f}",
        flush=True,
    )


def run(url, how, steps):
    engine = open_database(url)
    where, have = spots(), 0
    print(
        f"{'objects':>8} {'faces':>8} {'cells':>9} {'place s':>9} {'CPU s':>9} {'taken ms':>9} "
        f"{'look ms':>9} {'+open ms':>9} {'list s':>8} {'corner':>8} {'array':>8}"
    )
    for want in steps:
        began = time.perf_counter()
        if how == "blocks":
            fill(engine, have, want, where)
        else:
            for number in range(have, want):
                place(url, f"object {number}", MIXTURE[number % len(MIXTURE)])
        if want > have:
            each = (time.perf_counter() - began) / (want - have)
            print(f"  registering {want - have} objects: {1e3 * each:.1f} ms each", flush=True)
        have = want
        measured(url, want)
    with reading(engine) as connection:
        assert len(read_layout(connection, "object 0").faces) >= 4


def main() -> int:
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--engine", choices=("sqlite", "postgresql"), default="sqlite")
    options.add_argument("--fill", choices=("blocks", "placed"), default="blocks")
    options.add_argument("--objects", type=int, nargs="+", default=[10, 167, 1000, 10000, 16667])
    chosen = options.parse_args()
    print(f"{chosen.engine}, fill {chosen.fill}, array {ARRAY.rows} x {ARRAY.columns}")
    if chosen.engine == "sqlite":
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "lab.db"
            run(str(path), chosen.fill, sorted(chosen.objects))
            print(f"{path.stat().st_size / 1e6:.0f} MB")
        return 0
    script = Path(__file__).parents[1] / "postgres.py"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, script, "--durable"], text=True, **pipes) as server:
        run(server.stdout.readline().strip(), chosen.fill, sorted(chosen.objects))
    return 0


if __name__ == "__main__":
    sys.exit(main())
