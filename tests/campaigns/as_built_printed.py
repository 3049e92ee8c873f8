"""What `as-built` does for poses on printed surfaces: panels of a run of `--surfaces printed`.

    validate-set SPEC.yaml --surfaces printed --faults usual --touches 100 -o RUN
    python tests/campaigns/as_built_printed.py RUN --panels 12

Of each panel: 30 touches to learn from (seed 1), 30 others to judge by (seed 2), all at least
9 mm from the edges. The surface is what the slicer's G-code leaves, which shares no model with
the reader; the true place is counted from the middle of the printed symbols (docs/printed.md).
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

import as_built
import numpy as np
from as_built import summary

from generator.database.open import open_database
from generator.database.read import list_objects
from generator.database.transaction import read_transaction
from probe.errors import SurfaceError
from probe.simulate.printed import printed_scene, read_listing
from probe.simulate.registered import registered_object, registered_objects
from recognizer.as_built.estimate import estimate_print, keep_prints
from recognizer.as_built.touches import WIDE_SCALE, measure_prints
from recognizer.errors import AsBuiltError
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader


def large_faces(database: str, least_mm: float):
    """Yield the first face of each object on which a sensor finds room."""
    for name in sorted(registered_objects(database)):
        for face in registered_object(database, name).faces:
            if face.placement is None:
                continue
            size = np.ptp(face.polygon_mm[0], axis=0)
            if size.min() >= least_mm:
                yield name, face.name
                break


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--database", default="", help="of the run; RUN/lab.db if left out")
    parser.add_argument("--panels", type=int, default=12)
    parser.add_argument("--touches", type=int, default=30)
    parser.add_argument("--level", default="typical")
    options = parser.parse_args()
    database = options.database or str(options.run / "lab.db")
    listing = str(options.run / "printed.json")
    read_listing(listing)
    with read_transaction(open_database(database, writable=False)) as connection:
        numbers = {entry.name: entry.object_id for entry in list_objects(connection)}
    before, after, panels = [], [], 0
    for name, face in large_faces(database, 45.0):
        if panels == options.panels:
            break
        copy = Path(tempfile.mkdtemp()) / "lab.db"
        shutil.copy(database, copy)
        try:
            scene = printed_scene(listing, database, name, face)
        except SurfaceError:
            continue
        reader = Reader(open_lab(copy))
        learn = [
            image for _, image in as_built.touched(scene, reader, 1, options.touches, options.level)
        ]
        judge = list(as_built.touched(scene, reader, 2, options.touches, options.level))
        try:
            felt = measure_prints(Reader(open_lab(copy), options=WIDE_SCALE), learn)
            found = estimate_print(felt, object_id=numbers[name], printer="fdm-0.4")
        except AsBuiltError as error:
            print(f"{name}/{face}: {error}", flush=True)
            continue
        old = as_built.errors_of(reader, judge)
        keep_prints(copy, [found])
        new = as_built.errors_of(Reader(open_lab(copy)), judge)
        panels, before, after = panels + 1, before + old, after + new
        off = f"scale {found.scale_x:.4f} {found.scale_y:.4f}, skew {found.skew_rad:+.4f}"
        print(f"{name}/{face} {off}:\n  {summary(old)}\n  {summary(new)}", flush=True)
    print(f"{panels} panels:\n  before {summary(before)}\n  after  {summary(after)}")


if __name__ == "__main__":
    main()
