"""How a validation grows: CPU time of a touch against the objects of the database.

    OPENBLAS_NUM_THREADS=1 python tests/bench/validation_growth.py --objects 10 100 1000

Registers 60 mm cubes of 384 symbols in a 4095 x 4097 array (`database_scale.py`, blocks), and
touches faces of them as the database describes them, at level typical. Prints, at each
number of objects: opening the lab and preparing the reader (s CPU), simulating and reading a
touch (ms CPU, medians), touches per second of one core, and how many were right.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from database_scale import array_of, blocks, fill

from generator.database.open import open_database
from recognizer.validation.campaign import Batch, Campaign, Work
from recognizer.validation.encoded_set import set_digest
from recognizer.validation.workers import code_digest, prepare_reader, touch


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objects", type=int, nargs="+", default=[10, 100, 1000, 10_000])
    parser.add_argument("--touches", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(" objects     cells  open s  simulate ms  read ms  touches/s  right of")
    with tempfile.TemporaryDirectory() as folder:
        url = str(Path(folder) / "lab.db")
        engine, array, have = open_database(url), array_of(4095), 0
        objects = blocks(array)
        for want in sorted(options.objects):
            fill([engine], array, objects, have, want)
            have = want
            campaign = Campaign(
                options.touches,
                options.seed,
                (("face", 1.0),),
                (("typical", 1.0),),
                surfaces="database",
            )
            work = Work(campaign, url, set_digest(url), code_digest())
            start = time.process_time()
            reader = prepare_reader(work)
            opened = time.process_time() - start
            found = touch(work, Batch("touches", 0, options.touches))
            drawing, reading = (
                float(np.median([t[name] for t in found.times])) for name in ("drawing", "reading")
            )
            cells = sum(len(encoding.keys) for encoding in reader.lab.arrays)
            right = sum(row["verdict"] == "right" for row in found.rows)
            print(f"{want:8d} {cells:9d} {opened:7.2f} {1e3 * drawing:12.1f} {1e3 * reading:8.1f} "
                  f"{1 / (drawing + reading):10.1f}  {right:5d} {len(found.rows):2d}",
                  flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
