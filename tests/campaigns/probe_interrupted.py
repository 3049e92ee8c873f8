"""Kill a recording by signal 9 at random moments and look at what is left.

    python tests/campaigns/probe_interrupted.py --times 50 --seed 1

A child records frames, every one made from its number alone, at the rate of the sensor or
as fast as it can, in files that roll over, with or without poses, and tells each frame that
it handed in. After every kill: the recording can be read while it is as it was left; every
frame that is read is the one that was recorded, without a gap; `repair` keeps as many under
the final names; no more frames are missing than came since the last flush; and another
recording can be made beside it. Exit code 1 otherwise.
"""

from __future__ import annotations

import argparse
import io
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from probe.errors import RecordingError
from probe.frame import Frame
from probe.recording.layout import CHUNK
from probe.recording.read import read_frames
from probe.recording.record import Recorder
from probe.recording.repair import repair

WRITER = """
import os, sys, time
from pathlib import Path
sys.path.insert(0, str(Path(sys.argv[1]).parent))
from probe_interrupted import frame
from probe.recording.record import Recorder

path, hz, roll_over_s, poses = sys.argv[2], float(sys.argv[3]), float(sys.argv[4]), sys.argv[5]
with Recorder(path, roll_over_s=roll_over_s) as recorder:
    began = time.monotonic()
    for i in range(1_000_000):
        if hz:
            time.sleep(max(0.0, began + i / hz - time.monotonic()))
        recorder.append(frame(i, poses == "poses"))
        os.write(1, b".")
"""


def frame(i: int, pose: bool) -> Frame:
    """Return the frame of number `i`."""
    rng = np.random.default_rng(i)
    turn = np.eye(4)
    turn[:3, 3] = rng.normal(0, 100, 3)
    counts = rng.integers(0, 1024, (16, 16)).astype(np.uint16)
    wrist = rng.integers(0, 1024, 4).astype(np.uint16)
    return Frame(counts, i * 1_000_000_000 // 220, i, wrist, turn if pose else None)


def good(frames: Iterator[Frame], pose: bool) -> int:
    """Count the frames from the first on that are as they were recorded, or fail."""
    count = 0
    for read in frames:
        true = frame(count, pose)
        whole = (read.seq, read.t_ns) == (true.seq, true.t_ns)
        whole &= bool((read.counts == true.counts).all() and (read.wrist == true.wrist).all())
        whole &= not pose or (read.pose is not None and bool((read.pose == true.pose).all()))
        if not whole:
            raise ValueError(f"frame {count} was read as another one")
        count += 1
    return count


def killed(folder: Path, hz: float, seconds: float, roll_over_s: float, pose: bool) -> int:
    """Record, kill, and return how many frames had been handed in."""
    arguments = [__file__, str(folder / "touch.h5"), str(hz), str(roll_over_s)]
    process = subprocess.Popen(
        [sys.executable, "-c", WRITER, *arguments, "poses" if pose else "plain"],
        stdout=subprocess.PIPE,
    )
    assert isinstance(process.stdout, io.BufferedReader)
    handed = len(process.stdout.read(1))
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        handed += len(process.stdout.read1(65536))
    process.send_signal(signal.SIGKILL)
    handed += len(process.stdout.read())
    process.wait()
    process.stdout.close()
    return handed


def wrong(folder: Path, handed: int, pose: bool) -> tuple[int, list[str]]:
    """Return how many frames were lost, and what is not as it must be."""
    path = folder / "touch.h5"
    try:
        left = good(read_frames(path, live=True), pose)
    except RecordingError as error:
        left = 0
        if "nothing in it has reached the disk" not in str(error):
            return handed, [f"it cannot be read as it was left: {error}"]
    if not left:
        return handed, [] if handed <= CHUNK else [f"nothing of {handed} frames is left"]
    part = folder / "touch.part.h5"
    try:
        lost = repair(part).lost if part.exists() else 0
    except RecordingError as error:
        if "nothing in it has reached the disk" not in str(error):
            return handed, [f"repair: {error}"]
        part.unlink()  # it was killed when it had begun another file
        lost = 0
    try:
        kept = good(read_frames(path), pose)
    except RecordingError as error:
        return handed, [f"after repair: {error}"]
    wrongs = [] if kept == left else [f"repair kept {kept} of {left} frames"]
    wrongs += [f"repair lost {lost}"] if lost else []
    wrongs += [] if handed - kept <= CHUNK else [f"{handed - kept} frames were lost"]
    with Recorder(folder / "next.h5") as recorder:
        recorder.append(frame(0, pose))
    unexpected = [p.name for p in folder.iterdir() if p.name.startswith(".") or ".part" in p.name]
    return handed - kept, wrongs + [f"{name} stays behind" for name in unexpected]


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--times", type=int, default=50)
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args()
    rng = random.Random(chosen.seed)
    lost, total, failures = [], 0, []
    for i in range(chosen.times):
        folder = Path(tempfile.mkdtemp(prefix="probe-interrupted-"))
        try:
            hz, roll_over_s, pose = (220.0, 0.0)[i % 2], rng.choice([0.7, 3.0, 300.0]), i % 3 == 0
            handed = killed(folder, hz, rng.uniform(0.0, 2.0), roll_over_s, pose)
            missing, wrongs = wrong(folder, handed, pose)
        except ValueError as error:
            missing, wrongs = handed, [str(error)]
        finally:
            shutil.rmtree(folder)
        lost.append(missing)
        total += handed
        failures += [f"kill {i}: {what}" for what in wrongs]
    print(f"{chosen.times} kills in {total} frames; lost per kill: median "
          f"{np.median(lost):g}, at most {max(lost)} (a flush every {CHUNK} frames or 1 s); "
          f"{len(failures)} failures")  # fmt: skip
    for failure in failures:
        print("  " + failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
