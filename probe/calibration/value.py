"""A calibration: what a sensor's counts mean. A value; its hash names it in recordings.

    force = break + (conductance / gain)^(1 / exponent)

per tactel, conductance from counts by the board's own equations (`probe.circuit.inverse`);
without a board the counts above the bias stand for the conductance.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.circuit import Electronics
from probe.errors import CalibrationError

Image = NDArray[np.float64]

VERSION = 1  #: of the calibration's content and file
DIGITS = 7  #: significant digits of every number that is kept


class Condition(IntEnum):
    """What is the matter with a tactel; the letter is the file's."""

    SOUND = 0
    DEAD = 1
    STUCK = 2
    PRELOADED = 3
    HIDDEN = 4

    @property
    def letter(self) -> str:
        """One character: . D S P H."""
        return ".DSPH"[self.value]


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The laws of one sensor. Arrays are (rows, columns), rounded, read-only."""

    sensor: str  #: name of the sensor
    made: str  #: when, as the operator wrote it (ISO 8601)
    board: Electronics | None  #: None: counts above the bias stand for the conductance
    full: int  #: highest count of the ADC
    loads: tuple[str, ...]  #: names of the loads, as a record
    condition: NDArray[np.uint8]  #: `Condition` of each tactel
    bias_counts: Image  #: reading at conductance 0
    rest_counts: Image  #: reading without load; above the bias where preloaded or stuck
    noise_counts: Image  #: standard deviation of one frame without load
    gain_s: Image  #: S (or counts) at 1 N above the break force; nan where the tactel is bad
    exponent: Image
    break_n: Image  #: N; negative where preloaded
    covariance: NDArray[
        np.float64
    ]  #: (rows, columns, 6): ln gain, exponent, break; 11 12 13 22 23 33
    most_n: Image  #: N, largest load that took part
    scatter: float  #: root mean square of (read - law) over the errors of the loads
    repeat: float  #: share of a force that hysteresis and creep leave open

    def __post_init__(self) -> None:
        shape = np.shape(self.condition)
        for item in fields(self):
            value = getattr(self, item.name)
            if not isinstance(value, np.ndarray):
                continue
            array = np.array(value, np.uint8 if item.name == "condition" else np.float64)
            if array.shape[:2] != shape or array.ndim != (3 if item.name == "covariance" else 2):
                raise CalibrationError(
                    f"{item.name} has shape {array.shape}, the sensor {shape}",
                    fix="give one value per tactel",
                )
            if item.name != "condition":
                array = round_digits(array)
            array.setflags(write=False)
            object.__setattr__(self, item.name, array)
        for name in ("scatter", "repeat"):
            object.__setattr__(self, name, float(f"{getattr(self, name):.{DIGITS}g}"))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.condition.shape
        return rows, columns

    @property
    def bad(self) -> NDArray[np.bool_]:
        """(rows, columns) tactels that tell no force: dead, stuck or hidden."""
        return ~np.isin(self.condition, (Condition.SOUND, Condition.PRELOADED))


def round_digits(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return values with `DIGITS` significant digits, as the file holds them."""
    flat = [float(f"{v:.{DIGITS}g}") for v in values.ravel()]
    return np.array(flat, dtype=np.float64).reshape(values.shape)
