"""How a lab's database bears years of objects: placing, registering, looking up.

    python tests/bench/database_scale.py [--engine sqlite|postgresql|both]
                                         [--objects 2 10 167 1000 10000 16667] [--array 4095]

The array is of `large` "and up", the next object a 60 mm cube of 384 symbols. Such cubes fill it, 8
x 8 cells a face in growing squares, so that the search for a free place must look at all of it. The
same objects are registered on each engine, 100 in a transaction. Medians at each number of objects:
one more cube placed and registered (open, taken cells, layout, rows, commit), wall and CPU time of
this process; the taken cells alone; object and face of a 3 x 4 window, on an open connection and
with opening it.
"""

import itertools
import sys
import time
from pathlib import Path

import numpy as np
from sqlalchemy import func, select

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle
from generator.array.profiles import next_larger, profile
from generator.database import tables
from generator.database.cells import faces_at, find_array, occupancy
from generator.database.open import open_database
from generator.database.read import list_objects
from generator.database.register import ObjectRecord, register, remove
from generator.database.transaction import read_transaction, retry_on_conflict, write_transaction
from generator.layout.layout import lay_out
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.polyhedron import shapes

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

CUBE = shapes.cube(60.0)
STYLE = SymbolStyle()
SIDE = 8  # symbols along an edge of the cube


def array_of(rows):
    """Return the array of `large` and its next sizes with at least `rows` rows."""
    known = profile("large")
    while known.array().rows < rows:
        known = next_larger(known)
    return known.array()


def registration(name, layout, array):
    return ObjectRecord(
        name, CUBE, layout, array, "large", alphabet_named("dense-4"), STYLE, {"name": name}, "0"
    )


def spots():
    """Yield block positions (row, column) in growing squares: every cell of a square is used."""
    for side in itertools.count():
        yield from ((k, side) for k in range(side))
        yield from ((side, k) for k in range(side + 1))


def block_layout(array, where):
    r, c = (index.ravel() for index in np.mgrid[:SIDE, :SIDE])
    centres = np.column_stack([(c + 0.5) * 7.0 + 2.0, -(r + 0.5) * 7.0 + 58.0])
    faces = []
    for face in range(6):
        row, column = (SIDE * k for k in next(where))
        rows, columns = row + r, column + c
        labels = array.symbols(rows, columns)
        place = Placement(row, column, 0.0, -2.0, -58.0)
        faces.append(FaceLayout(face, place, rows, columns, labels, centres, 30))
    return Layout("faces", 7.0, tuple(faces), (), ())


def fill(engines, array, where, have, want):
    """Register more objects, the same on each engine; return the seconds of each."""
    spent = [0.0] * len(engines)
    for first in range(have, want, 100):
        numbers = range(first, min(first + 100, want))
        found = [block_layout(array, where) for _ in numbers]
        for k, engine in enumerate(engines):
            began = time.perf_counter()
            with write_transaction(engine) as connection:
                for number, layout in zip(numbers, found, strict=True):
                    register(connection, registration(f"object {number}", layout, array))
            spent[k] += time.perf_counter() - began
    return spent


def place(url, name, array):
    """Place and register a cube as a command does, the opening of the database included."""

    def work(connection):
        clearances = [[np.full(len(loop), 1.0) for loop in face.loops] for face in CUBE.faces]
        taken = occupancy(connection, array)
        layout = lay_out(CUBE, array, 7.0, 2.7, clearances, taken, allow_blank_faces=True)
        return register(connection, registration(name, layout, array))

    return retry_on_conflict(open_database(url), work)


def timed(action, times):
    """Return the medians of wall and CPU time, seconds."""
    spent = []
    for number in range(times):
        wall, cpu = time.perf_counter(), time.process_time()
        action(number)
        spent.append((time.perf_counter() - wall, time.process_time() - cpu))
    return np.median(spent, axis=0).tolist()


def measured(url, array, objects):
    engine = open_database(url)
    names = [f"next {number}" for number in range(7)]
    placing, cpu = timed(lambda k: place(url, names[k], array), len(names))
    with write_transaction(engine) as connection:
        for name in names:
            remove(connection, name)
    with read_transaction(engine) as connection:
        array_id = find_array(connection, array)
        taken = timed(lambda _: occupancy(connection, array), 3)[0]
        held = occupancy(connection, array)
        listing = timed(lambda _: list_objects(connection), 1)[0]
        faces = connection.execute(select(func.count()).select_from(tables.faces)).scalar_one()
    chance = np.random.default_rng(3)
    window_r, window_c = (index.ravel() for index in np.mgrid[:3, :4])
    rows, columns = held.cells()
    corners = chance.integers(0, len(rows), 300)

    def look(connection, k):
        return faces_at(
            connection, array_id, rows[corners[k]] + window_r, columns[corners[k]] + window_c
        )

    def look_opening(k):
        with read_transaction(open_database(url, writable=False)) as connection:
            look(connection, k)

    with read_transaction(engine) as connection:
        looking = timed(lambda k: look(connection, k), len(corners))[0]
        for k in range(20):
            assert look(connection, k)[0][0] > 0
    opening = timed(look_opening, 20)[0]
    runner.row(engine.dialect.name, objects, faces, held.used, placing, cpu, 1e3 * taken,
               1e3 * looking, 1e3 * opening, listing)  # fmt: skip


def scaled(urls, array, steps):
    engines = [open_database(url) for url in urls]
    where, have = spots(), 0
    runner.table(("engine", "objects", "faces", "cells", "place s", "CPU s", "taken ms", "look ms",
                  "+open ms", "list s"))  # fmt: skip
    for want in steps:
        spent = fill(engines, array, where, have, want)
        each = ", ".join(f"{1e3 * seconds / max(want - have, 1):.1f}" for seconds in spent)
        print(f"  registering {want - have} more objects: {each} ms each", flush=True)
        have = want
        for url in urls:
            measured(url, array, want)


def main() -> None:
    """Print the table."""
    chosen = runner.asked(__doc__, engine="both", array=4095,
                          objects=[2, 10, 167, 1000, 10000, 16667])  # fmt: skip
    array = array_of(chosen.array)
    print(f"array {array.rows} x {array.columns}")
    with runner.databases(chosen.engine, "--durable") as urls:
        scaled(list(urls.values()), array, sorted(chosen.objects))
        if "sqlite" in urls:
            print(f"{Path(urls['sqlite']).stat().st_size / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
