"""Kill `encode-object` by signal 9 at random moments and look at what is left.

    python tests/campaigns/interrupted.py --engine both --times 100 --seed 1

After every kill no file under its final name differs from the one that an undisturbed run writes,
the database (`--engine`: a SQLite file, a PostgreSQL server, both) opens, holds no cell twice, and
knows the object with all its rows or not at all; one more run makes the same bytes as ever. Exit
code 1 otherwise. Writers, and runs of `validate-set`, that are killed: `tests/loop`.
"""

import hashlib
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import runner
from sqlalchemy import text

from generator.database.open import open_if_there
from generator.database.transaction import read_transaction

SPEC = "name: Cube\nshape: {cube: 60 mm}\noutput: {lab_key: VA11-DATE-0000-0002}\n"
ROWS = ("vertices", "faces", "edges", "placements", "cells", "parts", "provenance")


def begin(folder: Path, url: str) -> list[str]:
    """Write the spec into a new folder; return the command that makes it there."""
    folder.mkdir()
    (folder / "cube.yaml").write_text(SPEC)
    return runner.command(
        "generator", folder / "cube.yaml", "-o", folder / "out", "--database", url
    )


def new_database(folder: Path, server: str) -> str:
    """Return the URL of an empty database: a file in the folder, or a schema on the server."""
    if not server:
        return f"sqlite:///{folder / 'lab.db'}"
    return runner.postgres.new_schema(server, f"lab_{folder.name}")


def digests(folder: Path) -> dict[str, str]:
    files = sorted(p for p in (folder / "out").glob("*") if p.is_file())
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def registered(url: str) -> dict[str, int]:
    """Count the rows of every table; an empty dictionary while there is no object."""
    engine = open_if_there(url, writable=False)
    if engine is None:
        return {}
    count = "select count(*) from {}".format
    with read_transaction(engine) as connection:
        found = {t: connection.execute(text(count(t))).scalar_one() for t in ("objects", *ROWS)}
        cells = connection.execute(text('select array_id, "row", "column" from cells')).all()
    if len(set(cells)) != len(cells):
        found["cells held twice"] = len(cells) - len(set(cells))
    return found if any(found.values()) else {}


def wrong(folder: Path, url: str, truth: dict[str, str], rows: dict[str, int]) -> list[str]:
    """Return what a killed run left that may not be."""
    seen, now = digests(folder), registered(url)
    torn = [name for name, digest in seen.items() if truth.get(name) != digest]
    if now not in ({}, rows):
        torn.append(f"half an object in the database: {now} of {rows}")
    if seen and not now:
        torn.append("files of an object that the database does not know")
    return torn


def kill_encoding(root: Path, server: str, times: int, rng: random.Random) -> list[str]:
    """Kill `encode-object` so often; return what was wrong."""
    reference = root / "reference"
    url = new_database(reference, server)
    command, began = begin(reference, url), time.monotonic()
    subprocess.run(command, check=True, capture_output=True)
    whole = time.monotonic() - began
    truth, rows = digests(reference), registered(url)
    outcome, failures = {"without": 0, "with": 0, "finished": 0}, []
    for i in range(times):
        folder = root / f"{i:03d}"
        url = new_database(folder, server)
        command = begin(folder, url)
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        # Half of the kills fall into the last third, where things are written.
        time.sleep(whole * (rng.uniform(0.6, 1.0) if i % 2 else rng.uniform(0.0, 1.0)))
        process.kill()
        killed = process.wait() == -signal.SIGKILL
        failures += [f"kill {i}: {what}" for what in wrong(folder, url, truth, rows)]
        outcome["finished" if not killed else "with" if registered(url) else "without"] += 1
        again = subprocess.run(command, capture_output=True, text=True, check=False)
        if again.returncode or digests(folder) != truth or registered(url) != rows:
            failures.append(f"kill {i}: the next run did not mend it: {again.stderr}")
        left = [p.name for p in (folder / "out").iterdir() if p.name not in truth]
        failures += [f"kill {i}: {name} stays behind" for name in left]
    print(f"{times} kills over {whole:.2f} s: object in the database after {outcome['with']}, not "
          f"after {outcome['without']}, {outcome['finished']} had finished")  # fmt: skip
    return failures


def main() -> int:
    """Run as the options say."""
    asked = runner.asked(__doc__, engine="sqlite", times=50, seed=1)
    rng, failures = random.Random(asked.seed), []
    with (
        tempfile.TemporaryDirectory(prefix="interrupted-") as name,
        runner.databases(asked.engine) as urls,
    ):
        for engine, url in urls.items():
            print(engine, end=": ", flush=True)
            root = Path(name) / engine
            root.mkdir()
            server = "" if engine == "sqlite" else url
            failures += kill_encoding(root, server, asked.times, rng)
    print("\n  ".join([f"{len(failures)} failures", *failures]))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
