"""Where one touch belongs among those that are there: its start, and its constraints to them.

A decoded touch stands where it says; images of neighbours only check it. Any other one is
looked for on the mean of all touches near it, which shows more than each of them and so
excludes more places that look alike; then it is registered with each neighbour. Thesis 4.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.canvas import lay_touch, reference
from recognizer.scan.mosaic.errors import MosaicError
from recognizer.scan.mosaic.graph import ARM, PLANE, Constraint, Kind
from recognizer.scan.mosaic.mosaic import ALONE, PARTLY, Mosaic
from recognizer.scan.mosaic.pair import (
    AMBIGUOUS,
    CONSTANT,
    NOISE,
    ImageRegistration,
    register_patches,
    shows_texture,
)
from recognizer.scan.mosaic.patch import TouchPatch, covers_points
from recognizer.scan.mosaic.planar import (
    compose_poses,
    composed_covariance,
    relative_covariance,
    relative_pose,
    transform_points,
    wrap_angle,
)
from recognizer.scan.mosaic.search import search_reference, window_mm
from recognizer.scan.mosaic.settings import GRAPH
from recognizer.scan.mosaic.texture import scales, seen_motions
from recognizer.scan.mosaic.touch import PlacedTouch, PlanarBelief

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class TouchPlacement:
    """What is known of a touch when it comes in."""

    pose: Array  #: (3,) T_plane_touch to start from
    constraints: tuple[Constraint, ...]
    gain: float
    reason: str  #: "" where decoded or registered in all directions


def place_touch(
    mosaic: Mosaic, touch: PlacedTouch, patch: TouchPatch, number: int
) -> TouchPlacement:
    """Return where a touch belongs in a mosaic that may hold it already under this number."""
    given = _given_constraints(touch, number)
    predicted = _predict_pose(mosaic, touch, number)
    if touch.decoded is not None and _contradicts_decoded(mosaic, touch, number):
        # neighbours shall say who is right
        other = place_touch(mosaic, replace(touch, decoded=None), patch, number)
        if not other.reason:
            return replace(other, constraints=(given[0], *other.constraints))
    near = _overlapping_neighbours(mosaic, patch, predicted, number)
    reason, start = _search_mosaic(mosaic, patch, predicted, near, number)
    pairs: list[tuple[int, ImageRegistration]] = []
    if not reason:
        pairs = _register_neighbours(mosaic, patch, predicted, start, near)
    softer = 1 / mosaic.settings.inflation
    constraints = given + [
        Constraint(j, number, pair.pose, pair.information * softer, "pair", math.log(pair.gain))
        for j, pair in pairs
        if pair
    ]
    tied = [constraint for constraint in constraints if constraint.kind == "pair"]
    if touch.decoded is not None:
        reason = ""
    elif not reason and not tied:
        reason = pairs[0][1].reason if pairs else ALONE
    elif tied and _rank(mosaic, tied) < 3:
        reason = PARTLY
    starts = [predicted.pose, start]
    starts += [
        compose_poses(_pose(mosaic, constraint.a), constraint.pose)
        for constraint in constraints
        if constraint.a != ARM
    ]
    pose = min(starts, key=lambda pose: _disagreement(mosaic, constraints, pose))
    return TouchPlacement(pose, tuple(constraints), _gain(mosaic, pairs), reason)


def _given_constraints(touch: PlacedTouch, number: int) -> list[Constraint]:
    """Return what arm, steps and reader say."""

    def constraint(a: int, place: PlanarBelief, kind: Kind) -> Constraint:
        return Constraint(a, number, place.pose, np.asarray(np.linalg.inv(place.covariance)), kind)

    constraints = []
    if touch.decoded is not None:
        constraints.append(constraint(PLANE, touch.decoded, "decoded"))
    if touch.believed is not None:
        constraints.append(constraint(ARM, touch.believed, "believed"))
    if touch.stepped is not None and number > 0:
        constraints.append(constraint(number - 1, touch.stepped, "stepped"))
    return constraints


def _contradicts_decoded(mosaic: Mosaic, touch: PlacedTouch, number: int) -> bool:
    """Whether a decoded place is not where the touch should stand."""
    if touch.decoded is None or not len(mosaic) or not (touch.believed or touch.stepped):
        return False
    expected = _predict_pose(mosaic, replace(touch, decoded=None), number)
    away = touch.decoded.pose - expected.pose
    away[2] = wrap_angle(away[2])
    spread = expected.covariance + touch.decoded.covariance
    return float(away @ np.linalg.solve(spread, away)) > GRAPH.free


def _pose(mosaic: Mosaic, frame: int) -> Array:
    if frame == PLANE:
        return np.zeros(3)
    return mosaic.arm if frame == ARM else np.asarray(mosaic.poses[frame])


def _predict_pose(mosaic: Mosaic, touch: PlacedTouch, number: int) -> PlanarBelief:
    """Return where a touch should stand, before its image is looked at."""
    if touch.decoded is not None:
        return touch.decoded
    found: list[PlanarBelief] = []
    if touch.believed is not None and np.isfinite(mosaic.arm_covariance).all():
        pose, covariance = touch.believed.pose, touch.believed.covariance
        spread = composed_covariance(mosaic.arm, pose, mosaic.arm_covariance, covariance)
        found.append(PlanarBelief(compose_poses(mosaic.arm, pose), spread))
    if touch.stepped is not None and number > 0:
        pose, covariance = touch.stepped.pose, touch.stepped.covariance
        before, sure = mosaic.poses[number - 1], mosaic.covariances[number - 1]
        spread = composed_covariance(before, pose, sure, covariance)
        found.append(PlanarBelief(compose_poses(before, pose), spread))
    if not found:
        raise MosaicError(
            "a touch that hangs on nothing: no touch before it tells how its frame lies",
            fix="let one touch have both a decoded place and what the arm believes",
            place=f"touch {touch.seq}",
        )
    return min(found, key=lambda place: float(np.trace(place.covariance[:2, :2])))


def _overlapping_neighbours(
    mosaic: Mosaic, patch: TouchPatch, predicted: PlanarBelief, number: int
) -> list[int]:
    """Return neighbours that may be registered with, by overlap."""
    sensor, least = mosaic.sensor, mosaic.settings.overlap
    away = np.hypot(*(mosaic.poses[:, :2] - predicted.pose[:2]).T)
    some = [j for j in np.flatnonzero(away < 2 * sensor.reach_mm).tolist() if j != number]
    shares = {}
    for j in some:
        if mosaic.laid[j] is not None and mosaic.reasons[j] != CONSTANT:
            T_j_touch = relative_pose(mosaic.poses[j], predicted.pose)
            shares[j] = float(
                covers_points(sensor, transform_points(T_j_touch, patch.points_mm), 0.5).mean()
            )
    order = sorted(shares, key=lambda j: -shares[j])
    decoded = float(np.trace(predicted.covariance[:2, :2])) < (0.2 * sensor.pitch_mm) ** 2
    count = mosaic.settings.partners_decoded if decoded else mosaic.settings.partners
    return [j for j in order if shares[j] >= least][:count]


def _search_mosaic(
    mosaic: Mosaic,
    patch: TouchPatch,
    predicted: PlanarBelief,
    near: Sequence[int],
    number: int,
) -> tuple[str, Array]:
    """Return a reason or none, and where the touch lies on the mean of the others."""
    limits, pitch = mosaic.settings.search, mosaic.sensor.pitch_mm
    good = patch.good.reshape(-1)
    if patch.scale <= 0 or not shows_texture(patch, good, limits.contrast):
        return CONSTANT, predicted.pose
    if not near:
        return ALONE, predicted.pose
    spread = predicted.covariance + mosaic.covariances[near[0]]
    reach = window_mm(spread, limits)
    turn = limits.sigmas * math.sqrt(spread[2, 2]) * mosaic.sensor.reach_mm
    if max(*reach, turn) <= limits.near_tactels * pitch:
        return "", predicted.pose
    canvas = mosaic.canvas
    if number < len(mosaic) and (own := mosaic.laid[number]) is not None:
        canvas = lay_touch(canvas, patch, own, -1)
    around = mosaic.sensor.reach_mm + math.hypot(*reach) + pitch
    shown = reference(canvas, float(predicted.pose[0]), float(predicted.pose[1]), around)
    found = search_reference(shown, patch, predicted.pose, spread, limits)
    if not found.candidates:
        return NOISE, predicted.pose
    best = found.candidates[0]
    if best.images < limits.significance + math.log(found.tried):
        return NOISE, predicted.pose
    motions = seen_motions(patch, good, np.zeros(3))
    c, s = math.cos(best.pose[2]), math.sin(best.pose[2])
    back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])  # to the patch's axes
    beyond = max(reach) > mosaic.settings.period_mm / 2
    least = limits.margin_beyond if beyond else limits.margin
    for other in found.candidates[1:]:
        away = other.pose - best.pose
        away[2] = wrap_angle(away[2])
        apart = float(np.linalg.norm(motions.T @ (back @ away / scales(mosaic.sensor))))
        if apart > 1.0 and best.score - other.score < least:
            return AMBIGUOUS, predicted.pose
    return "", best.pose


def _register_neighbours(
    mosaic: Mosaic,
    patch: TouchPatch,
    predicted: PlanarBelief,
    start: Array,
    near: Sequence[int],
) -> list[tuple[int, ImageRegistration]]:
    settings = mosaic.settings
    loose = (settings.loose_tactels * scales(mosaic.sensor)) ** 2
    limits = replace(settings.search, near_tactels=math.inf)
    pairs = []
    for j in near:
        at, sure = mosaic.poses[j], mosaic.covariances[j]
        belief = relative_covariance(at, predicted.pose, sure, predicted.covariance)
        pair = register_patches(
            mosaic.patches[j],
            patch,
            relative_pose(at, predicted.pose),
            belief + np.diag(loose),
            starts=[relative_pose(at, start)],
            period_mm=settings.period_mm,
            settings=limits,
        )
        pairs.append((j, pair))
    return pairs


def _rank(mosaic: Mosaic, constraints: Sequence[Constraint]) -> int:
    """Return how many motions of a touch its pairs define."""
    unit = scales(mosaic.sensor)
    total = np.zeros((3, 3))
    for constraint in constraints:
        angle = float(mosaic.poses[constraint.a][2])
        c, s = math.cos(angle), math.sin(angle)
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        total += turned @ constraint.information @ turned.T * np.outer(unit, unit)
    values = np.linalg.eigvalsh(total)
    return int((values > 4.0).sum())  # half a tactel


def _disagreement(mosaic: Mosaic, constraints: Sequence[Constraint], pose: Array) -> float:
    """Return the robust cost of a touch's constraints at a pose."""
    total = 0.0
    for constraint in constraints:
        away = relative_pose(_pose(mosaic, constraint.a), pose) - constraint.pose
        away[2] = wrap_angle(away[2])
        chi2 = float(away @ constraint.information @ away)
        scale = min(1.0, 2 * GRAPH.free / (GRAPH.free + chi2))
        total += scale**2 * chi2 + GRAPH.free * (1 - scale) ** 2
    return total


def _gain(mosaic: Mosaic, pairs: Sequence[tuple[int, ImageRegistration]]) -> float:
    """Return by what the readings of a touch are to be multiplied to be like its neighbours'."""
    found = [(mosaic.gains[j] * pair.gain, pair.rho) for j, pair in pairs if pair]
    if not found:
        return 1.0
    logs, weights = np.log([g for g, _ in found]), np.array([rho for _, rho in found]) ** 2
    return float(np.exp(weights @ logs / weights.sum()))
