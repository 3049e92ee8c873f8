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

from probe.frame import COLUMNS, ROWS, WRIST, Frame
from probe.port.settings import PORT

FULL = 1023


def moving_pattern(rate: float) -> Iterator[Frame]:
    """Yield frames without end, numbered from 0.

    Parameters
    ----------
    rate
        Frames a second.
    """
    images = [_image(2 * math.pi * i / PORT.pattern_steps) for i in range(PORT.pattern_steps)]
    for seq in count():
        image = images[int(seq / rate / PORT.pattern_s * PORT.pattern_steps) % PORT.pattern_steps]
        yield Frame(image, round(seq * 1e9 / rate), seq, _wrist(image))


def _image(phase: float) -> NDArray[np.uint16]:
    y, x = np.mgrid[:ROWS, :COLUMNS]
    force = np.zeros((ROWS, COLUMNS))
    for turn, press in ((phase, 0.9), (-phase + math.pi / 3, 0.5)):
        centre = 6.5 + 4 * math.sin(turn), 7.5 + 5 * math.cos(turn)
        away = (y - centre[0]) ** 2 + (x - centre[1]) ** 2
        force += press * (0.6 + 0.4 * math.sin(2 * turn)) * np.exp(-away / (2 * PORT.finger**2))
    force[-1] = 0
    image = np.round(FULL * np.minimum(force, 1)).astype(np.uint16)
    image.setflags(write=False)
    return image


def _wrist(image: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return the readings of the four transducers: the mean of each quarter."""
    half = ROWS // 2
    quarters = image.reshape(2, half, 2, half).mean(axis=(1, 3)).reshape(WRIST)
    wrist: NDArray[np.uint16] = quarters.astype(np.uint16)
    wrist.setflags(write=False)
    return wrist
