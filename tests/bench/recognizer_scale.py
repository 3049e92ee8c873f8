"""Reading a touch in databases of 10 ... 100,000 registered faces: time, memory, right answers.

    python tests/bench/recognizer_scale.py [--objects 2 167 1667 16667] [--touches 30]

Databases are filled by `database_scale.py` (cubes in a 4095 x 4097 array), which takes some
minutes for the largest. Process time, median; memory is the peak of a process of its own.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

for library in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(library, "1")
sys.path.insert(0, str(Path(__file__).parent))

import numpy as np  # noqa: E402
from database_scale import fill, spots  # noqa: E402

from generator.database.open import open_database  # noqa: E402


def read(url: str, touches: int, level: str) -> str:
    from recognizer.lab import open_lab
    from recognizer.pipeline import reader_for
    from recognizer.validation.trial import Plan, sensor_of, trial

    start = time.process_time()
    lab = open_lab(url)
    opened = time.process_time() - start
    reader = reader_for(lab, sensor_of("tab"))
    start = time.process_time()
    lab.encodings[0].windows()
    indexed = time.process_time() - start
    found = [trial(Plan(url, 1, level), number, reader) for number in range(touches)]
    counts = Counter(t.verdict for t in found)
    ms = 1e3 * float(np.median([t.seconds for t in found]))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    faces = sum(len(encoding.faces) for encoding in lab.encodings)
    return (
        f"{faces:8,d} {opened:9.2f} {indexed:9.2f} {ms:9.1f} {peak:9.0f} "
        f"{counts['right']:7d} {counts['wrong']:6d} {counts['rejected']:6d}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objects", type=int, nargs="+", default=[2, 167, 1667, 16667])
    parser.add_argument("--touches", type=int, default=30)
    parser.add_argument("--level", default="typical")
    options = parser.parse_args()
    print("   faces    open s   index s  ms/touch   peak MB   right  wrong reject")
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{folder}/lab.db"
        where, have = spots(), 0
        for want in options.objects:
            engine = open_database(url, writable=True)
            fill(engine, have, want, where)
            engine.dispose()
            have = want
            with multiprocessing.get_context("spawn").Pool(1) as alone:
                print(alone.apply(read, (url, options.touches, options.level)), flush=True)


if __name__ == "__main__":
    main()
