"""What the client costs: processor share at 220 frames a second, memory over an hour's frames.

    OMP_NUM_THREADS=1 python tests/bench/probe_client.py --seconds 20 --repeat 3

The source runs in a process of its own and writes to a pseudo-terminal, whole packets or in
pieces of 62 bytes as a USB serial chip hands them over at 2 Mbaud; only the client's process
is measured (processor time by wall time, median of the repeats). Memory: a recording is
replayed as fast as it is read until 792,000 frames (one hour at 220 a second) have come.
"""

from __future__ import annotations

import argparse
import os
import pty
import select
import statistics
import subprocess
import sys
import tempfile
import time
import tty
from itertools import islice
from pathlib import Path

import numpy as np

from probe.client import Client
from probe.frame import frame_from
from probe.port.simulated import moving_pattern
from probe.port.software import SoftwareProbe
from probe.protocol import IdentPacket
from probe.recording.record import Recorder

RATE = 220.0
HOUR = int(RATE * 3600)
BYTE_S = 10 / 2e6  # of one byte at 2 Mbaud; 1 Mbaud carries 187 frames a second
RECORDED = 7920


def source(piece: int) -> None:
    """Be a probe on a pseudo-terminal whose name is printed, until the parent ends."""
    master, slave = pty.openpty()
    tty.setraw(master)
    print(os.ttyname(slave), flush=True)
    probe = SoftwareProbe("pty", moving_pattern(RATE), IdentPacket(0, 0, name="bench"))
    while os.getppid() != 1:
        if select.select([master], [], [], 0)[0]:
            probe.write(os.read(master, 100))
        data = probe.read(0.01)
        began = time.monotonic()
        for i in range(0, len(data), piece):
            os.write(master, data[i : i + piece])
            if piece < len(data):
                time.sleep(max(began + (i + piece) * BYTE_S - time.monotonic(), 0))


def share(piece: int, seconds: float) -> tuple[float, float, float]:
    """Return processor share, frames a second and frames lost."""
    command = [sys.executable, __file__, "--source", str(piece)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            with Client(f"serial://{process.stdout.readline().strip()}") as client:
                frames = client.frames()
                list(islice(frames, 50))
                began, began_cpu = time.monotonic(), time.process_time()
                count = 0
                while (passed := time.monotonic() - began) < seconds:
                    next(frames)
                    count += 1
                cpu = time.process_time() - began_cpu
                seen = client.statistics()
                return cpu / passed, count / passed, seen.lost + seen.failed
        finally:
            process.kill()


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / 1e6


def memory(frames: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "touch.h5"
        with Recorder(path) as recorder:
            for i in range(RECORDED):
                image = rng.integers(0, 1024, (16, 16))
                recorder.append(frame_from(image, t_ns=round(i * 1e9 / RATE), seq=i))
        print("\nframes      resident MB")
        began = time.process_time()
        with Client(f"file:{path}?speed=0&loop=1") as client:
            for i, frame in enumerate(islice(client.frames(), frames)):
                assert frame.seq == i
                if i % (frames // 10) == frames // 20 or i == frames - 1:
                    print(f"{i + 1:9,d}  {resident_mb():11.1f}")
            seen = client.statistics()
        cpu = time.process_time() - began
        print(f"lost {seen.lost}, failed {seen.failed}; {1e6 * cpu / frames:.1f} us a frame of "
              "processor time, reading and packing the file included")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--frames", type=int, default=HOUR, help="of the replay; 0: none")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--source", type=int, metavar="PIECE", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.source is not None:
        source(chosen.source)
        return
    print("written in pieces of    frames/s  lost or failed  processor share")
    for piece in (65536, 62):
        runs = [share(piece, chosen.seconds) for _ in range(chosen.repeat)]
        name = "62 bytes" if piece == 62 else "whole packets"
        middle = statistics.median(cpu for cpu, _, _ in runs)
        rate = statistics.median(rate for _, rate, _ in runs)
        bad = sum(lost for _, _, lost in runs)
        print(f"{name:22s}  {rate:8.1f}  {bad:14d}  {100 * middle:13.2f} %")
    if chosen.frames:
        memory(chosen.frames, chosen.seed)


if __name__ == "__main__":
    main()
