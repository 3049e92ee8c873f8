"""What a recording costs: bytes and CPU time to write it, flush by flush, and to read it.

    OMP_NUM_THREADS=1 python tests/bench/probe_recording.py --frames 6000

Frames as of the measured 16x16 sensor: idle noise of 0.27 counts (sd), 109 of 256 tactels
that respond, a touch every 3 s with 10 counts of noise under it; and, as the worst case,
10 counts of noise on every tactel. Median of several runs, process time.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from probe.frame import Frame
from probe.recording.read import read_frames
from probe.recording.record import Recorder
from probe.recording.table import export_csv

HZ = 220


def touches(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return images (count, 16, 16) as the sensor gives them."""
    rows, columns = np.mgrid[:16, :16]
    live = np.zeros(256, bool)
    live[rng.permutation(256)[:109]] = True
    number = np.arange(count) // (3 * HZ)
    places = rng.uniform(0, 16, (number[-1] + 1, 2))[number]
    press = np.clip(np.sin(2 * np.pi * np.arange(count) / (3 * HZ)) - 0.2, 0, None)
    away = (rows - places[:, :1, None]) ** 2 + (columns - places[:, 1:, None]) ** 2
    touch = 700 * press[:, None, None] * np.exp(-away / 8) * live.reshape(16, 16)
    noise = rng.normal(0, 0.27, touch.shape) + (touch > 20) * rng.normal(0, 10, touch.shape)
    return np.clip(np.rint(rng.integers(0, 40, (16, 16)) + touch + noise), 0, 1023)


def noisy(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return images (count, 16, 16) with noise everywhere."""
    return np.clip(np.rint(rng.normal(300, 10, (count, 16, 16))), 0, 1023)


def spent(action: Callable[[], object]) -> float:
    """Return the process time of an action, ms."""
    began = time.process_time()
    action()
    return 1e3 * (time.process_time() - began)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--frames", type=int, default=6000)
    options.add_argument("--runs", type=int, default=7)
    chosen = options.parse_args()
    wrist = np.zeros(4, np.uint16)
    print(f"{chosen.frames} frames, a flush every 64; for comparison: 1600 kB, 128 ms for 6000")
    print("images      kB   write ms   us a frame   read ms   CSV ms")
    for make in (touches, noisy):
        images = make(chosen.frames, np.random.default_rng(1)).astype(np.uint16)
        frames = [Frame(counts, i * 10**9 // HZ, i, wrist) for i, counts in enumerate(images)]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "touch.h5"

            def record(path: Path = path, frames: list[Frame] = frames) -> None:
                with Recorder(path, replace=True) as recorder:
                    for frame in frames:
                        recorder.append(frame)

            def read(path: Path = path) -> None:
                for _ in read_frames(path):
                    pass

            write_ms = statistics.median(spent(record) for _ in range(chosen.runs))
            read_ms = statistics.median(spent(read) for _ in range(chosen.runs))
            csv_ms = spent(lambda path=path: export_csv(path, path.with_suffix(".csv")))
            size = path.stat().st_size / 1000
        each = 1e3 * write_ms / chosen.frames
        figures = f"{size:6.0f} {write_ms:10.0f} {each:12.1f} {read_ms:9.0f} {csv_ms:8.0f}"
        print(f"{make.__name__:8} {figures}")


if __name__ == "__main__":
    main()
