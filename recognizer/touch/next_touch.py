"""Where to touch next: the step, the turn and the force that promise most.

Signal + hypotheses of a touch that is not answered, or not surely -> NextTouch. Steps on a grid of
lengths, directions and turns are weighed by the symbols that the sensor would see there, those
that it has not seen counted once more, after two views of what lies beyond it:

- the image: where the sensor is loaded the face is, and what is loaded up to the sensor's rim goes
  on beyond it;
- the hypotheses: each says which face is under the sensor, with all its symbols and its border.

The sensor's centre stays where something was felt, or where every likely face is: no step leads
off the face. The force is the one at which touches are read best. Sensor frame, mm. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.felt_area import (
    EarlierTouch,
    FeltArea,
    PlanePoints,
    felt_area,
    plane_points,
    strongest_reading,
)
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.next_limits import next_limits
from recognizer.touch.pose import face_pose, outline_of
from recognizer.touch.prepare import PreparedLab
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, NextTouch, Recognition
from recognizer.touch.settings import NextSettings
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.fit import Fit

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


#: Reasons of touches that show symbols of registered places, but of several.
_PLACES_KNOWN = (AMBIGUOUS, BY_CHANCE)


class PlaceHypothesis(Protocol):
    """A place that a touch may be: `VerifiedHypothesis`, or what a scan has located."""

    @property
    def embossed(self) -> EmbossedArray:
        """Array and style."""

    @property
    def hypothesis(self) -> Hypothesis:
        """The place of the fit's lattice."""

    @property
    def fit(self) -> Fit:
        """Pose of the sensor on that lattice."""

    @property
    def score(self) -> float:
        """Log-likelihood, nats."""


def propose_next(
    reader: PreparedLab,
    signal: Signal,
    answer: Recognition,
    hypotheses: Sequence[PlaceHypothesis],
    earlier: Sequence[EarlierTouch] = (),
) -> NextTouch | None:
    """Return where to touch next; None where the answer is sure.

    Parameters
    ----------
    reader
        Of the lab and the sensor.
    signal
        Of the touch.
    answer
        What the touch says by itself or with others.
    hypotheses
        Places that the touch may be, best first.
    earlier
        Touches before: what they have seen is not new, and says where the face is.
    """
    if answer and not _is_unsure(answer, reader.settings.next):
        return None
    settings = next_limits(reader.sensor, reader.settings.next)
    if not signal.contact:
        return NextTouch(0.0, 0.0, 0.0, settings.force_n, "nothing is felt: press onto the object")
    steps = _steps(settings)
    pitch_mm = min(each.style.pitch_mm for each in reader.lab.arrays)
    area = felt_area(reader.sensor, signal, earlier, settings)
    if area.share >= settings.whole_share:
        settings = replace(settings, novelty=settings.novelty_inside)
    by_image, borne = _symbols_by_image(area, pitch_mm, settings)
    value = by_image
    # where nothing speaks for symbols of a registered place, hypotheses know no border either
    likely = _likely(hypotheses, settings) if answer or answer.reason in _PLACES_KNOWN else []
    if likely:
        each = [_symbols_by_face(area, one, steps, settings) for one, _ in likely]
        weights = np.array([weight for _, weight in likely])
        by_face = weights @ np.stack([symbols for symbols, _ in each])
        inside = weights @ np.stack([within for _, within in each])
        value = (1 - settings.by_face) * by_image + settings.by_face * by_face
        both = borne & (inside >= settings.agreed)
        borne = both if both.any() else borne
    value = np.where(borne, value - settings.cost * np.hypot(steps[:, 0], steps[:, 1]), -math.inf)
    value -= settings.turning * (steps[:, 2] != 0)
    best = int(np.argmax(value)) if borne.any() else 0
    dx, dy, turn = steps[best].tolist()
    why = _why(signal, area.share, (dx, dy, turn), answer, settings)
    return NextTouch(
        round(dx, 1), round(dy, 1), round(math.degrees(turn), 1), settings.force_n, why
    )


def _is_unsure(answer: Recognition, settings: NextSettings) -> bool:
    """Whether an answer had better be confirmed."""
    few = answer.margin is not None and answer.margin < settings.margin
    return few or (answer.doubt is not None and answer.doubt > settings.doubt)


