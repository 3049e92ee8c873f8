"""The probe's own firmware on an emulated AVR, behind a serial port like that of a real probe.

    with emulated_probe(tau_us=2.0) as probe:
        probe.show(image_mv)
        client reads probe.url

The processor runs at 16 MHz of real time; its pins select tactels, whose voltages come from
`show`; its serial line is a pseudo-terminal with a name that outlives unplugging. Faults:

===============  =============================================================================
flip N           damages one bit in N of a million bytes from the probe
drop N           loses N of a million bytes
garbage N        puts N random bytes (at most 4096) in between
unplug S         takes port and power away, gives both back after S seconds
reset            resets the processor
tau US           time constant of the multiplexers, us
noise MV         deviation of the noise at the ADC, mV
===============  =============================================================================

The emulator is a process that obeys lines and answers each with one line. It ends with its
standard input, so it cannot outlive the programme that started it. Images stand in a file that it
maps (little endian, the layout of `emulator/images.h`): the writer counts `lock` to an odd number,
writes the image, and counts it to an even one; the emulator takes an image whole at the beginning
of a scan, and notes its number for that scan.
"""

from __future__ import annotations

import json
import os
import select
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.cache import cache_folder
from probe.errors import PortError
from probe.firmware.build import LINES_MAX, build_emulator, build_firmware
from probe.frame import WRIST

EMULATED_BOARDS = ("uno", "mega")
_ANSWER_S = 20.0  #: within which it answers: a busy machine may take its time
_END_S = 5.0  #: within which it ends


@dataclass(frozen=True, slots=True)
class EmulatorStatistics:
    """What the emulator counted since it started."""

    emulated_s: float  #: time of the processor while it had power
    wall_s: float
    worst_lag_s: float  #: of the processor behind real time
    slipped_s: float  #: real time that a busy machine took from the processor
    resets: int  #: the first start counted
    sent: int  #: bytes that the processor sent
    delivered: int  #: bytes that a listener got, damaged ones and garbage too
    unheard: int  #: bytes lost because nobody had the port open
    overrun: int  #: bytes lost because the listener was too slow
    dropped: int  #: bytes lost by fault
    flipped: int  #: bytes damaged by fault
    garbage: int  #: bytes put in between
    garbled: int  #: bytes damaged because the listener had set another speed
    received: int  #: bytes from the listener


class EmulatedProbe:
    """A running emulation; made by `emulated_probe`."""

    def __init__(self, folder: Path, command: list[str], baud: int) -> None:
        self.baud = baud
        self.device = str(folder / "ttyPROBE")  #: path of the port; a link, gone while unplugged
        images = folder / "images"
        self._images = FeltImages(images)
        command = [*command, "--link", self.device, "--images", str(images)]
        self._host = _Host(command, folder / "log.txt", self.device)

    @property
    def url(self) -> str:
        """The port as a URL."""
        return f"serial://{self.device}?baud={self.baud}"

    def show(self, image_mv: ArrayLike, wrist_mv: ArrayLike | None = None) -> int:
        """Show an image from the next scan on; see `FeltImages.show`."""
        return self._images.show(image_mv, wrist_mv)

    def show_conductances(self, tactels_s: ArrayLike, wrist_mv: ArrayLike | None = None) -> int:
        """Make every tactel a resistor from the next scan on; see `FeltImages`."""
        return self._images.show_conductances(tactels_s, wrist_mv)

    def felt(self, seq: int) -> int:
        """Return the number of the image in frame `seq` since the last reset."""
        return self._images.felt(seq)

    @property
    def scans(self) -> int:
        """Scans begun since the last reset."""
        return self._images.scans

    @property
    def boots(self) -> int:
        """Starts of the processor since the emulation began."""
        return self._images.boots

    def fault(self, command: str) -> None:
        """Make a fault, or end it; the table of the module.

        Raises
        ------
        PortError
            When there is no such fault, or the emulator ended.
        """
        answer = self._host.ask(command)
        if answer != "ok":
            raise PortError(answer, fix="see probe.firmware.emulator", place=self.device)

    def statistics(self) -> EmulatorStatistics:
        """Return what the emulator counted.

        Raises
        ------
        PortError
            When the emulator ended.
        """
        return EmulatorStatistics(**json.loads(self._host.ask("statistics")))

    def end(self) -> None:
        """End the emulation; the port is gone."""
        self._host.end()


