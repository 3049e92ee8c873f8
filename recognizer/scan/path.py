"""Poses of touches without measured motion: a path through registered places. Thesis 4.3, 6.3.

Views of touches + the knowledge of each step -> the path that explains all touches best, in array
axes (cell (0, 0) of the array has its lower left corner at the origin, y against rows; mm, rad).
One touch alone is ambiguous (symbols look alike a pitch away); its neighbours and the database
decide: each touch is at one of its own likely places, and a step from place to place costs the
nats of its length. A. J. Viterbi, IEEE Trans. Inf. Theory 13 (1967) 260.

A path that the touches would not show without the database is weak evidence: `path_ambiguity`
counts the other paths that they allow. Steps are poses (3,) of a touch in the axes of an earlier
one: x, y (mm), theta (rad).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.lattice import CELL_NATS, LEFT_OUT_NATS
from recognizer.scan.mosaic.planar import (
    BY_HAND_SD,
    PlacedTouch,
    PlanarBelief,
    compose_poses,
    composed_covariance,
    pose_difference,
    relative_covariance,
    relative_pose,
    wrap_angle,
)
from recognizer.scan.views import LatticeView, TouchPoses
from recognizer.touch.hypothesis import Hypothesis, find_hypotheses
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.symbols.fit import Fit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_PLACES = 200  #: of each touch
MOST_SKIPPED = 3  #: touches in a row
SHIFTS = 3  #: pitches, each way, of alternative paths
PLACED_SD = (0.4, 0.4, 0.01)  #: of x, y (mm) and the turn (rad) of a touch on the path


@dataclass(frozen=True, slots=True, eq=False)
class RegisteredPath:
    """Poses of touches by their images and the database."""

    poses: Array  #: (n, 3) in array axes; a skipped touch has that of a neighbour
    placed: NDArray[np.bool_]  #: (n,)
    margin: float  #: nats over the best path that ends elsewhere
    ambiguity: float  #: log of the number of paths that the touches allow, by their weights

    def touch_poses(self, skipped: Array) -> TouchPoses:
        """Return the poses with covariances; `skipped` (3, 3) is that of skipped touches."""
        spread = np.where(self.placed[:, None, None], np.diag(np.square(PLACED_SD)), skipped)
        return TouchPoses(self.poses, spread, None)


def follow_path(
    embossed: EmbossedArray, views: Sequence[Sequence[LatticeView]], steps: Sequence[PlanarBelief]
) -> RegisteredPath:
    """Return the likeliest path; without placed touches where no touch has a place.

    `views` of each touch, `steps` by `known_steps`.
    """
    places = [_places_of_touch(embossed, each) for each in views]
    every: list[Array] = []  # (k,) nats of the best path to each place, of each touch so far
    previous: list[list[tuple[int, int]]] = []  # touch and place before; (-1, -1): a path begins
    for t in range(len(places)):
        reached, before_t = _reach_touch(embossed, places, steps, t, every)
        every.append(reached)
        previous.append(before_t)
    ends = [float(each.max(initial=-math.inf)) for each in every]
    ends = [end - LEFT_OUT_NATS * (len(ends) - 1 - t) for t, end in enumerate(ends)]
    last = int(np.argmax(ends))
    if not math.isfinite(ends[last]):
        return RegisteredPath(np.zeros((len(views), 3)), np.zeros(len(views), np.bool_), 0.0, 0.0)
    scores = every[last]
    end = int(scores.argmax())
    elsewhere = _lie_elsewhere(embossed, places[last], end)
    margin = float(scores[end] - scores[elsewhere].max(initial=-math.inf))
    chosen: dict[int, int] = {}
    t, n = last, end
    while t >= 0:
        chosen[t] = n
        t, n = previous[t][n]
    poses, before = np.zeros((len(places), 3)), min(chosen)
    for t in range(len(places)):
        before = t if t in chosen else before
        poses[t] = places[before].poses[chosen[before]]
    poses = poses[0] + _on_torus(embossed, poses - poses[0])
    placed = np.array([t in chosen for t in range(len(places))])
    fits = {t: places[t].fits[n] for t, n in sorted(chosen.items())}
    pitch, order = embossed.style.pitch_mm, embossed.array.order
    return RegisteredPath(poses, placed, margin, path_ambiguity(fits, poses, steps, pitch, order))


def known_steps(touches: Sequence[PlacedTouch]) -> list[PlanarBelief]:
    """Return the step to each touch from the one before; unknown for the first one."""
    unknown = PlanarBelief(np.zeros(3), np.diag(np.square(BY_HAND_SD)))
    steps = [unknown]
    for before, touch in pairwise(touches):
        if touch.stepped is not None:
            steps.append(touch.stepped)
        elif before.believed is not None and touch.believed is not None:
            a, b = before.believed, touch.believed
            spread = relative_covariance(a.pose, b.pose, a.covariance, b.covariance)
            steps.append(PlanarBelief(relative_pose(a.pose, b.pose), spread))
        else:
            steps.append(unknown)
    return steps


def step_between(steps: Sequence[PlanarBelief], a: int, b: int) -> PlanarBelief:
    """Return the step from a touch to a later one."""
    pose, covariance = steps[a + 1].pose, steps[a + 1].covariance
    for more in steps[a + 2 : b + 1]:
        covariance = composed_covariance(pose, more.pose, covariance, more.covariance)
        pose = compose_poses(pose, more.pose)
    return PlanarBelief(pose, covariance)


def path_ambiguity(
    fits: Mapping[int, Fit],
    poses: Array,
    steps: Sequence[PlanarBelief],
    pitch_mm: float,
    order: int,
) -> float:
    """Return -log of the probability of a path by the touches alone.

    Whole pitches away, a touch shows known cells with other symbols, or with the right ones by
    chance. `fits` are those of the placed touches in their order, `poses` (n, 3) of all touches in
    array axes; `order` is the number of symbols.
    """
    known: dict[tuple[int, int], Array] = {}
    total, before = 0.0, -1
    near = range(-SHIFTS, SHIFTS + 1)
    for t, fit in fits.items():
        cells = fit.cells + np.rint((poses[t, :2] - (fit.x_mm, fit.y_mm)) / pitch_mm).astype(int)
        bounded = np.maximum(fit.scores, -CELL_NATS)
        if before >= 0:
            step, own = step_between(steps, before, t), _probabilities(bounded)
            values = {}
            for shift in ((i, j) for i in near for j in near):
                shifted = poses[t] + np.array([*shift, 0.0]) * pitch_mm
                away = pose_difference(relative_pose(poses[before], shifted), step.pose)
                cost = 0.5 * float(away @ np.linalg.solve(step.covariance, away))
                values[shift] = _log_agreement(known, cells + shift, own, order) - cost
            total += float(np.logaddexp.reduce(list(values.values()))) - values[0, 0]
        for cell, each in zip(map(tuple, cells.tolist()), bounded, strict=True):
            known[cell] = known[cell] + each if cell in known else each
        before = t
    return total


@dataclass(frozen=True, slots=True, eq=False)
class _TouchPlaces:
    """Likely places of one touch by itself."""

    fits: tuple[Fit, ...]  #: the fit of each place
    poses: Array  #: (k, 3) in array axes
    faces: Ints  #: (k,)
    losses: Array  #: (k,) nats below the best symbols of any kind, 0 or less


def _reach_touch(
    embossed: EmbossedArray,
    places: Sequence[_TouchPlaces],
    steps: Sequence[PlanarBelief],
    t: int,
    before: Sequence[Array],
) -> tuple[Array, list[tuple[int, int]]]:
    """Return the best paths to a touch's places from the scores of the touches `before` it.

    Nats (k,), and touch and place before; (-1, -1) where the path begins there.
    """
    at = places[t]
    best = np.full(len(at.poses), -LEFT_OUT_NATS * t)  # all earlier touches are left out
    previous = [(-1, -1)] * len(best)
    for k in range(t - 1, max(t - 1 - MOST_SKIPPED, 0) - 1, -1):
        if not len(before[k]):
            continue
        step = step_between(steps, k, t)
        reached = before[k][:, None] - _step_costs(embossed, places[k], at, step)
        reached -= LEFT_OUT_NATS * (t - 1 - k)
        nearest = reached.argmax(axis=0)
        value = reached[nearest, np.arange(len(best))]
        for n in np.flatnonzero(value > best).tolist():
            best[n], previous[n] = value[n], (k, int(nearest[n]))
    return best + at.losses, previous


def _places_of_touch(embossed: EmbossedArray, views: Sequence[LatticeView]) -> _TouchPlaces:
    fits = tuple(view.fit for view in views if not view.predicted)
    found = find_hypotheses(embossed, fits, MOST_PLACES)[:MOST_PLACES]
    most = max((fit.value for fit in fits), default=0.0)
    poses = [_pose_in_array(embossed, fits[one.fit], one) for one in found]
    return _TouchPlaces(
        fits=tuple(fits[one.fit] for one in found),
        poses=np.array(poses).reshape(-1, 3),
        faces=np.array([one.face for one in found], np.int64),
        losses=np.array([one.score - most for one in found]),
    )


def _pose_in_array(embossed: EmbossedArray, fit: Fit, hypothesis: Hypothesis) -> Array:
    pitch = embossed.style.pitch_mm
    return np.array(
        [fit.x_mm + hypothesis.column * pitch, fit.y_mm - hypothesis.row * pitch, fit.theta_rad]
    )


def _lie_elsewhere(embossed: EmbossedArray, places: _TouchPlaces, at: int) -> NDArray[np.bool_]:
    """Whether places (k,) differ from one of them by half a pitch, an eighth turn or the face."""
    away = np.abs(_on_torus(embossed, places.poses - places.poses[at]))
    near = (away[:, :2].max(axis=1) < embossed.style.pitch_mm / 2) & (away[:, 2] < math.pi / 4)
    return np.asarray(~(near & (places.faces == places.faces[at])))


def _on_torus(embossed: EmbossedArray, away: Array) -> Array:
    """Return differences (..., 3) of poses the short way round the torus."""
    array, pitch = embossed.array, embossed.style.pitch_mm
    size = np.array([array.columns * pitch, array.rows * pitch, math.tau])
    return np.asarray(away - size * np.rint(away / size))


def _step_costs(
    embossed: EmbossedArray, a: _TouchPlaces, b: _TouchPlaces, step: PlanarBelief
) -> Array:
    """Return costs (k, m) of steps from places to places, nats; infinite from face to face."""
    away = _on_torus(embossed, b.poses[None] - a.poses[:, None])
    c, s = np.cos(a.poses[:, 2, None]), np.sin(a.poses[:, 2, None])
    along = np.stack(
        [
            c * away[..., 0] + s * away[..., 1] - step.pose[0],
            c * away[..., 1] - s * away[..., 0] - step.pose[1],
            wrap_angle(away[..., 2] - step.pose[2]),
        ],
        axis=-1,
    )
    cost = 0.5 * np.einsum("kmi,ij,kmj->km", along, np.linalg.inv(step.covariance), along)
    return np.where(a.faces[:, None] == b.faces[None], cost, np.inf)


def _log_agreement(
    known: Mapping[tuple[int, int], Array], cells: Ints, own: Array, order: int
) -> float:
    """Return the log-likelihood ratio that cells show their known symbols, not random ones."""
    both = [
        (known[at], share)
        for at, share in zip(map(tuple, cells.tolist()), own, strict=True)
        if at in known
    ]
    if not both:
        return 0.0
    earlier = _probabilities(np.array([one for one, _ in both]))
    alike = (earlier * [share for _, share in both]).sum(axis=1)
    return float(np.log(order * alike).sum())


def _probabilities(scores: Array) -> Array:
    each = np.exp(scores - scores.max(axis=1, keepdims=True))
    return np.asarray(each / each.sum(axis=1, keepdims=True))
