"""Make every fault that a line can have, and look at what the client hands on.

    python tests/campaigns/probe_faults.py --seed 1

The firmware runs on an emulated AVR in real time, the client reads its pseudo-terminal. Every
20 ms the sensor feels another random image; a frame that is none of the last images, to one
count, is wrong. `failed` blocks are no packets, `doubtful` frames had a right check sum but
no agreeing neighbour. `back` is the time from the end of a fault (device plugged in, last
garbage sent, reset, consumer awake) until the next frame is handed on: median and longest, ms;
`pause` the longest time between two frames. Exit code 1 if a frame was wrong or the client
did not come back.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import astuple, dataclass, field

import numpy as np

from probe.client import Client, ClientStatistics
from probe.errors import PortError
from probe.firmware.emulator import EmulatedProbe, emulated_probe
from probe.frame import Frame

SHOWN_S = 0.02
REMEMBERED = 64  # images, more than a second
PATIENCE_S = 10.0


@dataclass
class Watch:
    """Shows images, takes frames, and compares them; in two threads."""

    probe: EmulatedProbe
    rng: np.random.Generator
    shown: deque[np.ndarray] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    arrivals_s: list[float] = field(default_factory=list)
    seqs: list[int] = field(default_factory=list)
    wrong: int = 0
    asleep_s: float = 0.0
    ended: bool = False

    def show(self) -> None:
        while not self.ended:
            self.show_one()
            time.sleep(SHOWN_S)

    def show_one(self) -> None:
        self.shown.append(self.rng.integers(0, 1024, (16, 16)))
        self.probe.show((self.shown[-1] + 0.5) * 5000 / 1024)

    def take(self, client: Client) -> None:
        for frame in client.frames():
            self.arrivals_s.append(time.monotonic())
            self.seqs.append(frame.seq)
            self.wrong += not self.right(frame)
            if self.asleep_s:
                pause_s, self.asleep_s = self.asleep_s, 0.0
                time.sleep(pause_s)

    def right(self, frame: Frame) -> bool:
        images = np.array(list(self.shown))
        return bool((np.abs(images - frame.counts.astype(int)).max(axis=(1, 2)) <= 1).any())

    def back_ms(self, since_s: float, anew: bool = False) -> float:
        """Wait for the first frame after a moment; with `anew` the first of a new start."""
        while time.monotonic() < since_s + PATIENCE_S:
            times, seqs = self.arrivals_s[:], self.seqs
            for i in range(len(times) - 1, 0, -1):
                if anew and times[i] > since_s and seqs[i] < seqs[i - 1]:
                    return 1000 * (times[i] - since_s)
                if times[i] <= since_s:
                    if not anew and i + 1 < len(times):
                        return 1000 * (times[i + 1] - since_s)
                    break
            time.sleep(0.002)
        return float("inf")


Fault = Callable[[Watch], list[float]]


def rate_of(kind: str, ppm: int, seconds: float) -> Fault:
    def fault(watch: Watch) -> list[float]:
        watch.probe.fault(f"{kind} {ppm}")
        time.sleep(seconds)
        watch.probe.fault(f"{kind} 0")
        return [watch.back_ms(time.monotonic())]

    return fault


def garbage(times: int) -> Fault:
    def fault(watch: Watch) -> list[float]:
        back = []
        for n in watch.rng.integers(1, 4097, times):
            watch.probe.fault(f"garbage {n}")
            # It is on the line for 10 us a byte.
            back.append(watch.back_ms(time.monotonic() + n * 1e-5))
            time.sleep(0.1)
        return back

    return fault


def unplug(times: int) -> Fault:
    def fault(watch: Watch) -> list[float]:
        back = []
        for _ in range(times):
            watch.probe.fault("unplug 1")
            back.append(watch.back_ms(time.monotonic() + 1.0, anew=True))
            time.sleep(0.3)
        return back

    return fault


def reset(times: int) -> Fault:
    def fault(watch: Watch) -> list[float]:
        back = []
        for _ in range(times):
            watch.probe.fault("reset")
            back.append(watch.back_ms(time.monotonic(), anew=True))
            time.sleep(0.3)
        return back

    return fault


def slow(watch: Watch) -> list[float]:
    watch.asleep_s = 3.0
    time.sleep(3.0)
    return [watch.back_ms(time.monotonic())]


def second(watch: Watch) -> list[float]:
    for _ in range(50):
        try:
            Client(watch.probe.url).close()
        except PortError:
            time.sleep(0.05)
        else:
            raise SystemExit("a second client was let in")
    return [watch.back_ms(time.monotonic())]


def run(fault: Fault, seed: int, buffer: int) -> tuple[ClientStatistics, int, float, list[float]]:
    with emulated_probe(seed=seed) as probe:
        watch = Watch(probe, np.random.default_rng(seed))
        watch.show_one()  # before the first scan
        with Client(probe.url, buffer=buffer) as client:
            shower = threading.Thread(target=watch.show)
            taker = threading.Thread(target=watch.take, args=(client,))
            shower.start()
            taker.start()
            time.sleep(1.0)
            back = fault(watch)
            seen = client.statistics()
            watch.ended = True
        shower.join()
        taker.join()
    pause_s = float(np.diff(watch.arrivals_s[10:]).max())
    return seen, watch.wrong, 1000 * pause_s, back


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=10.0, help="of flips and of drops")
    parser.add_argument("--times", type=int, default=20, help="of unplugging, garbage, resets")
    chosen = parser.parse_args()
    cases: dict[str, Fault] = {
        f"{name}, {ppm} ppm": rate_of(kind, ppm, chosen.seconds)
        for kind, name in (("flip", "bit flips"), ("drop", "dropped bytes"))
        for ppm in (10, 100, 1000)
    }
    cases |= {
        f"garbage x {chosen.times}": garbage(chosen.times),
        f"unplugged for 1 s x {chosen.times}": unplug(chosen.times),
        f"reset x {chosen.times}": reset(chosen.times),
        "consumer asleep for 3 s": slow,
        "second client x 50": second,
    }
    print(f"{'fault':24s}  frames   rate   lost failed doubtful reboots reopen. overruns  wrong"
          "   back ms (max)  pause ms")  # fmt: skip
    failures = 0
    for name, fault in cases.items():
        seen, wrong, pause_ms, back = run(fault, chosen.seed, 100 if fault is slow else 2048)
        frames, rate, *counts = astuple(seen)
        columns = "{:6d} {:6d} {:8d} {:7d} {:7d} {:8d}".format(*counts)
        print(
            f"{name:24s}  {frames:6d}  {rate:5.0f} {columns} {wrong:6d}  "
            f"{statistics.median(back):6.1f} ({max(back):5.1f})  {pause_ms:8.1f}",
            flush=True,
        )
        failures += wrong + (max(back) == float("inf"))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
