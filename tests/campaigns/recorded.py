"""Recordings of every sensor type as MCAP: the same after a round trip, sizes and times.

    python tests/campaigns/recorded.py -o DIR

Encodes a cube, records touches on it by `probe-sensor simulate` with every sensor type, and a scan
with poses; exports each as MCAP, imports that, and compares frames, origin and the bytes of a
second export; also reads the MCAP by rosbags. Sizes in kB, CPU times a thousand frames, beside
HDF5.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader

from encoded_objects.base.sensor_type_file import shipped_names
from probe.recording.mcap import export_mcap, import_mcap
from probe.recording.read import Recording
from probe.recording.record import Recorder

SPEC = "name: Cube\nshape: {cube: 60 mm}\noutput: {lab_key: 0123-4567-89AB-CDER}\n"
TOUCHES, FRAMES = 8, 250


def run(*words: str, folder: Path) -> None:
    """Run a command quietly."""
    subprocess.run(words, cwd=folder, check=True, capture_output=True)


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


def row(name: str, path: Path) -> str:
    """Export and import one recording; return its line of the table."""
    recording, mcap = Recording(path), path.with_suffix(".mcap")
    frames, out_s = timed(lambda: export_mcap(recording, mcap))
    back, in_s = timed(lambda: import_mcap(mcap, path.with_name(f"{name}-back.h5")))
    _, hdf_s = timed(lambda: rewrite(recording, path.with_name(f"{name}-again.h5")))
    again = path.with_name(f"{name}-again.mcap")
    export_mcap(back, again)
    with AnyReader([mcap]) as reader:
        seen = sum(c.topic == "/touch/image" for c, _, _ in reader.messages())
    identical = same(recording, back) and mcap.read_bytes() == again.read_bytes()
    sizes = [one.stat().st_size / 1e3 for one in (path, mcap)]
    per = 1e3 / frames
    return (
        f"| {name} | {frames} | {'yes' if identical and seen == frames else 'NO'} | "
        f"{sizes[0]:.0f} | {sizes[1]:.0f} | {hdf_s * per:.3f} | {out_s * per:.3f} | "
        f"{in_s * per:.3f} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    folder = parser.parse_args().output
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "cube.yaml").write_text(SPEC)
    run("encode-object", "cube.yaml", "--database", "lab.db", "--format", "stl", folder=folder)
    print("| recording | frames | the same | HDF5 kB | MCAP kB | write HDF5 s / 1,000 | export "
          "| import |\n| --- | --- | --- | --- | --- | --- | --- | --- |")  # fmt: skip
    words = ("probe-sensor", "simulate", "lab.db#Cube/F1", "--seed", "1", "-o")
    many = ("--touches", str(TOUCHES), "--frames", str(FRAMES), "--sensor-type")
    for name in shipped_names():
        gel = ("--force", "15", "--x", "30", "--y", "30") if "gel" in name else ()
        run(*words, f"{name}.h5", *many, name, *gel, folder=folder)
        print(row(name, folder / f"{name}.h5"), flush=True)
    scan = ("--scan", "kinesthetic", "--touches", "12", "--frames", "40")
    run(*words, "scan.h5", *scan, folder=folder)
    print(row("scan", folder / "scan.h5"))


if __name__ == "__main__":
    main()
