"""Eight writers in one database, killed by signal 9 at random: is anything lost or shared?

    python tests/campaigns/database_writers.py [--engine sqlite|postgresql|both] [--seed 1]
                                               [--writers 8] [--objects 100] [--kill-every 0.3]

Each writer places and registers its objects one after another, and acknowledges each after
its commit. Half of them find a place before their turn comes, so that they lose races and must
place anew. A killed writer is started again with what it has not acknowledged. In the end:
no cell is held twice, every object is whole (its layout, faces, edges, provenance), every
acknowledged object stands on the cells that were acknowledged, the bits of taken cells are
those of the cells, and the database is sound. Exit code 1 otherwise.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import select as waiting
import signal
import sqlite3
import sys
import time

import numpy as np
import runner
from sqlalchemy import func, select

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle
from generator.array.profiles import next_larger, profile
from generator.database import tables
from generator.database.cells import find_array, held_cells, occupied_cells
from generator.database.open import open_database
from generator.database.read import find_object, list_objects, read_layout, read_object
from generator.database.register import ObjectRecord, register
from generator.database.transaction import read_transaction, retry_on_conflict
from generator.layout.layout import lay_out
from generator.polyhedron import shapes

ARRAY = next_larger(profile("large")).array()  # 511 x 513
SOLIDS = (shapes.cube(30.0), shapes.box([44.0, 30.0, 23.0]), shapes.tetrahedron(60.0))
STYLE = SymbolStyle()


def laid_out(solid, taken):
    clearances = [[np.full(len(loop), 1.0) for loop in face.loops] for face in solid.faces]
    return lay_out(solid, ARRAY, 7.0, 2.7, clearances, taken, allow_blank_faces=True)


def digest(layout) -> str:
    cells = [(face.face, face.rows.tolist(), face.columns.tolist()) for face in layout.faces]
    return hashlib.sha256(repr(cells).encode()).hexdigest()[:16]


def write(url: str, writer: int, names: list[str], acknowledge: int) -> None:
    """Register objects; one line per committed object: name, digest of its cells, tries."""
    engine = open_database(url)
    for name in names:
        solid = SOLIDS[int(name.split("-")[1]) % len(SOLIDS)]
        early = None
        if writer % 2:  # a place chosen before our turn: somebody may take it meanwhile
            with read_transaction(engine) as connection:
                early = laid_out(solid, occupied_cells(connection, find_array(connection, ARRAY)))
            time.sleep(0.01)
        tries = []

        def work(connection, name=name, solid=solid, early=early, tries=tries):
            tries.append(1)
            if find_object(connection, name) is not None:  # committed, but not acknowledged
                return read_layout(connection, name)
            layout = early if len(tries) == 1 and early is not None else None
            if layout is None:
                layout = laid_out(solid, occupied_cells(connection, find_array(connection, ARRAY)))
            register(connection, ObjectRecord(
                name, solid, layout, ARRAY, "large", alphabet_named("dense-4"), STYLE,
                {"name": name}, "0",
            ))  # fmt: skip
            return layout

        layout = retry_on_conflict(engine, work)
        os.write(acknowledge, f"{name} {digest(layout)} {len(tries)}\n".encode())


class Writer:
    """A process that writes, and what it has acknowledged."""

    def __init__(self, url: str, number: int, names: list[str]) -> None:
        self.url, self.number, self.left = url, number, names
        self.acknowledged: dict[str, str] = {}
        self.lost_races = 0
        self.text = b""
        self.start()

    def start(self) -> None:
        self.pipe, end = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            code = 1
            try:
                write(self.url, self.number, self.left, end)
                code = 0
            finally:
                os._exit(code)
        os.close(end)

    def read(self) -> bool:
        """Take in acknowledgements; False when the process has ended."""
        got = os.read(self.pipe, 65536)
        self.text += got
        *lines, self.text = self.text.split(b"\n")
        for line in lines:
            name, cells, tries = line.decode().split()
            self.acknowledged[name] = cells
            self.left.remove(name)
            self.lost_races += int(tries) - 1
        return bool(got)

    def ended(self) -> int:
        """Return the status of the ended process."""
        os.close(self.pipe)
        self.text = b""
        return os.waitpid(self.pid, 0)[1]


def campaign(url: str, writers: int, objects: int, kill_every: float, chance: random.Random):
    """Run all writers to their end; return them and the number of kills."""
    open_database(url)
    kills = 0
    running = {}
    for number in range(writers):
        names = [f"object-{number * objects + k}" for k in range(objects)]
        writer = Writer(url, number, names)
        running[writer.pipe] = writer
    done = []
    following = time.monotonic() + chance.expovariate(1 / kill_every)
    while running:
        pause = max(0.0, following - time.monotonic())
        for pipe in waiting.select(list(running), [], [], pause)[0]:
            writer = running[pipe]
            if writer.read():
                continue
            del running[pipe]
            status = writer.ended()
            if os.WIFSIGNALED(status):
                writer.start()
                running[writer.pipe] = writer
            elif status:
                raise SystemExit(f"writer {writer.number} failed, see above")
            else:
                done.append(writer)
        if time.monotonic() >= following and running:
            os.kill(chance.choice(list(running.values())).pid, signal.SIGKILL)
            kills += 1
            following = time.monotonic() + chance.expovariate(1 / kill_every)
    return done, kills


def wrong(url: str, acknowledged: dict[str, str]) -> list[str]:
    """Return what is not as it must be."""
    found = []
    engine = open_database(url, writable=False)
    with read_transaction(engine) as connection:
        entries = {entry.name: entry for entry in list_objects(connection)}
        found += [f"{name} is lost" for name in acknowledged if name not in entries]
        for name, entry in entries.items():
            held = read_object(connection, name)
            solid = SOLIDS[int(name.split("-")[1]) % len(SOLIDS)]
            same = held.polyhedron.edges == solid.edges and held.polyhedron.faces == solid.faces
            labels = all(
                np.array_equal(ARRAY.symbols(face.rows, face.columns), face.labels)
                for face in held.layout.faces
            )
            if not same or not labels or len(held.layout.faces) != len(solid.faces):
                found.append(f"{name} is half an object")
            if entry.symbols != sum(len(face.rows) for face in held.layout.faces):
                found.append(f"{name} has other cells than it says")
            if name in acknowledged and digest(held.layout) != acknowledged[name]:
                found.append(f"{name} stands on other cells than acknowledged")
        array_id = find_array(connection, ARRAY)
        cells = held_cells(connection, array_id)
        if len(np.unique(cells[:, :2], axis=0)) != len(cells):
            found.append("a cell is held twice")
        if not np.array_equal(np.stack(occupied_cells(connection, array_id), axis=1), cells[:, :2]):
            found.append("the bits of taken cells are not those of the cells")
        for table in tables.metadata.sorted_tables:
            if "object_id" in table.c:
                strangers = select(func.count()).where(
                    table.c.object_id.not_in(select(tables.provenance.c.object_id))
                )
                if connection.execute(strangers).scalar_one():
                    found.append(f"rows of {table.name} belong to no object")
    if engine.url.get_backend_name() == "sqlite":
        plain = sqlite3.connect(engine.url.database)
        found += [str(r) for r in plain.execute("PRAGMA integrity_check") if r != ("ok",)]
        found += [str(row) for row in plain.execute("PRAGMA foreign_key_check")]
        plain.close()
    return found


def run(name: str, url: str, chosen: argparse.Namespace) -> int:
    """Let the writers write, and print what is wrong afterwards."""
    began = time.monotonic()
    writers, kills = campaign(
        url, chosen.writers, chosen.objects, chosen.kill_every, random.Random(chosen.seed)
    )
    spent = time.monotonic() - began
    acknowledged = {k: v for writer in writers for k, v in writer.acknowledged.items()}
    failures = wrong(url, acknowledged)
    if len(acknowledged) != chosen.writers * chosen.objects:
        failures.append(f"{len(acknowledged)} objects are acknowledged")
    races = sum(writer.lost_races for writer in writers)
    print(f"{name}: {chosen.writers} writers x {chosen.objects} objects in {spent:.0f} s, {kills} "
          f"kills, {races} races lost and placed anew, {len(acknowledged)} acknowledged, "
          f"{len(failures)} failures", *failures[:20], sep="\n  ", flush=True)  # fmt: skip
    return 1 if failures else 0


def main() -> int:
    """Run on each engine; `--kill-every` in seconds on average, `--objects` of each writer."""
    chosen = runner.asked(__doc__, engine="both", seed=1, writers=8, objects=100, kill_every=0.3)
    with runner.databases(chosen.engine) as urls:
        return max(run(name, url, chosen) for name, url in urls.items())


if __name__ == "__main__":
    sys.exit(main())
