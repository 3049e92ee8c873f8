"""Touches of one sensor -> its state: rows that float, tactels that answer, gains, tip places.

1. A network whose rows nothing holds is found by touches that are recognised only when inverted.
2. Tactels that answer need no recognised touch: over many touches of symbols every tactel is
   pressed about as much as those around it, and is free now and then. One that never rises is
   dead, one that never comes down is hot.
3. Gains and tip places come from recognised touches, which predict every reading. Of one sensor,
   the residual repeats: a share of the reading (gain), and the image's slope times the displacement
   of the tip. Least squares over all touches find both for all tactels at once, with pose, form and
   gain of each touch free; the prior holds where touches say little.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.calibration import Calibration
from recognizer.touch.evidence import VerifiedHypothesis
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import read_touch
from recognizer.touch.sensor_state import (
    ASIDE_SD_MM,
    GAIN_SD,
    SensorState,
    invert_floating,
    unknown_state,
)
from recognizer.touch.symbols.kernels import FIRST_NOISE
from recognizer.touch.symbols.linearize import linearize_image

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Chosen on the levels `dead-20`, `places-08` and `typical` of the own engine, seed 41
LEAST_TOUCHES = 16  #: with which tactels can be compared
AROUND = 7  #: tactels, side of the square that a tactel is compared with
USUAL = 70.0  #: percentile of the square that stands for a sound tactel
ANSWERS = 0.25  #: least rise of a tactel, of that of sound ones around it
ANSWERS_RAISED = 0.6  #: of a tactel that reads high: its column's load moves it as well
HOT = 0.15  #: reading without pressure, of a plateau: more is no background
STRONG = 90.0  #: percentile of an image that stands for its plateau
MARGIN = 20.0  #: nats of an answer that gains and places are learned from
ROUNDS = 2  #: of reading and learning
TRIED = 6  #: touches that are read with the network inverted
AGREE = 3  #: of them that must be answered
FOLDS = 5  #: a touch that was learned from is read by what the other four fifths say


@dataclass(frozen=True, slots=True, eq=False)
class Answering:
    """Which tactels (rows, columns) answer."""

    dead: Flags
    hot: Flags
    offset: Array  #: reading without pressure, over the background; 0 where it is usual


@dataclass(frozen=True, slots=True, eq=False)
class TactelEvidence:
    """What touches say of n tactels: log gain, x and y (mm) of each."""

    normal: Array  #: (3 n, 3 n) inverse covariance
    slope: Array  #: (3 n,) of the log-likelihood

    def __add__(self, other: TactelEvidence) -> TactelEvidence:
        return TactelEvidence(self.normal + other.normal, self.slope + other.slope)


@dataclass(frozen=True, slots=True, eq=False)
class LearnedSensor:
    """The state of a sensor by its touches."""

    state: SensorState
    folds: tuple[SensorState, ...]  #: each by all touches but every `FOLDS`-th

    def without(self, number: int) -> SensorState:
        """Return the state to read touch `number` (0, 1, ...) of those learned from.

        By the state of all of them it would seem to fit too well: of 25 touches read so, 92 % lay
        inside their 95 % ellipsoids, with 1.5 times the squared error that these tell.
        """
        return self.folds[number % FOLDS]


def learn_sensor(
    reader: Reader,
    images: Sequence[ArrayLike],
    *,
    calibration: Calibration | None = None,
    name: str = "",
    done: Callable[[float], None] | None = None,
) -> SensorState:
    """Return the state of a sensor by its touches and the reader's earlier state.

    Read other touches with it; those learned from are read by `learn_folds(...).without(number)`.

    Parameters
    ----------
    images
        (rows, columns) readings of each touch: 25 to 100 of different places of registered faces.
    name
        Of the sensor; the type's if it is not known.
    done
        Gets the share of the work that is done, 0 ... 1.
    """
    return learn_folds(reader, images, calibration=calibration, name=name, done=done).state


def learn_folds(
    reader: Reader,
    images: Sequence[ArrayLike],
    *,
    calibration: Calibration | None = None,
    name: str = "",
    done: Callable[[float], None] | None = None,
) -> LearnedSensor:
    """Return the state of a sensor as `learn_sensor` does, and those to read `images` by."""
    newtons = calibration is not None
    known = reader.state or unknown_state(reader.sensor, newtons=newtons, name=name)
    readings = [np.asarray(one, np.float64) for one in images]
    floating = not newtons and (known.floating or _floats(reader, readings))
    inverted = [invert_floating(one) for one in readings] if floating else readings
    before = state = replace(known, floating=False)
    found = None
    if len(inverted) >= LEAST_TOUCHES:
        found = answering_of(_forces(reader, state, inverted, calibration))
        state = replace(state, dead=found.dead, hot=found.hot, offset=found.offset)
    for turn in range(ROUNDS):
        evidence: list[TactelEvidence | None] = [None] * FOLDS
        expected: list[Array] = []
        read_with = state
        under = replace(reader, state=state)
        for number, image in enumerate(inverted):
            signal = under.signal(image, calibration=calibration)
            reading = read_touch(under, signal, number)
            answer, verified = reading.answer, reading.best
            if answer and verified is not None and (answer.margin or 0.0) > MARGIN:
                one, forces = evidence_of(verified)
                others = evidence[number % FOLDS]
                evidence[number % FOLDS] = one if others is None else others + one
                expected.append(forces.reshape(state.shape))
            if done is not None:
                done((turn + (number + 1) / len(inverted)) / ROUNDS)
        if known.touches + len(images) < LEAST_TOUCHES:
            evidence = [None] * FOLDS
        state = refine_tactels(read_with, evidence, before)
        if found is not None and expected:  # on round faces the outer tactels touch nothing
            state = replace(state, dead=found.dead & ~answering_of(np.array(expected)).dead)

    touches, drift = known.touches + len(images), _drift(readings)

    def finished(one: SensorState) -> SensorState:
        return replace(one, dead=state.dead, floating=floating, touches=touches, drift=drift)

    folds = (
        refine_tactels(read_with, evidence[:fold] + evidence[fold + 1 :], before)
        for fold in range(FOLDS)
    )
    return LearnedSensor(finished(state), tuple(map(finished, folds)))


def answering_of(forces: Array) -> Answering:
    """Return which tactels answer; all of them, if the touches are few.

    Forces (n, rows, columns) are readings over the background, of n touches of different places.
    """
    shape = forces.shape[1:]
    none = np.zeros(shape)
    strong = np.percentile(forces.reshape(len(forces), -1), STRONG, axis=1)
    if (strong > 0).sum() < LEAST_TOUCHES:
        return Answering(none > 0, none > 0, none)
    scale = float(np.median(strong[strong > 0]))  # of all touches: a stuck tactel is so always
    seen = forces[strong > 0] / scale
    few = len(seen) // LEAST_TOUCHES  # of many touches not the extreme one: a spike is one
    free = np.sort(seen, axis=0)[few - 1]
    high = free - np.median(free) > HOT
    rise = np.sort(seen - np.where(high, free, 0.0), axis=0)[-few]
    dead, least = high, np.where(high, ANSWERS_RAISED, ANSWERS)
    for _ in range(2):  # once more among those that answer: where most around one are dead
        dead = rise < least * _around(np.where(dead, np.nan, rise))
    return Answering(dead & ~high, high & dead, np.where(high & ~dead, scale * free, 0.0))


def evidence_of(verified: VerifiedHypothesis) -> tuple[TactelEvidence, Array]:
    """Return the evidence of one recognised touch, and the forces (n,) that it expects.

    Both hold under the state that the touch was read with.
    """
    fit, image = verified.fit, verified.image
    at = linearize_image(image, fit.pose[None], fit.gain[None], verified.labels_at)
    own, left = at.jacobian[0], at.left[0]
    sure = at.sure[0] * (FIRST_NOISE / fit.noise) ** 2
    c, s = np.cos(fit.theta_rad), np.sin(fit.theta_rad)
    expected = image.forces - left
    by_tactel = np.stack(
        [expected, c * own[:, 0] + s * own[:, 1], c * own[:, 1] - s * own[:, 0]], axis=1
    )
    count = len(left)
    normal = np.zeros((count, 3, count, 3))
    each = np.arange(count)
    normal[each, :, each, :] = by_tactel[:, :, None] * by_tactel[:, None, :] * sure[:, None, None]
    weighed = own * sure[:, None]
    inner = weighed.T @ own + np.diag(at.precision)
    cross = (by_tactel[:, :, None] * weighed[:, None, :]).reshape(3 * count, -1)
    solved = np.linalg.solve(inner, cross.T)
    right = (by_tactel * (sure * left)[:, None]).ravel()
    right -= solved.T @ (weighed.T @ left - at.known[0] * at.precision)
    return TactelEvidence(normal.reshape(3 * count, -1) - cross @ solved, right), expected


def refine_tactels(
    state: SensorState, found: Sequence[TactelEvidence | None], before: SensorState
) -> SensorState:
    """Return a state with gains and tip places by the evidence of touches.

    They were read with `state`; `before` is the state before these touches.
    """
    evidence = [one for one in found if one is not None]
    if not evidence:
        return state
    unknowns = _unknowns(state)
    known, deviation = _unknowns(before), _deviations(before)
    precision = 1.0 / deviation**2
    normal = sum(one.normal for one in evidence) + np.diag(precision)
    right = sum(one.slope for one in evidence) + precision * (known - unknowns)
    covariance = np.linalg.inv(normal)
    values = (unknowns + covariance @ right).reshape(-1, 3)
    left = np.sqrt(np.diagonal(covariance)).reshape(-1, 3)
    rows, columns = state.shape
    return replace(
        state,
        gain=np.exp(values[:, 0] - values[:, 0].mean()).reshape(rows, columns),
        gain_deviation=left[:, 0].reshape(rows, columns),
        aside_mm=values[:, 1:].reshape(rows, columns, 2),
        aside_deviation_mm=left[:, 1:].reshape(rows, columns, 2),
    )


def _floats(reader: Reader, readings: list[Array]) -> bool:
    """Whether touches are recognised only with the network inverted."""
    tried = readings[:TRIED]
    if sum(bool(reader.read(one)) for one in tried) >= AGREE:
        return False
    return sum(bool(reader.read(invert_floating(one))) for one in tried) >= AGREE


def _forces(
    reader: Reader, state: SensorState, readings: list[Array], calibration: Calibration | None
) -> Array:
    """Return forces (n, rows, columns) over the background, without corrections of tactels."""
    shape, none = state.shape, np.zeros(state.shape)
    plain = replace(state, dead=none > 0, hot=none > 0, offset=none, gain=np.ones(shape))
    under = replace(reader, state=plain)
    return np.array([under.signal(one, calibration=calibration).forces for one in readings])


def _drift(readings: list[Array]) -> float:
    """Return the rise of the background from the first third of the touches to the last."""
    third = len(readings) // 3
    if not third:
        return 0.0
    level = [float(np.median(np.sort(one, axis=None)[: one.size // 10])) for one in readings]
    return float(np.median(level[-third:]) - np.median(level[:third]))


def _around(values: Array) -> Array:
    """Return the usual value of the tactels around each one; NaN do not count."""
    half = AROUND // 2
    padded = np.pad(values, half, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (AROUND,) * 2)
    flat = np.sort(windows.reshape(*values.shape, -1), axis=-1)  # NaN come last
    count = np.isfinite(flat).sum(axis=-1)
    at = np.rint(USUAL / 100 * np.maximum(count - 1, 0)).astype(np.int64)
    found = np.take_along_axis(flat, at[..., None], axis=-1)[..., 0]
    return np.where(count > 0, found, 0.0)


def _unknowns(state: SensorState) -> Array:
    return np.concatenate([np.log(state.gain)[..., None], state.aside_mm], axis=-1).ravel()


def _deviations(state: SensorState) -> Array:
    """Return the standard deviations of a state, at most those of an unknown sensor."""
    both = np.concatenate([state.gain_deviation[..., None], state.aside_deviation_mm], axis=-1)
    return np.asarray(np.clip(both, 1e-6, [GAIN_SD, ASIDE_SD_MM, ASIDE_SD_MM]).ravel())
