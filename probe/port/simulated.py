"""A probe that is not there: a moving pattern or touches of a part, in software or as an AVR.

With `firmware=avr` the images are voltages at the pins of an emulated ATmega328P that runs
the probe's own firmware, and come back through its serial line.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from encoded_objects.base.errors import EncodedObjectsError
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.errors import PortError
from probe.frame import Frame
from probe.port.address import Address, Port, number, refuse_unknown, split_url
from probe.port.pattern import moving_pattern
from probe.port.settings import PORT
from probe.port.software import SoftwareProbe
from probe.protocol import IdentPacket

if TYPE_CHECKING:
    from probe.port.emulated import EmulatedProbe

FULL_MV = 5000.0


def open_simulation(address: Address) -> Port:
    """Open a simulated probe.

    Raises
    ------
    PortError
        When an option is unknown, or the emulator is not there.
    """
    rate = number(address, "rate", PORT.rate_hz, least=0.1)
    firmware = address.options.get("firmware", "")
    if firmware not in ("", "avr"):
        raise PortError(
            f"there is no firmware {firmware!r} to emulate", fix="write firmware=avr",
            place=address.url,
        )  # fmt: skip
    sensor = choose_sensor_type(address.options.get("sensor_type"), "", None, address.url)
    if firmware and sensor.shape != SensorType().shape:
        raise PortError(
            f"the firmware reads {SensorType().rows} x {SensorType().columns} tactels, not "
            f"{sensor.rows} x {sensor.columns}",
            fix="leave firmware=avr out", place=address.url,
        )  # fmt: skip
    frames = _frames(address, rate, sensor)
    if firmware:
        return EmulatedPort(address.url, frames, rate)
    ident = IdentPacket(seq=0, t_us=0, bits=max(sensor.bits, 10), settling_us=0.0, baud=0,
                        name="sim", rows=sensor.rows, columns=sensor.columns)  # fmt: skip
    return SoftwareProbe(address.url, frames, ident)


def _frames(address: Address, rate: float, sensor: SensorType) -> Iterator[Frame]:
    if not address.target:
        refuse_unknown(address, ("rate", "firmware", "sensor_type"))
        return moving_pattern(rate, sensor)
    from probe.simulate.source import frames_of

    options = {k: v for k, v in address.options.items() if k != "firmware"}
    return frames_of(address.target, options)


class EmulatedPort:
    """The serial line of an emulated AVR, and a thread that shows it the images."""

    def __init__(self, url: str, frames: Iterator[Frame], rate: float) -> None:
        from probe.port.emulated import emulated_probe
        from probe.port.serial_line import open_serial

        self._url = url
        self._emulator: AbstractContextManager[EmulatedProbe] = emulated_probe()
        probe = self._emulator.__enter__()
        try:
            self._line = open_serial(split_url(probe.url))
        except PortError:
            self._emulator.__exit__(None, None, None)
            raise
        self._closed = threading.Event()
        self._ended: EOFError | EncodedObjectsError | None = None
        self._shower = threading.Thread(
            target=self._show, args=(probe, frames, 1 / rate), name="images", daemon=True
        )
        self._shower.start()

    @property
    def url(self) -> str:
        """The URL that opens this port again."""
        return self._url

    def read(self, timeout_s: float) -> bytes:
        """Return what the firmware sent; EOFError after the last image."""
        if self._ended is not None:
            raise self._ended
        return self._line.read(timeout_s)

    def write(self, data: bytes) -> None:
        """Send all of `data` to the firmware."""
        self._line.write(data)

    def close(self) -> None:
        """End the emulation."""
        if not self._closed.is_set():
            self._closed.set()
            self._shower.join()
            self._line.close()
            self._emulator.__exit__(None, None, None)

    def _show(self, probe: EmulatedProbe, frames: Iterator[Frame], period_s: float) -> None:
        try:
            for frame in frames:
                probe.show(frame.counts * (FULL_MV / SensorType().full))
                if self._closed.wait(period_s):
                    return
            self._ended = EOFError()
        except EncodedObjectsError as failure:  # of the simulation: the reader shall know
            self._ended = failure
