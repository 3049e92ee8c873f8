"""One sensor among those of its type: what is off in it, before a level says by how much.

SensorType + rng -> SensorCopy, in standard deviations and in orders of failing, so that the same
copy can be had at any level: drawn for every touch, or once for a run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.circuit.fsr import GAIN_S, Fsr, fsr_of
from probe.contact.tips import Tips
from probe.simulate.world.levels import Level

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SensorCopy:
    """What is off in one sensor."""

    gains: Array  #: (rows, columns) standard deviations, as all that follow
    lengths: Array  #: (rows, columns)
    shifts: Array  #: (rows, columns, 2)
    failing: NDArray[np.int64]  #: (rows * columns,) tactels in the order in which they die
    loose: NDArray[np.int64]  #: (rows,) rows in the order in which they come to float

    def tips(self, sensor: SensorType, level: Level, points: int) -> Tips:
        """Return the tips of this copy at a level; a pad has none."""
        if sensor.overlay.kind != "tab":
            return Tips(points=points)
        return Tips(
            points=points,
            dome_mm=level.dome_mm,
            lengths_mm=level.length_mm * self.lengths,
            shifts_mm=level.shift_mm * self.shifts,
        )

    def film(self, sensor: SensorType, level: Level) -> Fsr:
        """Return the law of every tactel of this copy at a level."""
        rows, columns = self.gains.shape
        plain, none = fsr_of(rows, columns), np.zeros((rows, columns))
        dead = self.dead(level) | ~sensor.present()
        hot = np.zeros(dead.size)
        hot[self.failing[dead.size - round(level.hot * dead.size) :]] = GAIN_S * level.hot_n
        return Fsr(
            gain_s=plain.gain_s * np.exp(level.gain * self.gains),
            exponent=level.exponent * sensor.exponent * plain.exponent,
            break_n=plain.break_n,
            preload_n=none,
            series_ohm=none,
            stuck_s=hot.reshape(rows, columns),
            dead=dead,
            hysteresis=level.hysteresis,
        )

    def dead(self, level: Level) -> NDArray[np.bool_]:
        """Return which tactels feel nothing (rows, columns) at a level."""
        dead = np.zeros(self.gains.size, dtype=np.bool_)
        dead[self.failing[: round(level.dead * self.gains.size)]] = True
        return dead.reshape(self.gains.shape)

    def floating_rows(self, level: Level) -> NDArray[np.bool_]:
        """Return which rows float (rows,) at a level."""
        floating = np.zeros(len(self.loose), dtype=np.bool_)
        floating[self.loose[: round(level.floating * len(self.loose))]] = True
        return floating


def draw_copy(sensor: SensorType, rng: np.random.Generator) -> SensorCopy:
    """Draw one sensor."""
    shape = (sensor.rows, sensor.columns)
    return SensorCopy(
        gains=rng.standard_normal(shape),
        lengths=rng.standard_normal(shape),
        shifts=rng.standard_normal((*shape, 2)),
        failing=rng.permutation(sensor.rows * sensor.columns),
        loose=rng.permutation(sensor.rows),
    )
