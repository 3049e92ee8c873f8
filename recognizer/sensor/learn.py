"""Touches of one sensor -> its state.

floating    rows that nothing holds, where touches are recognised only with the network inverted
answering   which tactels answer at all; no touch needs to be recognised for it
tactels     gains and tip places, from what recognised touches leave unexplained
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.calibration import Calibration
from recognizer.sensor.answering import answering_of
from recognizer.sensor.settings import LEARNING, LearningSettings
from recognizer.sensor.tactels import TactelEvidence, evidence_of, with_tactels
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import read_touch
from recognizer.touch.sensor_state import SensorState, invert_floating, unknown_state

Array = NDArray[np.float64]


def learn_sensor(
    reader: Reader,
    images: Sequence[ArrayLike],
    *,
    calibration: Calibration | None = None,
    name: str = "",
    settings: LearningSettings = LEARNING,
    done: Callable[[float], None] | None = None,
) -> SensorState:
    """Return what touches of one sensor tell of it, beside what the reader knows of it.

    Parameters
    ----------
    reader
        Its state is what was known before.
    images
        (rows, columns) readings of each touch: 25 to 100 of different places of registered faces.
    calibration
        Of the sensor, if it has one.
    name
        Of the sensor; the type's if it is not known.
    done
        Is told the share of the work that is done, 0 ... 1.
    """
    newtons = calibration is not None
    known = reader.state or unknown_state(reader.sensor, newtons=newtons, name=name)
    readings = [np.asarray(one, np.float64) for one in images]
    floating = not newtons and (known.floating or _floats(reader, readings, settings))
    inverted = [invert_floating(one) for one in readings] if floating else readings
    before = state = replace(known, floating=False)
    rounds = settings.rounds
    for turn in range(rounds):
        if len(inverted) >= settings.least:
            found = answering_of(_forces(reader, state, inverted, calibration), settings)
            state = replace(state, dead=found.dead, hot=found.hot, offset=found.offset)
        told: list[TactelEvidence] = []
        under = replace(reader, state=state)
        for number, image in enumerate(inverted):
            signal = under.signal(image, calibration=calibration)
            reading = read_touch(under, signal, number)
            answer, best = reading.answer, reading.best
            if answer and best is not None and (answer.margin or 0.0) > settings.margin:
                told.append(evidence_of(best))
            if done is not None:
                done((turn + (number + 1) / len(inverted)) / rounds)
        state = with_tactels(state, told, before)
    return replace(
        state, floating=floating, touches=known.touches + len(images), drift=_drift(readings)
    )


def _floats(reader: Reader, readings: list[Array], settings: LearningSettings) -> bool:
    """Whether touches that are not recognised as they are, are with the network inverted."""
    tried = readings[: settings.tried]
    if sum(bool(reader.read(one)) for one in tried) >= settings.agree:
        return False
    return sum(bool(reader.read(invert_floating(one))) for one in tried) >= settings.agree


def _forces(
    reader: Reader, state: SensorState, readings: list[Array], calibration: Calibration | None
) -> Array:
    """Return forces (n, rows, columns) over the background, all tactels taken as they are."""
    shape, none = state.shape, np.zeros(state.shape)
    plain = replace(state, dead=none > 0, hot=none > 0, offset=none, gain=np.ones(shape))
    under = replace(reader, state=plain)
    return np.array([under.signal(one, calibration=calibration).forces for one in readings])


def _drift(readings: list[Array]) -> float:
    """Return by how much the background rose, from the first third of the touches to the last."""
    third = len(readings) // 3
    if not third:
        return 0.0
    level = [float(np.median(np.sort(one, axis=None)[: one.size // 10])) for one in readings]
    return float(np.median(level[-third:]) - np.median(level[:third]))
