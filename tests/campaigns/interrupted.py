"""Kill `encode-object` by signal 9 at random moments and look at what is left.

    python tests/campaigns/interrupted.py --times 50 --seed 1

After every kill: no file under its final name differs from the one that an undisturbed
run writes, the database opens, and it knows the object with all its rows or not at all.
Afterwards one undisturbed run must make the same bytes as ever. Exit code 1 otherwise.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SPEC = "name: Cube\nshape: {cube: 60 mm}\n"
ROWS = ("vertices", "faces", "edges", "placements", "cells", "parts", "provenance")


def command(folder: Path) -> list[str]:
    database = f"sqlite:///{folder / 'lab.db'}"
    entry = "from generator.command import main; main()"
    spec = str(folder / "cube.yaml")
    out = str(folder / "out")
    return [sys.executable, "-c", entry, spec, "-o", out, "--database", database]


def digests(folder: Path) -> dict[str, str]:
    files = sorted(p for p in (folder / "out").glob("*") if p.is_file())
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def registered(folder: Path) -> dict[str, int]:
    """Count the rows of every table; an empty dictionary while there is no object."""
    path = folder / "lab.db"
    if not path.exists() or path.stat().st_size == 0:
        return {}
    with sqlite3.connect(path) as connection:
        tables = {r[0] for r in connection.execute("select name from sqlite_master")}
        if "objects" not in tables or not connection.execute("select 1 from objects").fetchone():
            return {}
        count = "select count(*) from {}".format
        return {table: connection.execute(count(table)).fetchone()[0] for table in ROWS}


def wrong(folder: Path, truth: dict[str, str], rows: dict[str, int]) -> list[str]:
    seen = digests(folder)
    torn = [name for name, digest in seen.items() if truth.get(name) != digest]
    now = registered(folder)
    if now not in ({}, rows):
        torn.append(f"half an object in the database: {now} of {rows}")
    if seen and not now:
        torn.append("files of an object that the database does not know")
    return torn


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--times", type=int, default=50)
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args()
    rng = random.Random(chosen.seed)
    root = Path(tempfile.mkdtemp(prefix="interrupted-"))
    try:
        reference = root / "reference"
        reference.mkdir()
        (reference / "cube.yaml").write_text(SPEC)
        began = time.monotonic()
        subprocess.run(command(reference), check=True, capture_output=True)
        whole = time.monotonic() - began
        truth, rows = digests(reference), registered(reference)
        outcome = {"without": 0, "with": 0, "finished": 0}
        failures: list[str] = []
        for i in range(chosen.times):
            folder = root / f"{i:03d}"
            folder.mkdir()
            (folder / "cube.yaml").write_text(SPEC)
            process = subprocess.Popen(
                command(folder), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            # Half of the kills fall into the last third, where things are written.
            time.sleep(whole * (rng.uniform(0.6, 1.0) if i % 2 else rng.uniform(0.0, 1.0)))
            process.send_signal(signal.SIGKILL)
            killed = process.wait() == -signal.SIGKILL
            failures += [f"kill {i}: {what}" for what in wrong(folder, truth, rows)]
            outcome["finished" if not killed else "with" if registered(folder) else "without"] += 1
            again = subprocess.run(command(folder), capture_output=True, text=True, check=False)
            if again.returncode or digests(folder) != truth:
                failures.append(f"kill {i}: the next run did not mend it: {again.stderr}")
            left = [p.name for p in (folder / "out").iterdir() if p.name not in truth]
            failures += [f"kill {i}: {name} stays behind" for name in left]
        print(f"{chosen.times} kills over {whole:.2f} s: object in the database after "
              f"{outcome['with']}, not after {outcome['without']}, "
              f"{outcome['finished']} had finished; {len(failures)} failures")  # fmt: skip
        for failure in failures:
            print("  " + failure)
        return 1 if failures else 0
    finally:
        shutil.rmtree(root)


if __name__ == "__main__":
    sys.exit(main())
