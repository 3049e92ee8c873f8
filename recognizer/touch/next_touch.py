"""Where to touch next: the step, the turn and the force that promise most.

Signal + hypotheses of a touch without a sure answer -> NextTouch. Steps on a grid of lengths,
directions and turns are weighed by the symbols that the sensor would see, unseen ones more, after
two views of the surroundings:

- the image: a face loaded up to the sensor's rim goes on beyond it, the less surely the farther. A
  tilted plate hangs over parts of the face: the loaded area of earlier touches counts as well;
- the hypotheses: each knows the face under the sensor, with all its symbols and its border.

The sensor's centre stays on the loaded area, or where every likely face is: no step leads off the
face. The force is the one at which touches are read best. Sensor frame, mm. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType, force_share
from recognizer.touch.hypothesis import PlaceHypothesis
from recognizer.touch.options import TIE_NATS
from recognizer.touch.pose import face_pose
from recognizer.touch.prepare import PreparedLab
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, NextTouch, Recognition
from recognizer.touch.signal import Signal, combine_around, mean_of_strongest

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
#: x, y (mm) and turn (rad) of an earlier touch, in the sensor frame of the last one; its signal
EarlierTouch = tuple[Array, Signal]

# Which steps are weighed, and what they are worth. Lengths,
# forces and counts are those of `fsr-16`; `next_limits` makes those of another type.
LENGTHS_MM = (4.0, 7.0, 10.0, 14.0)  #: of steps
DIRECTIONS = 16  #: of steps
TURNS_RAD = (0.0, math.pi / 4)  #: a row of symbols fits along a diagonal
FORCE_N = 80.0  #: at which touches are read best
FAINT = 0.08  #: share of the strongest from which a tactel lies on something ...
LEAST_COUNTS = 16.0  #: ... and readings over the background: less is noise, ...
QUIET_SIGMAS = 4.0  #: ... and deviations of the type's noise, where that is more
LEAST_N = 0.1  #: where readings are newtons
GAP = 5  #: tactels, side of the square that closes gaps between strokes
CLEAR_MM = 2.5  #: from where the face may end to the centre: nearer, the plate tips
POINTS = 8  #: along each side of the sensor at which a view is asked
WHOLE = 0.36  #: pitches within the rim at which a symbol's centre is seen whole
BEYOND_MM = 30.0  #: beyond the sensor's rim at which trust in a face falls to 1/e
NOVELTY = 0.2  #: more that a symbol is worth which was not seen yet ...
NOVELTY_INSIDE = 0.5  #: ... where no edge is near: there another look says as little
FACES = 6  #: hypotheses that are asked, and ...
SOFT_NATS = 3.0  #: ... nats by which their weights fall to 1/e
BY_FACE = 0.5  #: weight of the faces' view against the image's
AGREED = 0.9  #: of the hypotheses' weight that must know a face under the centre
COST = 0.01  #: symbols that a mm of the way costs
TURNING = 1.5  #: symbols that a turn costs
WHOLE_SHARE = 0.85  #: of the sensor that lies on something; with less, an edge is near
SOFT_COUNTS = 40.0  #: below which the strongest readings are weak
SOFT_N = 0.25  #: where readings are newtons
MARGIN = 14.0 - TIE_NATS  #: nats below which an answer had better be confirmed
DOUBT = 1e-5  #: places by chance above which it had

#: Reasons of touches that show symbols of registered places, but of several.
_PLACES_KNOWN = (AMBIGUOUS, BY_CHANCE)


@dataclass(frozen=True, slots=True)
class NextLimits:
    """Steps and forces that suit a sensor type."""

    lengths_mm: tuple[float, ...]
    clear_mm: float
    force_n: float
    least_counts: float
    soft_counts: float
    gap: int


def next_limits(sensor: SensorType) -> NextLimits:
    """Return the limits for a type: steps as long for its size, as hard as it is pressed.

    Steps of larger sensors are no longer than those of `fsr-16`: 16 of 16 touches of `mat-32x32` at
    edges were answered by the third, 13 with steps as long for its size. Counts go with the full
    scale, or with the noise where that is more; gaps between strokes are no wider in mm where
    tactels are coarse.
    """
    usual = SensorType()
    size = min(1.0, math.sqrt(math.prod(sensor.half_mm) / math.prod(usual.half_mm)))
    scale = sensor.full / usual.full
    reach = GAP // 2
    reach = max(1, min(reach, round(reach * usual.pitch_mm / max(sensor.step_mm))))
    return NextLimits(
        lengths_mm=tuple(size * length for length in LENGTHS_MM),
        clear_mm=size * CLEAR_MM,
        force_n=round(force_share(sensor) * FORCE_N, 1),
        least_counts=max(scale * LEAST_COUNTS, QUIET_SIGMAS * sensor.noise),
        soft_counts=scale * SOFT_COUNTS,
        gap=2 * reach + 1,
    )


def propose_next(
    reader: PreparedLab,
    signal: Signal,
    answer: Recognition,
    hypotheses: Sequence[PlaceHypothesis],
    earlier: Sequence[EarlierTouch] = (),
) -> NextTouch | None:
    """Return where to touch next; None where the answer is sure.

    `hypotheses` are the places of the touch, best first; what `earlier` touches have seen is not
    new, and shows where the face is.
    """
    if answer and not _is_unsure(answer):
        return None
    limits = next_limits(reader.sensor)
    if not signal.contact:
        return NextTouch(0.0, 0.0, 0.0, limits.force_n, "nothing is felt: press onto the object")
    steps = _steps(limits)
    pitch_mm = min(each.style.pitch_mm for each in reader.lab.arrays)
    before = tuple((pose, _loaded_tactels(seen, limits)) for pose, seen in earlier)
    area = LoadedArea(reader.sensor, _loaded_tactels(signal, limits), before)
    share = float(area.loaded.mean())
    novelty = NOVELTY_INSIDE if share >= WHOLE_SHARE else NOVELTY
    by_image, borne = _symbols_by_image(area, pitch_mm, novelty, limits)
    value = by_image
    # where nothing speaks for symbols of a registered place, hypotheses know no border either
    likely = _likely(hypotheses) if answer or answer.reason in _PLACES_KNOWN else []
    if likely:
        each = [_symbols_by_face(area, one, steps, novelty, limits) for one, _ in likely]
        weights = np.array([weight for _, weight in likely])
        by_face = weights @ np.stack([symbols for symbols, _ in each])
        inside = weights @ np.stack([within for _, within in each])
        value = (1 - BY_FACE) * by_image + BY_FACE * by_face
        both = borne & (inside >= AGREED)
        borne = both if both.any() else borne
    value = np.where(borne, value - COST * np.hypot(steps[:, 0], steps[:, 1]), -math.inf)
    value -= TURNING * (steps[:, 2] != 0)
    best = int(np.argmax(value)) if borne.any() else 0
    dx, dy, turn = steps[best].tolist()
    why = _why(signal, share, (dx, dy, turn), answer, limits)
    return NextTouch(round(dx, 1), round(dy, 1), round(math.degrees(turn), 1), limits.force_n, why)


def _is_unsure(answer: Recognition) -> bool:
    """Whether an answer had better be confirmed."""
    few = answer.margin is not None and answer.margin < MARGIN
    return few or (answer.doubt is not None and answer.doubt > DOUBT)


@lru_cache(maxsize=8)
def _steps(limits: NextLimits) -> Array:
    """Return (n, 3) steps along x and y (mm) and turns (rad); the first one is none."""
    turns = np.arange(DIRECTIONS) * 2 * math.pi / DIRECTIONS
    moves = [(0.0, 0.0)]
    moves += [(r * math.cos(a), r * math.sin(a)) for r in limits.lengths_mm for a in turns]
    return np.array([(x, y, turn) for turn in TURNS_RAD for x, y in moves])


@lru_cache(maxsize=8)
def _views(sensor: SensorType, limits: NextLimits) -> tuple[PlanePoints, PlanePoints]:
    """Return points that the sensor sees after each step (n, k), and those about its centre."""
    steps, half = _steps(limits), np.array(sensor.half_mm)
    line = (np.arange(POINTS) + 0.5) / POINTS * 2 - 1
    grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2) * half
    c, s = np.cos(steps[:, 2, None]), np.sin(steps[:, 2, None])
    x = steps[:, 0, None] + c * grid[:, 0] - s * grid[:, 1]
    y = steps[:, 1, None] + s * grid[:, 0] + c * grid[:, 1]
    around = limits.clear_mm * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
    views = np.stack([x, y], axis=-1), steps[:, None, :2] + around
    return _plane_points(sensor, views[0]), _plane_points(sensor, views[1])


def _symbols_by_image(
    area: LoadedArea, pitch_mm: float, novelty: float, limits: NextLimits
) -> tuple[Array, Flags]:
    """Return (n,) symbols worth at each step, and whether the centre stays on the loaded area."""
    points, around = _views(area.sensor, limits)
    half_x, half_y = area.sensor.half_mm
    cells = 4 * half_x * half_y / pitch_mm**2
    seen, loaded = area.look(points)
    beyond = area.loaded[points.nearest] * np.exp(-points.away_mm / BEYOND_MM)
    expected = np.where(seen, loaded, beyond)
    worth = cells * (expected * (1 + novelty * ~seen)).mean(axis=1)
    return worth, np.asarray(area.look(around)[1].all(axis=1))


def _likely(hypotheses: Sequence[PlaceHypothesis]) -> list[tuple[PlaceHypothesis, float]]:
    """Return the likeliest places with their weights, which sum to 1."""
    ranked = sorted(hypotheses, key=lambda one: -one.score)[:FACES]
    if not ranked:
        return []
    raw = np.exp((np.array([one.score for one in ranked]) - ranked[0].score) / SOFT_NATS)
    return list(zip(ranked, (raw / raw.sum()).tolist(), strict=True))


def _symbols_by_face(
    area: LoadedArea, one: PlaceHypothesis, steps: Array, novelty: float, limits: NextLimits
) -> tuple[Array, Array]:
    """Return (n,) symbols worth at each step on a face, and whether its centre lies on it."""
    face = one.face
    T = face_pose(one.embossed, face, one.hypothesis, one.fit)
    R, at = T[:2, :2], T[:2, 3]
    own = (face.centres_mm - at) @ R  # in the sensor frame of now
    c, s = np.cos(steps[:, 2, None]), np.sin(steps[:, 2, None])
    dx, dy = own[:, 0] - steps[:, 0, None], own[:, 1] - steps[:, 1, None]
    then = c * dx + s * dy, c * dy - s * dx
    rim = WHOLE * one.embossed.style.pitch_mm
    half_x, half_y = area.sensor.half_mm
    seen = (np.abs(then[0]) < half_x - rim) & (np.abs(then[1]) < half_y - rim)
    new = ~area.look(_plane_points(area.sensor, own))[0]
    worth = (seen * (1 + novelty * new)).sum(axis=1)
    places = steps[:, :2] @ R.T + at
    region = face.region
    within = region.contains(places) & (region.distance_mm(places) > limits.clear_mm)
    return worth.astype(np.float64), within.astype(np.float64)


def _why(
    signal: Signal,
    share: float,
    step: tuple[float, float, float],
    answer: Recognition,
    limits: NextLimits,
) -> str:
    """Return in words what a step promises."""
    words = []
    if mean_of_strongest(signal.forces * signal.trust) < (
        SOFT_N if signal.newtons else limits.soft_counts
    ):
        words.append("more force: little is felt")
    if step[0] or step[1]:
        if share < WHOLE_SHARE:
            words.append(f"towards the loaded part: {share:.0%} of the sensor is on something")
        else:
            words.append("symbols that were not seen yet")
    if step[2]:
        words.append("turned, more of the symbols fit under the sensor")
    return "; ".join(words) or f"once more: {answer.reason or 'to be sure'}"


@dataclass(frozen=True, slots=True, eq=False)
class PlanePoints:
    """Points of the sensor's plane, frame of the last touch."""

    mm: Array  #: (..., 2)
    under: Flags  #: (...) whether they lie under the sensor
    nearest: tuple[Ints, Ints]  #: row and column (...) of the tactel nearest to each
    away_mm: Array  #: (...) from the sensor's rim