@contextmanager
def emulated_probe(
    *,
    baud: int = 1_000_000,
    settle_us: float = 10.0,
    tau_us: float = 1.0,
    noise_mv: float = 0.0,
    seed: int = 0,
    paced: bool = True,
    board: str = "uno",
    adc_divider: int = 16,
    wiring: str = "grounded",
    load_ohm: float = 2200.0,
    shape: tuple[int, int] = (LINES_MAX, LINES_MAX),
    trace: Path | None = None,
) -> Iterator[EmulatedProbe]:
    """Run the firmware on an emulated AVR while the block lasts.

    Firmware and emulator are built on first use, which takes some seconds.

    Parameters
    ----------
    baud, settle_us, adc_divider
        Settings of the firmware, see `build_firmware`.
    tau_us
        Time constant of a tactel's voltage after the multiplexers switch, us.
    noise_mv
        Deviation of the noise at the ADC, mV; 4.88 mV are one count.
    seed
        Of the noise and the faults.
    paced
        At 16 MHz of real time; otherwise as fast as the machine can.
    board
        uno or mega.
    wiring
        Of the rows that are not read: grounded (driven by shift registers) or floating (through a
        multiplexer, as in figure 4.5 of the thesis); virtual: grounded, and the column that is read
        is held at 0 V by an amplifier.
    load_ohm
        From the column that is read to ground, where tactels are shown as conductances;
        virtual: the amplifier's feedback.
    shape
        Rows and columns that the firmware scans; of smaller ones, the first lines of the images.
    trace
        File that gets a line for every change of a port ("cycle port letter value") and
        every conversion ("cycle convert channel").

    Raises
    ------
    PortError
        When a setting is not possible, or a tool or a library is missing.
    """
    if board not in EMULATED_BOARDS:
        raise PortError(
            f"there is no emulated {board!r}", fix=f"take one of {', '.join(EMULATED_BOARDS)}"
        )
    if not (0 <= tau_us <= 1e6 and 0 <= noise_mv <= 5000 and 0 <= seed < 2**64):
        raise PortError(
            f"tau_us {tau_us}, noise_mv {noise_mv} or seed {seed} is out of range",
            fix="take tau_us 0 ... 1e6, noise_mv 0 ... 5000 and a seed of at most 64 bits",
        )
    if not 0 < load_ohm < 1e9:
        raise PortError(f"a load of {load_ohm:g} ohm", fix="give more than 0, say 2200")
    firmware = build_firmware(
        board=board, baud=baud, settle_us=settle_us, adc_divider=adc_divider, wiring=wiring,
        shape=shape,
    )  # fmt: skip
    command = [
        str(build_emulator() / "emulator"), "--board", board,
        "--firmware", str(firmware / "probe.elf"),
        "--wiring", wiring, "--load", repr(float(load_ohm)),
        "--tau", repr(float(tau_us)), "--noise", repr(float(noise_mv)), "--seed", str(seed),
    ]  # fmt: skip
    command += [] if paced else ["--free"]
    command += [] if trace is None else ["--trace", str(trace)]
    with tempfile.TemporaryDirectory(prefix="emulated-probe-") as folder:
        probe = EmulatedProbe(Path(folder), command, baud)
        try:
            yield probe
        finally:
            probe.end()


SENSORS = 8
ROWS, COLUMNS = 16, 16  #: of the boards that the firmware runs on
FULL_MV = 5000.0  #: reference of the ADC
REMEMBERED = 4096  #: scans
_SHAPES = ((ROWS, COLUMNS), (SENSORS, ROWS, COLUMNS))
_MILLIVOLTS, _SIEMENS = 0, 1  # what tactels are given in

_LAYOUT = np.dtype(
    [
        ("magic", "S8"),
        ("version", "<u4"),
        ("lock", "<u4"),
        ("number", "<u4"),
        ("kind", "<u4"),
        ("reserved", "<u4", 10),
        ("tactels", "<f4", (SENSORS, ROWS, COLUMNS)),
        ("wrist_mv", "<f4", WRIST),
        ("boots", "<u4"),
        ("scans", "<u4"),
        ("felt", "<u4", REMEMBERED),
    ]
)


