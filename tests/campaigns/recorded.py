"""Recordings of every sensor type as MCAP: the same after a round trip, sizes and times.

    python tests/campaigns/recorded.py -o DIR

Encodes a cube, records touches on it by `probe-sensor simulate` with every sensor type, and a scan
with poses; exports each as MCAP, imports that, and compares frames, origin and the bytes of a
second export; also reads the MCAP by rosbags. Sizes in kB, CPU times a thousand frames, beside
HDF5.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import runner
from rosbags.highlevel import AnyReader

from encoded_objects.base.sensor_type_file import shipped_names
from probe.recording.mcap import export_mcap, import_mcap
from probe.recording.read import Recording
from probe.recording.record import Recorder

SPEC = "name: Cube\nshape: {cube: 60 mm}\noutput: {lab_key: 0123-4567-89AB-CDER}\n"
TOUCHES, FRAMES = 8, 250


def timed(what: Callable[[], Any]) -> tuple[Any, float]:
    """Return a result and its CPU seconds."""
    began = time.process_time()
    made = what()
    return made, time.process_time() - began


def equal(a: Any, b: Any) -> bool:
    """Tell whether two data sets, or two that are not there, hold the same."""
    if a is None or b is None:
        return a is b
    return bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))


def same(one: Recording, other: Recording) -> bool:
    """Tell whether two recordings hold the same frames and say the same of their origin."""
    a, b = one.block().datasets(), other.block().datasets()
    plain = ("sensor", "calibration", "units", "sensor_type")
    return (
        a.keys() == b.keys()
        and all(equal(a[n], b[n]) for n in a)
        and all(getattr(one.origin, n) == getattr(other.origin, n) for n in plain)
        and one.origin.more.keys() == other.origin.more.keys()
        and all(np.array_equal(v, other.origin.more[n]) for n, v in one.origin.more.items())
    )


def rewrite(recording: Recording, path: Path) -> None:
    """Write a recording as HDF5 again, frame by frame, as a probe does."""
    origin = recording.origin
    with Recorder(path, sensor=origin.sensor, calibration=origin.calibration) as recorder:
        for frame in recording.frames():
            recorder.append(frame)


def line_of(name: str) -> tuple[object, ...]:
    """Export and import one recording; return its line of the table."""
    path = Path(f"{name}.h5")
    recording, mcap, again = Recording(path), Path(f"{name}.mcap"), Path(f"{name}-again.mcap")
    frames, out_s = timed(lambda: export_mcap(recording, mcap))
    back, in_s = timed(lambda: import_mcap(mcap, Path(f"{name}-back.h5")))
    _, hdf_s = timed(lambda: rewrite(recording, Path(f"{name}-again.h5")))
    export_mcap(back, again)
    with AnyReader([mcap]) as reader:
        seen = sum(c.topic == "/touch/image" for c, _, _ in reader.messages())
    identical = same(recording, back) and mcap.read_bytes() == again.read_bytes()
    sizes = (f"{one.stat().st_size / 1e3:.0f}" for one in (path, mcap))
    times = (1e3 * seconds / frames for seconds in (hdf_s, out_s, in_s))
    return (name, frames, "yes" if identical and seen == frames else "NO", *sizes, *times)


def main() -> None:
    """Print the table."""
    folder = runner.parse(runner.arguments(__doc__, output=True)).output
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    os.chdir(folder)
    Path("cube.yaml").write_text(SPEC)
    runner.run("generator", "cube.yaml", "--database", "lab.db", "--format", "stl")
    runner.table(("recording", "frames", "the same", "HDF5 kB", "MCAP kB", "write HDF5 s / 1,000",
                  "export", "import"))  # fmt: skip
    shots: dict[str, tuple[object, ...]] = {
        name: ("--touches", TOUCHES, "--frames", FRAMES, "--sensor-type", name,
               *(("--force", 15, "--x", 30, "--y", 30) if "gel" in name else ()))
        for name in shipped_names()
    }  # fmt: skip
    shots["scan"] = ("--scan", "kinesthetic", "--touches", 12, "--frames", 40)
    for name, words in shots.items():
        runner.run("probe", "simulate", "lab.db#Cube/F1", "--seed", 1, "-o", f"{name}.h5", *words)
        runner.row(*line_of(name))


if __name__ == "__main__":
    main()
