"""A probe that is not there: a moving pattern or touches of a part, in software or as an AVR.

The pattern: two fingers, round and about three tactels wide, run on circles against each other and
press and release; a row stays at zero, so that turned or mirrored images are seen at once. With
`firmware=avr` the images are voltages at the pins of an emulated ATmega328P that runs the probe's
own firmware, and come back through its serial line.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager
from itertools import count
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import EncodedObjectsError
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.errors import PortError
from probe.frame import WRIST, Frame
from probe.port.address import Address, Port, number, refuse_unknown, split_url
from probe.port.software import SoftwareProbe
from probe.protocol import IdentPacket

if TYPE_CHECKING:
    from probe.firmware.emulator import EmulatedProbe

FULL_MV = 5000.0
_RATE_HZ = 100.0  #: frames of a simulated probe
_ROUND_S = 4.0  #: one round of the test pattern
_STEPS = 400  #: images of one round
_FINGER = 1.6  #: radius of a finger, tactels
_WAY_X = 5 / 16  #: share of the columns that a finger goes to either side ...
_WAY_Y = 4 / 16  #: ... and of the rows


def open_simulation(address: Address) -> Port:
    """Open a simulated probe.

    Raises
    ------
    PortError
        When an option is unknown, or the emulator is not there.
    """
    rate = number(address, "rate", _RATE_HZ, least=0.1)
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
        from probe.firmware.emulator import emulated_probe
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


def moving_pattern(rate: float, sensor: SensorType | None = None) -> Iterator[Frame]:
    """Yield frames without end, numbered from 0.

    Parameters
    ----------
    rate
        Frames a second.
    sensor
        That shows it; `fsr-16` if not given.
    """
    kind = sensor or SensorType()
    turns = 2 * math.pi * np.arange(_STEPS) / _STEPS
    images = [_image(float(turn), kind) for turn in turns]
    for seq in count():
        image = images[int(seq / rate / _ROUND_S * _STEPS) % _STEPS]
        yield Frame(image, round(seq * 1e9 / rate), seq, _wrist(image))


def _image(phase: float, sensor: SensorType) -> NDArray[np.uint16]:
    y, x = np.mgrid[: sensor.rows, : sensor.columns]
    force = np.zeros(sensor.shape)
    middle_y, middle_x = (sensor.rows - 3) / 2, (sensor.columns - 1) / 2
    way_y, way_x = _WAY_Y * sensor.rows, _WAY_X * sensor.columns
    for turn, press in ((phase, 0.9), (-phase + math.pi / 3, 0.5)):
        centre = middle_y + way_y * math.sin(turn), middle_x + way_x * math.cos(turn)
        away = (y - centre[0]) ** 2 + (x - centre[1]) ** 2
        force += press * (0.6 + 0.4 * math.sin(2 * turn)) * np.exp(-away / (2 * _FINGER**2))
    force[-1] = 0
    force[~sensor.present()] = 0
    image = np.round(sensor.full * np.minimum(force, 1)).astype(np.uint16)
    image.setflags(write=False)
    return image


def _wrist(image: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return the readings of the four transducers: the mean of each quarter."""
    rows, columns = image.shape[0] // 2, image.shape[1] // 2
    quarters = [image[y, x].mean() for y in (slice(rows), slice(rows, None))
                for x in (slice(columns), slice(columns, None))]  # fmt: skip
    wrist = np.array(quarters).astype(np.uint16)
    assert wrist.shape == (WRIST,)
    wrist.setflags(write=False)
    return wrist
