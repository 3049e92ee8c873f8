"""The probe's firmware on an emulated AVR (simavr), behind a pseudo-terminal like a real probe's.

    python tests/reference/emulated_probe.py              # a moving pattern
    python tests/reference/emulated_probe.py 'sim:lab.db#Cube/F1?x=30&y=30' --baud 500000

shows the images of a port to the emulated pins, and prints the URL of its serial line until
Ctrl-C. In a test:

    with emulated_probe(tau_us=2.0) as probe:
        probe.show(image_mv)
        client reads probe.url

Firmware and emulator are built by make on first use, and kept under a name made of sources and
settings. The emulator (`emulator/`, C on libsimavr) obeys lines on its standard input, the faults
among them (`emulator/main.c`), and ends with it. Images pass through a mapped file
(`emulator/images.h`): it takes an image whole at the beginning of a scan, and notes its number.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import select
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from encoded_objects.base.cache import cache_folder
from probe.client import Client
from probe.frame import WRIST

FIRMWARE = Path(__file__).parents[2] / "probe" / "firmware"
EMULATOR = Path(__file__).parent / "emulator"
FULL_MV = 5000.0  #: reference of the ADC
SENSORS, LINES = 8, 16
REMEMBERED = 4096  #: scans
ANSWER_S = 20.0  #: within which it answers: a busy machine may take its time
_MILLIVOLTS, _SIEMENS = 0, 1  # what tactels are given in
_LAYOUT = np.dtype([
    ("magic", "S8"), ("version", "<u4"), ("lock", "<u4"), ("number", "<u4"), ("kind", "<u4"),
    ("reserved", "<u4", 10), ("tactels", "<f4", (SENSORS, LINES, LINES)),
    ("wrist_mv", "<f4", WRIST), ("boots", "<u4"), ("scans", "<u4"), ("seen", "<u4", REMEMBERED),
])  # fmt: skip


def build(sources: Path, *settings: str) -> Path:
    """Make what a folder of sources describes, once for each of its settings."""
    digest = hashlib.sha256(" ".join((platform.machine(), *settings)).encode())
    for source in sorted(path for path in sources.rglob("*") if path.suffix in (".c", ".h", "")):
        digest.update(source.read_bytes() if source.is_file() else b"")
    folder = cache_folder("firmware") / f"{sources.name}-{digest.hexdigest()[:16]}"
    if not folder.is_dir():
        folder.parent.mkdir(parents=True, exist_ok=True)
        fresh = tempfile.mkdtemp(prefix=".building-", dir=folder.parent)
        subprocess.run(["make", "-s", "-C", sources, f"OUT={fresh}", *settings], check=True)
        try:
            os.rename(fresh, folder)
        except OSError:  # another programme built the same meanwhile
            shutil.rmtree(fresh)
    return folder


class EmulatedProbe:
    """A running emulation; see `emulated_probe`."""

    def __init__(self, folder: Path, command: list[str], baud: int) -> None:
        self.device = str(folder / "ttyPROBE")  #: path of the port; a link, gone while unplugged
        self.url = f"serial://{self.device}?baud={baud}"
        images = folder / "images"
        self._file = np.memmap(images, dtype=_LAYOUT, mode="w+", shape=(1,))
        self._file["magic"], self._file["version"] = b"PROBEIMG", 2
        self._file.flush()
        self._turn = threading.Lock()
        self.process = subprocess.Popen(
            [*command, "--link", self.device, "--images", str(images)], bufsize=0,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            process_group=0,  # an interrupt at the keyboard is for the client
        )  # fmt: skip
        assert self._answer() == "ready"

    def show(self, tactels_mv: ArrayLike, wrist_mv: ArrayLike | None = None) -> int:
        """Show an image from the next scan on, and return its number, 1 for the first.

        `tactels_mv` is (16, 16) for all sensors, or (8, 16, 16), mV: the ADC reads 0 ... 5000.
        The wrist (4,), mV, stays as it was if it is not given.
        """
        return self._write(_MILLIVOLTS, tactels_mv, wrist_mv)

    def show_conductances(self, tactels_s: ArrayLike) -> int:
        """Make every tactel a resistor (S) from the next scan on; see `show`."""
        return self._write(_SIEMENS, tactels_s, None)

    def _write(self, kind: int, tactels: ArrayLike, wrist_mv: ArrayLike | None) -> int:
        with self._turn:
            self._file["lock"] += 1  # odd: the image is being written
            self._file["number"] += 1
            self._file["kind"], self._file["tactels"] = kind, tactels
            if wrist_mv is not None:
                self._file["wrist_mv"] = wrist_mv
            self._file["lock"] += 1
            return int(self._file["number"][0])

    def seen(self, seq: int) -> int:
        """Return the number of the image in frame `seq`, one of the last 4096 since the reset."""
        return int(self._file["seen"][0, seq % REMEMBERED])

    def fault(self, command: str) -> None:
        """Make a fault, or end it: flip N, drop N, garbage N, unplug S, reset (`main.c`)."""
        self.process.stdin.write(command.encode() + b"\n")
        assert self._answer() == "ok", command

    def end(self) -> None:
        """End the emulation; the port is gone."""
        self.process.stdin.close()
        try:
            self.process.wait(ANSWER_S)
        finally:
            self.process.kill()
            self.process.wait()
            self.process.stdout.close()

    def _answer(self) -> str:
        said, until_s = b"", time.monotonic() + ANSWER_S
        while not said.endswith(b"\n"):
            ready, _, _ = select.select([self.process.stdout], [], [], until_s - time.monotonic())
            data = self.process.stdout.read(4096) if ready else b""
            if not data:
                raise RuntimeError("the emulator ended, or does not answer")
            said += data
        return said.decode().strip()


@contextmanager
def emulated_probe(
    *,
    baud: int = 1_000_000,
    settle_us: float = 10.0,
    tau_us: float = 1.0,
    noise_mv: float = 0.0,
    paced: bool = True,
    board: str = "uno",
    wiring: str = "grounded",
    load_ohm: float = 2200.0,
    shape: tuple[int, int] = (LINES, LINES),
    trace: Path | None = None,
) -> Iterator[EmulatedProbe]:
    """Run the firmware on an emulated AVR while the block lasts.

    Parameters
    ----------
    baud, settle_us, board, shape
        Settings of the firmware, see `probe/firmware/README.md`; of smaller shapes the first lines.
    tau_us, noise_mv
        Time constant of a tactel's voltage after the multiplexers switch, us; noise at the ADC, mV.
    paced
        At 16 MHz of real time; otherwise as fast as the machine can.
    wiring
        Of the rows that are not read: grounded, floating; virtual: grounded, and the column that is
        read is held at 0 V by an amplifier.
    load_ohm
        From the column that is read to ground; virtual: the amplifier's feedback.
    trace
        File that gets a line for every change of a port ("cycle port letter value") and every
        conversion ("cycle convert channel").
    """
    driven = "floating" if wiring == "floating" else "grounded"
    firmware = build(
        FIRMWARE, f"BOARD={board}", f"BAUD={baud}", f"SETTLE={round(4 * settle_us)}",
        f"WIRING={driven}", f"ROWS={shape[0]}", f"COLUMNS={shape[1]}",
    )  # fmt: skip
    command = [
        str(build(EMULATOR) / "emulator"), "--board", board,
        "--firmware", str(firmware / "probe.elf"), "--wiring", wiring, "--load", str(load_ohm),
        "--tau", str(tau_us), "--noise", str(noise_mv),
        *([] if paced else ["--free"]), *([] if trace is None else ["--trace", str(trace)]),
    ]  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="emulated-probe-") as folder:
        probe = EmulatedProbe(Path(folder), command, baud)
        try:
            yield probe
        finally:
            probe.end()


@contextmanager
def emulated_port(source: str, **settings) -> Iterator[EmulatedProbe]:
    """Run the firmware, and show it the images of a port, of 10 bits each."""
    with emulated_probe(**settings) as probe, Client(source, buffer=1) as client:

        def show() -> None:
            for frame in client.frames():
                probe.show(frame.counts * (FULL_MV / 1023))

        shower = threading.Thread(target=show, name="images", daemon=True)
        shower.start()
        yield probe
        client.close()
        shower.join()


def main() -> None:
    """Run the firmware until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", nargs="?", default="sim:", help="port whose images are shown")
    parser.add_argument("--baud", type=int, default=1_000_000)
    parser.add_argument("--board", choices=("uno", "mega"), default="uno")
    given = parser.parse_args()
    with emulated_port(given.source, baud=given.baud, board=given.board) as probe:
        print(f"serial://{os.path.realpath(probe.device)}?baud={given.baud}", flush=True)
        with suppress(KeyboardInterrupt):
            threading.Event().wait()


if __name__ == "__main__":
    main()
