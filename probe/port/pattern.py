"""A moving pattern: what a probe in software shows when there is nothing to touch.

Two fingers, round and about three tactels wide, run on circles against each other and press
and release; a row is left in peace, so that turned or mirrored images are seen at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.frame import WRIST, Frame
from probe.port.settings import PORT


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
    turns = 2 * math.pi * np.arange(PORT.pattern_steps) / PORT.pattern_steps
    images = [_image(float(turn), kind) for turn in turns]
    for seq in count():
        image = images[int(seq / rate / PORT.pattern_s * PORT.pattern_steps) % PORT.pattern_steps]
        yield Frame(image, round(seq * 1e9 / rate), seq, _wrist(image))


def _image(phase: float, sensor: SensorType) -> NDArray[np.uint16]:
    y, x = np.mgrid[: sensor.rows, : sensor.columns]
    force = np.zeros(sensor.shape)
    middle_y, middle_x = (sensor.rows - 3) / 2, (sensor.columns - 1) / 2
    way_y, way_x = PORT.way_y * sensor.rows, PORT.way_x * sensor.columns
    for turn, press in ((phase, 0.9), (-phase + math.pi / 3, 0.5)):
        centre = middle_y + way_y * math.sin(turn), middle_x + way_x * math.cos(turn)
        away = (y - centre[0]) ** 2 + (x - centre[1]) ** 2
        force += press * (0.6 + 0.4 * math.sin(2 * turn)) * np.exp(-away / (2 * PORT.finger**2))
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
