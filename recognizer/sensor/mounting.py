"""How a sensor is mounted: a touch whose face and direction are known -> the wiring that fits.

A quarter turn is recognised as well as none, a quarter turn wrong; a mirrored image is recognised
under four flips alike. Only a touch that somebody placed tells them apart: of the eight ways in
which a square image can lie, one shows the named face in the named direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from probe.calibration import Calibration
from recognizer.sensor.wiring import Wiring
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Recognition

#: The eight ways in which a square image can lie, each undone; a matrix that is none has four.
WAYS = (
    (), ("quarter", "quarter"), ("columns",), ("rows",),
    ("quarter",), ("quarter", "quarter", "quarter"), ("transpose",),
    ("transpose", "quarter", "quarter"),
)  # fmt: skip
WORDS = {
    (): "as drawn",
    ("quarter", "quarter"): "half a turn off",
    ("columns",): "with its columns reversed",
    ("rows",): "with its rows reversed",
    ("quarter",): "a quarter turn off",
    ("quarter", "quarter", "quarter"): "a quarter turn off, the other way",
    ("transpose",): "transposed",
    ("transpose", "quarter", "quarter"): "transposed across the other diagonal",
}


@dataclass(frozen=True, slots=True, eq=False)
class FoundMounting:
    """What a placed touch says of the mounting."""

    wiring: Wiring  #: that brings readings back
    answer: Recognition  #: under it
    turn_deg: float  #: by which the touch is off the direction that was asked for

    def __str__(self) -> str:
        words = WORDS[self.wiring.changes]
        step = f"; read with --flip {','.join(self.wiring.changes)}" if self.wiring.changes else ""
        return (
            f"the sensor is mounted {words}: {self.answer.object}/{self.answer.face} at "
            f"({self.answer.x_mm:.1f}, {self.answer.y_mm:.1f}) mm, {self.turn_deg:.0f} degrees "
            f"off the asked direction{step}"
        )


def simplify_turns(wiring: Wiring, shape: tuple[int, int]) -> Wiring:
    """Return the one of the eight ways that does the same; the wiring itself if none does.

    Examples
    --------
    >>> simplify_turns(Wiring(("quarter",) * 5), (16, 16)).changes
    ('quarter',)
    """
    image = np.arange(shape[0] * shape[1]).reshape(shape)
    wanted = wiring.apply(image, 0)
    for way in WAYS if shape[0] == shape[1] else WAYS[:4]:
        if np.array_equal(Wiring(way).apply(image, 0), wanted):
            return Wiring(way)
    return wiring


def find_mounting(
    reader: Reader,
    image: ArrayLike,
    face: tuple[str, str],
    *,
    theta_deg: float = 0.0,
    calibration: Calibration | None = None,
) -> FoundMounting | Recognition:
    """Return how a sensor is mounted; what the touch says as it is, where none of the ways fits.

    Parameters
    ----------
    image
        (rows, columns) readings of a touch placed by hand, within 40 degrees.
    face
        Object and face that was touched.
    theta_deg
        Direction of the sensor's x axis on the face that was asked for.
    """
    readings = np.asarray(image, np.float64)
    square = readings.shape[0] == readings.shape[1]
    plain = reader.read(readings, calibration=calibration)
    found: list[FoundMounting] = []
    for changes in WAYS if square else WAYS[:4]:
        wiring = Wiring(changes)
        answer = plain
        if changes:
            turned = wiring.apply(readings, reader.sensor.full)
            answer = reader.read(turned, calibration=calibration)
        if (answer.object, answer.face) == face:
            turn = math.remainder(answer.theta_deg - theta_deg, 360.0)
            found.append(FoundMounting(wiring, answer, turn))
    near = [one for one in found if abs(one.turn_deg) < 40.0]
    return min(near, key=lambda one: abs(one.turn_deg)) if near else plain
