"""What a face promises: the share of its touches that a sensor's reader would answer.

Views of a face + a table of measured answers -> the share of touches that are answered at once,
and within three, each where the answer before says. `answers.json` is that table, measured
(docs/folds.md): flat faces, a sensor of 25.4 mm whose centre lies on the face and whose plate
rests there, 20 to 120 N, symbols of 4.5 to 7 mm. Of that, other sensor types answer a share that
was measured too (`answers_of_types.json`, `tests/campaigns/promised_types.py`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import USUAL_SENSOR, SensorType
from generator.layout.footprint import Points
from generator.layout.views import FaceViews


@dataclass(frozen=True, slots=True)
class PromiseSettings:
    """When a promise is worth a word."""

    low: float = 0.5
    """Share of touches under which a face is named: `validate-set` calls such a face no use."""
    nothing: float = 0.15
    """Under which it is not readable: of seven touches one is answered."""
    one_line: float = 0.7
    """Share of poses that show symbols of one row at most, from which that is the cause: all on
    a bar 12 mm wide (7 mm), 84 % on an L of such bars."""
    tries: int = 150
    """Poses on each face that is tried as a remedy."""
    pitches_mm: tuple[float, ...] = (6.5, 6.0, 5.5, 5.0, 4.5, 4.0)
    """Tried as remedies; the table was measured from 4 to 7 mm."""
    wider: float = 3.0
    """Times the width that is tried at most."""
    thicker_mm: tuple[int, ...] = (2, 3, 4, 5, 6, 8, 10, 12, 15)
    """That bars of faces which are not convex are made wider."""


PROMISE = PromiseSettings()


@dataclass(frozen=True, slots=True)
class AnswerTable:
    """How often a reader answers, measured: pitch x symbols seen whole x loaded share.

    Between its entries it is linear, beyond them constant. What is not answered at once is
    answered by the second or third touch the likelier, the more symbols stand around beside those
    that are seen whole already.
    """

    pitch_mm: tuple[float, ...]  #: rising
    seen: tuple[float, ...]  #: rising
    loaded: tuple[float, ...]  #: rising
    probability: NDArray[np.float64]  #: (pitch, seen, loaded)
    again: tuple[float, float, float]  #: its logit: constant, of log(1 + around), of log(1 + seen)

    def at(self, pitch_mm: float, seen: NDArray[np.int64], loaded: Points) -> Points:
        """Return the probability of an answer at each pose, (P,)."""
        low, high, part = _between(pitch_mm, self.pitch_mm)
        table = self.probability[low] * (1 - part) + self.probability[high] * part
        rows = np.stack([np.interp(loaded, self.loaded, row) for row in table])
        below, above, share = _between(seen, self.seen)
        pose = np.arange(len(seen))
        return np.asarray(rows[below, pose] * (1 - share) + rows[above, pose] * share)

    def later(self, seen: ArrayLike, around: ArrayLike) -> Points:
        """Return the probability that a touch is answered by the third, if not at once, (P,)."""
        seen, around = np.asarray(seen, float), np.asarray(around, float)
        constant, by_around, by_seen = self.again
        logit = constant + by_around * np.log1p(around) + by_seen * np.log1p(seen)
        return np.asarray(np.where(around > 0, 1 / (1 + np.exp(-logit)), 0.0))


@dataclass(frozen=True, slots=True)
class AnsweredShare:
    """How much a sensor type answers of what the usual one would of the same symbols, measured.

    Logistic in the loaded share: larger sensors hang over borders, and membranes of gels bridge
    them.
    """

    across_mm: float  #: of the type, as `SensorType.across_mm`
    symbol_pitch_mm: float  #: that it was measured on
    constant: float
    by_loaded: float

    def at(self, loaded: Points) -> Points:
        """Return the share at each pose, (P,)."""
        return np.asarray(1 / (1 + np.exp(-(self.constant + self.by_loaded * loaded))))


def _between(value: Any, steps: Sequence[float]) -> tuple[Any, Any, Any]:
    """Return the entries around values, and how far each lies from the lower to the upper."""
    place = np.interp(value, steps, np.arange(len(steps)))
    low = np.floor(place).astype(np.int64)
    return low, np.minimum(low + 1, len(steps) - 1), place - low


def promised_shares(
    views: FaceViews, table: AnswerTable, pitch_mm: float, sensor: SensorType = USUAL_SENSOR
) -> tuple[float, float | None]:
    """Return the shares of touches of a face that will be answered at once, and within three.

    The second is known of the usual sensor alone: None of others.

    Parameters
    ----------
    views
        Of the face.
    table
        Measured.
    pitch_mm
        Of its symbols.
    sensor
        That touches it.
    """
    once = answered_at_once(table, pitch_mm, views.seen, views.loaded, sensor)
    if sensor.name != USUAL_SENSOR.name:
        return float(once.mean()), None
    within = once + (1 - once) * table.later(views.seen, views.around)
    return float(once.mean()), float(within.mean())


def answered_share(sensor: SensorType) -> AnsweredShare | None:
    """Return what a sensor type answers of what the usual one would; None of the usual one.

    Of a type that was not measured it is that of the one most like it in size and pitch.
    """
    known = measured_types()
    if sensor.name == USUAL_SENSOR.name or sensor.name in known:
        return known.get(sensor.name)
    nearest = min(known.values(), key=lambda one: _unlike(one, sensor))
    return nearest if _unlike(nearest, sensor) < _unlike(USUAL_SENSOR, sensor) else None


def _unlike(one: AnsweredShare | SensorType, sensor: SensorType) -> float:
    size = one.across_mm / sensor.across_mm
    pitch = one.symbol_pitch_mm / sensor.symbol_pitch_mm
    return math.hypot(math.log(size), math.log(pitch))


def answered_at_once(
    table: AnswerTable,
    pitch_mm: float,
    seen: NDArray[np.int64],
    loaded: Points,
    sensor: SensorType = USUAL_SENSOR,
) -> Points:
    """Return the probability that a sensor's touch is answered at once at each pose, (P,).

    Parameters
    ----------
    table
        Measured with the usual sensor.
    pitch_mm
        Of the symbols.
    seen, loaded
        (P,) symbols seen whole, and the loaded share.
    sensor
        That touches; the table is looked up for the pitch that it meets as the usual one that.
    """
    usual, share = table.at(pitch_mm / sensor.coarseness, seen, loaded), answered_share(sensor)
    return usual if share is None else usual * share.at(loaded)


@lru_cache(maxsize=1)
def measured_types() -> dict[str, AnsweredShare]:
    """Return the shares of the sensor types that were measured, by name."""
    text = (resources.files("generator.layout") / "answers_of_types.json").read_text("utf-8")
    return {
        name: AnsweredShare(one["across_mm"], one["pitch_mm"], *one["logit"])
        for name, one in json.loads(text).items()
    }


@lru_cache(maxsize=1)
def measured_answers() -> AnswerTable:
    """Return the table that was measured with the reader and sensor of this version."""
    text = (resources.files("generator.layout") / "answers.json").read_text(encoding="utf-8")
    values = json.loads(text)
    pitch, seen, loaded = (tuple(values[name]) for name in ("pitch_mm", "seen", "loaded"))
    again = tuple(values["again"])
    return AnswerTable(pitch, seen, loaded, np.array(values["probability"]), again)
