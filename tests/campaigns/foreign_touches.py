"""Frames of pressure arrays that others recorded: how many of them are answered.

    python tests/campaigns/foreign_touches.py DIR --database lab.db
    python tests/campaigns/foreign_touches.py DIR --database lab.db --frames 500 --most 20

DIR holds files or stores that `probe-sensor import` takes, of any shape: each array of images is
read by a reader whose sensor type has that many rows and columns, `fsr-16` else in all but shape.
Nothing in them is of the lab, so every answer is wrong. `--frames` are those of a file, spread over
its length; `--most` files. docs/benchmark.md names sets.
"""

import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import runner

from encoded_objects.base.errors import EncodedObjectsError
from encoded_objects.base.sensor_type import SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from probe.recording.imported import import_array
from probe.recording.mcap import import_mcap
from probe.recording.read import Recording
from probe.recording.zarr import is_store, store_arrays
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader

SUFFIXES = {".npy", ".npz", ".mat", ".h5", ".hdf5", ".csv", ".mcap"}


def sources(folder: Path) -> list[Path]:
    """Return the files and stores of a folder."""
    stores = [
        path.parent for path in folder.rglob(".zgroup") if path.parent.name not in ("data", "meta")
    ]
    files = [path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES]
    return sorted(stores + [one for one in files if not any(s in one.parents for s in stores)])


def sensors_of(path: Path) -> list[tuple[str | None, SensorType]]:
    """Return the arrays of a store, or None for a file, with the sensor types that may fit."""
    known = {sensor_type_named(name).shape: sensor_type_named(name) for name in shipped_names()}
    if not is_store(path):
        return [(None, one) for one in known.values()]
    shapes = [
        (name, array.shape[-2:]) for name, array in store_arrays(path) if len(array.shape) == 3
    ]
    usual = SensorType()
    other = [(n, known.get(s) or replace(usual, rows=s[0], columns=s[1], name=f"{s[0]}x{s[1]}"))
             for n, s in shapes if min(s) > 3 and max(s) < 256]  # fmt: skip
    return list(other)


def recordings(path: Path, folder: Path) -> list[tuple[Recording, SensorType]]:
    """Import a source; each array of images that is one becomes a recording."""
    made, said = [], ""
    for number, (dataset, sensor) in enumerate(sensors_of(path)):
        out = folder / f"{path.stem}-{number}.h5"
        try:
            if path.suffix.lower() == ".mcap":
                made.append((import_mcap(path, out, sensor_type=sensor), sensor))
            else:
                made.append((import_array(path, out, dataset=dataset, sensor_type=sensor), sensor))
        except EncodedObjectsError as error:
            said = str(error)
    if not made:
        print(f"{path.name}: left out, {said}", flush=True)
    return made


def main() -> None:
    """Import, read and count."""
    asked = runner.asked(__doc__, "folder", database="lab.db", frames=200, most=1000)
    lab, total = open_lab(asked.database), Counter()
    runner.table(("file", "shape", "frames", "read", "answered", "reasons"))
    with tempfile.TemporaryDirectory() as folder:
        for path in sources(Path(asked.folder))[: asked.most]:
            for recording, sensor in recordings(path, Path(folder)):
                frames = list(recording.frames())
                some = np.unique(np.linspace(0, len(frames) - 1, asked.frames).astype(int))
                reader = Reader(lab, sensor)
                answers = [reader.read(frames[k].counts) for k in some.tolist()]
                reasons = Counter(answer.reason for answer in answers)
                answered = reasons.pop("", 0)
                total.update(read=len(some), answered=answered)
                shape = f"{sensor.rows} x {sensor.columns}"
                runner.row(path.name, shape, len(frames), len(some), answered, dict(reasons))
    print(f"{total['answered']} of {total['read']} answered; every answer is wrong")


if __name__ == "__main__":
    main()