def _plane_points(sensor: SensorType, points_mm: Array) -> PlanePoints:
    """Return points (..., 2) of a sensor's plane."""
    half = np.array(sensor.half_mm)
    beyond = np.maximum(np.abs(points_mm) - half, 0.0)
    under = np.asarray((np.abs(points_mm) < half).all(axis=-1))
    inside = np.clip(points_mm, -0.999 * half, 0.999 * half)
    nearest = _tactels(sensor, np.where(under[..., None], points_mm, inside))
    return PlanePoints(points_mm, under, nearest, np.linalg.norm(beyond, axis=-1))


@dataclass(frozen=True, slots=True, eq=False)
class LoadedArea:
    """Where touches have loaded a face."""

    sensor: SensorType
    loaded: Flags  #: (rows, columns) of the last touch
    earlier: tuple[tuple[Array, Flags], ...]  #: poses (3,) and what was loaded there

    def look(self, points: PlanePoints) -> tuple[Flags, Flags]:
        """Return which points (...) lay under the sensor, and where the face was loaded."""
        half = np.array(self.sensor.half_mm)
        seen, loaded = points.under.copy(), points.under & self.loaded[points.nearest]
        for (x, y, turn), before in self.earlier:
            c, s = math.cos(turn), math.sin(turn)
            own = (points.mm - (x, y)) @ np.array([[c, -s], [s, c]])
            under = (np.abs(own) < half).all(axis=-1)
            seen |= under
            loaded[under] |= before[_tactels(self.sensor, own[under])]
        return seen, loaded


def _loaded_tactels(signal: Signal, limits: NextLimits) -> Flags:
    """Return (rows, columns) where the sensor lies on something, gaps between strokes closed."""
    forces = signal.forces * signal.trust
    least = LEAST_N if signal.newtons else limits.least_counts
    pressed = forces > max(FAINT * mean_of_strongest(forces), least)
    reach = limits.gap // 2
    near = combine_around(pressed, reach, np.logical_or)
    return combine_around(near, reach, np.logical_and)


def _tactels(sensor: SensorType, points_mm: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of the tactels at points under the sensor."""
    half_x, half_y = sensor.half_mm
    column = np.floor((points_mm[..., 0] + half_x) * sensor.columns / (2 * half_x))
    row = np.floor((half_y - points_mm[..., 1]) * sensor.rows / (2 * half_y))
    return (
        row.astype(np.int64).clip(0, sensor.rows - 1),
        column.astype(np.int64).clip(0, sensor.columns - 1),
    )