@lru_cache(maxsize=8)
def _steps(settings: NextSettings) -> Array:
    """Return (n, 3) steps along x and y (mm) and turns (rad); the first one is none."""
    turns = np.arange(settings.directions) * 2 * math.pi / settings.directions
    moves = [(0.0, 0.0)]
    moves += [(r * math.cos(a), r * math.sin(a)) for r in settings.lengths_mm for a in turns]
    return np.array([(x, y, turn) for turn in settings.turns_rad for x, y in moves])


@lru_cache(maxsize=8)
def _views(sensor: SensorType, settings: NextSettings) -> tuple[PlanePoints, PlanePoints]:
    """Return points that the sensor sees after each step (n, k), and those about its centre."""
    steps, half = _steps(settings), np.array(sensor.half_mm)
    line = (np.arange(settings.points) + 0.5) / settings.points * 2 - 1
    grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2) * half
    c, s = np.cos(steps[:, 2, None]), np.sin(steps[:, 2, None])
    x = steps[:, 0, None] + c * grid[:, 0] - s * grid[:, 1]
    y = steps[:, 1, None] + s * grid[:, 0] + c * grid[:, 1]
    around = settings.clear_mm * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
    views = np.stack([x, y], axis=-1), steps[:, None, :2] + around
    return plane_points(sensor, views[0]), plane_points(sensor, views[1])


def _symbols_by_image(
    area: FeltArea, pitch_mm: float, settings: NextSettings
) -> tuple[Array, Flags]:
    """Return (n,) symbols worth at each step, and whether the centre then lies on what was felt."""
    points, around = _views(area.sensor, settings)
    half_x, half_y = area.sensor.half_mm
    cells = 4 * half_x * half_y / pitch_mm**2
    expected, seen = area.look(points)
    worth = cells * (expected * (1 + settings.novelty * ~seen)).mean(axis=1)
    return worth, np.asarray(area.felt(around).all(axis=1))


def _likely(
    hypotheses: Sequence[PlaceHypothesis], settings: NextSettings
) -> list[tuple[PlaceHypothesis, float]]:
    """Return the likeliest places with their weights, which sum to 1."""
    ranked = sorted(hypotheses, key=lambda one: -one.score)[: settings.faces]
    if not ranked:
        return []
    raw = np.exp((np.array([one.score for one in ranked]) - ranked[0].score) / settings.soft)
    return list(zip(ranked, (raw / raw.sum()).tolist(), strict=True))


def _symbols_by_face(
    area: FeltArea, one: PlaceHypothesis, steps: Array, settings: NextSettings
) -> tuple[Array, Array]:
    """Return (n,) symbols worth at each step on a face, and whether its centre lies on it."""
    face = one.embossed.face(one.hypothesis.face)
    T = face_pose(one.embossed, face, one.hypothesis, one.fit)
    R, at = T[:2, :2], T[:2, 3]
    own = (face.centres_mm - at) @ R  # in the sensor frame of now
    c, s = np.cos(steps[:, 2, None]), np.sin(steps[:, 2, None])
    dx, dy = own[:, 0] - steps[:, 0, None], own[:, 1] - steps[:, 1, None]
    then = c * dx + s * dy, c * dy - s * dx
    rim = settings.whole * one.embossed.style.pitch_mm
    half_x, half_y = area.sensor.half_mm
    seen = (np.abs(then[0]) < half_x - rim) & (np.abs(then[1]) < half_y - rim)
    new = ~area.seen(plane_points(area.sensor, own))
    worth = (seen * (1 + settings.novelty * new)).sum(axis=1)
    places = steps[:, :2] @ R.T + at
    region = outline_of(face)
    within = region.contains(places) & (region.distance_mm(places) > settings.clear_mm)
    return worth.astype(np.float64), within.astype(np.float64)


def _why(
    signal: Signal,
    share: float,
    step: tuple[float, float, float],
    answer: Recognition,
    settings: NextSettings,
) -> str:
    """Return in words what a step promises."""
    words = []
    if strongest_reading(signal, settings) < (
        settings.soft_n if signal.newtons else settings.soft_counts
    ):
        words.append("more force: little is felt")
    if step[0] or step[1]:
        if share < settings.whole_share:
            words.append(f"towards the loaded part: {share:.0%} of the sensor is on something")
        else:
            words.append("symbols that were not seen yet")
    if step[2]:
        words.append("turned, more of the symbols fit under the sensor")
    return "; ".join(words) or f"once more: {answer.reason or 'to be sure'}"
