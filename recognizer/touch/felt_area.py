"""Where something lies under the sensor, and what lies beyond it. Thesis 6.3.

Signal, and those of touches before -> for points of the sensor's plane, how much a face is to be
expected there: certainly where a touch is loaded, not where none of those that reached there is,
and the less the farther beyond all of them, as the sensor's rim has it. A tilted plate hangs over
parts of the face: what one touch has felt there counts. Sensor frame of the last touch, mm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.around import combine_around, mean_of_strongest
from recognizer.touch.settings import NextSettings
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class EarlierTouch:
    """A touch before, and where."""

    pose: Array  #: (3,) x, y (mm) and turn (rad), in the sensor frame of the last touch
    signal: Signal


@dataclass(frozen=True, slots=True, eq=False)
class PlanePoints:
    """Points of the sensor's plane, as the last touch has them."""

    mm: Array  #: (..., 2)
    under: Flags  #: (...) whether they lie under the sensor
    nearest: tuple[Ints, Ints]  #: row and column (...) of the tactel nearest to each
    away_mm: Array  #: (...) from the sensor's rim


def plane_points(sensor: SensorType, points_mm: Array) -> PlanePoints:
    """Return points (..., 2) of a sensor's plane."""
    half = np.array(sensor.half_mm)
    beyond = np.maximum(np.abs(points_mm) - half, 0.0)
    under = np.asarray((np.abs(points_mm) < half).all(axis=-1))
    inside = np.clip(points_mm, -0.999 * half, 0.999 * half)
    nearest = _tactels(sensor, np.where(under[..., None], points_mm, inside))
    return PlanePoints(points_mm, under, nearest, np.linalg.norm(beyond, axis=-1))


@dataclass(frozen=True, slots=True, eq=False)
class FeltArea:
    """What touches say of where a face is."""

    sensor: SensorType
    loaded: Flags  #: (rows, columns) of the last touch
    earlier: tuple[tuple[Array, Flags], ...]  #: poses (3,) and what was loaded there
    beyond_mm: float  #: `NextSettings.beyond_mm`

    @property
    def share(self) -> float:
        """Return how much of the sensor lies on something."""
        return float(self.loaded.mean())

    def look(self, points: PlanePoints) -> tuple[Array, Flags]:
        """Return how much a face is expected at points (...), 0 ... 1, and which were seen."""
        seen, felt = self._felt(points)
        expected = self.loaded[points.nearest] * np.exp(-points.away_mm / self.beyond_mm)
        return np.where(seen, felt, expected), seen

    def felt(self, points: PlanePoints) -> Flags:
        """Return where among points (...) a face was felt."""
        return self._felt(points)[1]

    def seen(self, points: PlanePoints) -> Flags:
        """Return which points (...) lay under the sensor."""
        return self._felt(points)[0]

    def _felt(self, points: PlanePoints) -> tuple[Flags, Flags]:
        half = np.array(self.sensor.half_mm)
        seen, felt = points.under.copy(), points.under & self.loaded[points.nearest]
        for (x, y, turn), loaded in self.earlier:
            c, s = math.cos(turn), math.sin(turn)
            own = (points.mm - (x, y)) @ np.array([[c, -s], [s, c]])
            under = (np.abs(own) < half).all(axis=-1)
            seen |= under
            felt[under] |= loaded[_tactels(self.sensor, own[under])]
        return seen, felt


def felt_area(
    sensor: SensorType, signal: Signal, earlier: Sequence[EarlierTouch], settings: NextSettings
) -> FeltArea:
    """Return where something lies, as the last touch and those before have it."""
    before = tuple((one.pose, loaded_tactels(one.signal, settings)) for one in earlier)
    return FeltArea(sensor, loaded_tactels(signal, settings), before, settings.beyond_mm)


def loaded_tactels(signal: Signal, settings: NextSettings) -> Flags:
    """Return (rows, columns) where the sensor lies on something, gaps between strokes closed."""
    forces = signal.forces * signal.trust
    least = settings.least_n if signal.newtons else settings.least_counts
    pressed = forces > max(settings.faint * strongest_reading(signal, settings), least)
    reach = settings.gap // 2
    near = combine_around(pressed, reach, np.logical_or)
    return combine_around(near, reach, np.logical_and)


def strongest_reading(signal: Signal, settings: NextSettings) -> float:
    """Return the mean of the strongest readings."""
    return mean_of_strongest(signal.forces * signal.trust, settings.strongest)


def _tactels(sensor: SensorType, points_mm: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of the tactels at points under the sensor."""
    half_x, half_y = sensor.half_mm
    column = np.floor((points_mm[..., 0] + half_x) * sensor.columns / (2 * half_x))
    row = np.floor((half_y - points_mm[..., 1]) * sensor.rows / (2 * half_y))
    return (
        row.astype(np.int64).clip(0, sensor.rows - 1),
        column.astype(np.int64).clip(0, sensor.columns - 1),
    )
