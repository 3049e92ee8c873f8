"""A probe that is not there, in software: touches of a part, or a moving pattern.

The pattern: two fingers, round and about three tactels wide, run on circles against each other and
press and release; a row stays at zero, to show at once turned or mirrored images.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.frame import MOST_HZ, Frame
from probe.port.address import Address, Port, number, refuse_unknown
from probe.port.software import SoftwareProbe
from probe.protocol import IdentPacket

_RATE_HZ = 100.0  #: frames of a simulated probe
_ROUND_S = 4.0  #: one round of the test pattern
_STEPS = 400  #: images of one round
_FINGER = 1.6  #: radius of a finger, tactels
_WAY_X = 5 / 16  #: share of the columns that a finger goes to either side ...
_WAY_Y = 4 / 16  #: ... and of the rows


def open_simulation(address: Address) -> Port:
    """Open a simulated probe; PortError when an option is unknown."""
    rate = number(address, "rate", _RATE_HZ, least=0.1, most=MOST_HZ)
    sensor = choose_sensor_type(address.options.get("sensor_type"), "", None, address.url)
    if address.target:
        from probe.simulate.source import frames_of

        frames = frames_of(address.target, address.options)
    else:
        refuse_unknown(address, ("rate", "sensor_type"))
        frames = moving_pattern(rate, sensor)
    ident = IdentPacket(seq=0, t_us=0, bits=max(sensor.bits, 10), settling_us=0.0, baud=0,
                        name="sim", rows=sensor.rows, columns=sensor.columns)  # fmt: skip
    return SoftwareProbe(address.url, frames, ident)


def moving_pattern(rate: float, sensor: SensorType) -> Iterator[Frame]:
    """Yield the frames of the pattern without end, numbered from 0, `rate` a second."""
    images = [_image(2 * math.pi * step / _STEPS, sensor) for step in range(_STEPS)]
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
    """Return the readings (4,) of the transducers: the mean of each quarter."""
    rows, columns = image.shape[0] // 2, image.shape[1] // 2
    quarters = [image[y, x].mean() for y in (slice(rows), slice(rows, None))
                for x in (slice(columns), slice(columns, None))]  # fmt: skip
    wrist = np.array(quarters).astype(np.uint16)
    wrist.setflags(write=False)
    return wrist
