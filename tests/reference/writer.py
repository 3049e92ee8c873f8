"""A writer of objects, for tests that kill it or let it meet another one."""

from __future__ import annotations

import multiprocessing

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

ARRAY = PROFILES["large"].array()
#: Forks of a process that has loaded all: a kill costs no start-up, and nothing open is shared.
FORKS = multiprocessing.get_context("forkserver")
FORKS.set_forkserver_preload(["generator.pipeline"])


def write(url: str, first: int, count: int, symbols: int) -> None:
    """Register cubes "object N", each in a transaction, so many symbols a face.

    On the first cells that are free, as a layout would choose them: a race on purpose.
    """
    for number in range(first, first + count):
        with write_transaction(open_database(url)) as connection:
            rows, columns = occupied_cells(connection, find_array(connection, ARRAY))
            every, taken = np.arange(ARRAY.rows * ARRAY.columns), rows * ARRAY.columns + columns
            free = np.setdiff1d(every, taken)[: 6 * symbols].reshape(6, -1)
            faces = []
            places = zip(*np.divmod(free, ARRAY.columns), strict=True)
            for face, (rows, columns) in enumerate(places):
                centres = np.stack([rows / 7, columns / 3], axis=1)
                labels, place = ARRAY.symbols(rows, columns), Placement(0, 0, 0.0, 0.0, 0.0)
                faces.append(FaceLayout(face, place, rows, columns, labels, centres, 1))
            layout, name = Layout("faces", 7.0, tuple(faces)), f"object {number}"
            register(connection, ObjectRecord(
                name, cube(60.0), layout, ARRAY, "large",
                alphabet_named("dense-4"), SymbolStyle(), {"name": name}, "0",
            ))  # fmt: skip


def started(*told):
    """Start a writer; it has `kill`, `join` and, at its end, an `exitcode`."""
    process = FORKS.Process(target=write, args=told)
    process.start()
    return process


def written(*told):
    """Let a writer write."""
    process = started(*told)
    process.join()
    assert process.exitcode == 0