class FeltImages:
    """The file, from the writer's side; may be used by several threads."""

    def __init__(self, path: Path) -> None:
        self._file = np.memmap(path, dtype=_LAYOUT, mode="w+", shape=(1,))
        self._one_writer = threading.Lock()
        self._number = 0
        self._file["magic"] = b"PROBEIMG"
        self._file["version"] = 2
        self._file.flush()

    def show(self, tactels_mv: ArrayLike, wrist_mv: ArrayLike | None = None) -> int:
        """Show an image from the next scan on.

        Parameters
        ----------
        tactels_mv
            (16, 16) for all sensors, or (8, 16, 16), mV; the ADC reads 0 ... 5000.
        wrist_mv
            (4,) mV; as before if not given.

        Returns
        -------
        The image's number, 1 for the first; 0 is the sensor without touch.

        Raises
        ------
        PortError
            When a shape is wrong or a voltage is no number.
        """
        tactels = _voltages(tactels_mv, _SHAPES)
        return self._write(_MILLIVOLTS, tactels, wrist_mv)

    def show_conductances(self, tactels_s: ArrayLike, wrist_mv: ArrayLike | None = None) -> int:
        """Make every tactel a resistor from the next scan on; see `show`.

        Parameters
        ----------
        tactels_s
            (16, 16) for all sensors, or (8, 16, 16), S, 0 or more.

        Raises
        ------
        PortError
            When a shape is wrong or a value is no conductance.
        """
        tactels = np.asarray(tactels_s, dtype=np.float64)
        if tactels.shape not in _SHAPES or not (np.isfinite(tactels) & (tactels >= 0)).all():
            raise PortError(
                f"conductances of shape {tactels.shape}, or below 0, or no numbers",
                fix=f"give siemens, {' or '.join(str(shape) for shape in _SHAPES)}",
            )
        return self._write(_SIEMENS, tactels.astype(np.float32), wrist_mv)

    def _write(self, kind: int, tactels: NDArray[np.float32], wrist_mv: ArrayLike | None) -> int:
        wrist = None if wrist_mv is None else _voltages(wrist_mv, ((WRIST,),))
        with self._one_writer:
            self._number += 1
            self._file["lock"] += 1
            self._file["number"] = self._number
            self._file["kind"] = kind
            self._file["tactels"] = tactels
            if wrist is not None:
                self._file["wrist_mv"] = wrist
            self._file["lock"] += 1
            return self._number

    def felt(self, seq: int) -> int:
        """Return the number of the image in frame `seq` since the last reset.

        Parameters
        ----------
        seq
            Number of the frame, as sent or unwrapped; one of the last 4096.
        """
        return int(self._file["felt"][0, seq % REMEMBERED])

    @property
    def scans(self) -> int:
        """Scans begun since the last reset."""
        return int(self._file["scans"][0])

    @property
    def boots(self) -> int:
        """Resets, the first start counted."""
        return int(self._file["boots"][0])


def _voltages(values: ArrayLike, shapes: tuple[tuple[int, ...], ...]) -> NDArray[np.float32]:
    voltages = np.asarray(values, dtype=np.float64)
    if voltages.shape not in shapes:
        raise PortError(
            f"the voltages have shape {voltages.shape}",
            fix=f"give {' or '.join(str(shape) for shape in shapes)}",
        )
    if not (np.abs(voltages) <= 2 * FULL_MV).all():
        raise PortError(
            f"a voltage is no number, or above {2 * FULL_MV:g} mV",
            fix=f"give millivolts; the ADC reads 0 ... {FULL_MV:g}",
        )
    return voltages.astype(np.float32)


_SHOWN = 500  # characters of its log


class _Host:
    """A started emulator.

    Parameters
    ----------
    command
        Programme and arguments.
    log
        File for its messages.
    place
        Named in errors: the port that it offers.

    Raises
    ------
    PortError
        When it does not start.
    """

    def __init__(self, command: Sequence[str], log: Path, place: str) -> None:
        self._log = log
        self._place = place
        self._heard = b""
        self._process = _start_process(command, log)
        try:
            if self._answer() != "ready":
                raise self._ended()
        except BaseException:
            self.end()
            raise

    def ask(self, command: str) -> str:
        """Send a line and return the answer.

        Raises
        ------
        PortError
            When the emulator ended, or the command is no line.
        """
        assert self._process.stdin is not None
        if "\n" in command:
            raise PortError(f"{command!r} is more than one line", fix="give one command")
        try:
            self._process.stdin.write(command.encode() + b"\n")
        except (OSError, ValueError) as gone:
            raise self._ended() from gone
        return self._answer()

    def end(self) -> None:
        """End the emulator; may be called twice."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def _answer(self) -> str:
        assert self._process.stdout is not None
        descriptor = self._process.stdout.fileno()
        until = time.monotonic() + _ANSWER_S
        while b"\n" not in self._heard:
            ready, _, _ = select.select([descriptor], [], [], max(until - time.monotonic(), 0))
            data = os.read(descriptor, 4096) if ready else b""
            if not data:
                raise self._ended()
            self._heard += data
        line, _, self._heard = self._heard.partition(b"\n")
        return line.decode()

    def _ended(self) -> PortError:
        said = self._log.read_text(errors="replace").strip() if self._log.exists() else ""
        return PortError(
            f"the emulator ended or does not answer: {said[-_SHOWN:] or 'it says nothing'}",
            fix="if libraries of the system changed, remove "
            f"{cache_folder('firmware')}: it is built anew",
            place=self._place,
        )


def _start_process(command: Sequence[str], log: Path) -> subprocess.Popen[bytes]:
    try:
        with log.open("wb") as messages:
            return subprocess.Popen(  # noqa: S603 - our own programme, no shell
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=messages,
                bufsize=0,
                process_group=0,  # an interrupt at the keyboard is for the client
            )
    except OSError as failed:
        raise PortError(
            f"{command[0]} cannot be started: {failed.strerror}",
            fix=f"remove {cache_folder('firmware')}",
        ) from failed
