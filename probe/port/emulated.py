"""The probe's own firmware on an emulated AVR, behind a port like that of a real probe.

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
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from numpy.typing import ArrayLike

from probe.errors import PortError
from probe.firmware.build import LINES_MAX, build_emulator, build_firmware
from probe.firmware.host import Host
from probe.firmware.images import FeltImages

EMULATED_BOARDS = ("uno", "mega")


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
        self._host = Host(command, folder / "log.txt", self.device)

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
            raise PortError(answer, fix="see probe.port.emulated", place=self.device)

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
