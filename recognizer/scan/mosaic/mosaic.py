"""The mosaic of a face: touches, their poses and covariances, and the image. Thesis 4.3.

Its frame is that of the face as soon as one touch is decoded, until then that of the arm's plane.

`place_touch` finds a start and constraints for one more touch. A decoded touch has its pose; images
of neighbours only check it. Any other touch is searched for on the mean of all touches near it,
which shows more than each of them and excludes more places that look alike; then it is registered
with each neighbour.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.errors import MosaicError
from recognizer.scan.mosaic.canvas import (
    Canvas,
    CanvasEntry,
    GlobalImage,
    add_to_canvas,
    empty_canvas,
    image_of,
    reference,
)
from recognizer.scan.mosaic.patch import TouchPatch, covers_points, scales, seen_motions
from recognizer.scan.mosaic.planar import (
    PlacedTouch,
    PlanarBelief,
    compose_poses,
    composed_covariance,
    pose_difference,
    relative_covariance,
    relative_pose,
    rotation,
    transform_points,
)
from recognizer.scan.mosaic.pose_graph import (
    ARM,
    FREE_CHI2,
    OUTLIER_WEIGHT,
    PLANE,
    Constraint,
    Kind,
    robust_cost,
)
from recognizer.scan.mosaic.register import (
    AMBIGUOUS,
    CONSTANT,
    MARGIN,
    MARGIN_BEYOND,
    NEAR_TACTELS,
    NOISE,
    SIGNIFICANCE,
    ImageRegistration,
    register_patches,
    shows_texture,
)
from recognizer.scan.mosaic.search import SIGMAS, search_reference, window_mm

Array = NDArray[np.float64]

ALONE = "no neighbour"
PARTLY = "in one direction only"

PERIOD_MM = 7.0  #: pitch of symbols, after which the surface looks alike
PARTNERS = 4  #: neighbours that a touch is registered with
PARTNERS_DECODED = 2  #: of a decoded touch: they only check it
LEAST_COMMON = 0.3  #: share of the matrix that partners have in common
WIDENED_TACTELS = 0.5  #: standard deviation added to beliefs while images are compared
INFLATION = 1.5  #: of pairs' covariance: pairs of one touch share its noise; measured


@dataclass(frozen=True, slots=True, eq=False)
class Mosaic:
    """A value; `grow.add_touch` returns the next one."""

    sensor: SensorType
    period_mm: float  #: after which the surface looks alike; inf: never
    touches: tuple[PlacedTouch, ...]
    patches: tuple[TouchPatch, ...]
    poses: Array  #: (n, 3) T_plane_touch, mm and rad
    covariances: Array  #: (n, 3, 3); of older touches too large until `grow.settle_mosaic`
    reasons: tuple[str, ...]  #: "" where decoded or registered, otherwise why not
    gains: Array  #: (n,) factors that make the readings of touches equal
    arm: Array  #: (3,) T_plane_arm
    arm_covariance: Array  #: (3, 3); zero where the arm's plane is the frame
    constraints: tuple[Constraint, ...]
    weights: Array  #: (m,) of the constraints
    chi2: Array  #: (m,)
    entries: tuple[CanvasEntry | None, ...]  #: of each touch on the canvas
    canvas: Canvas

    def __len__(self) -> int:
        return len(self.touches)

    @property
    def on_face(self) -> bool:
        """Whether the frame is that of the face; otherwise that of the arm's plane."""
        return any(touch.decoded is not None for touch in self.touches)

    @property
    def image(self) -> GlobalImage:
        """The global tactile image."""
        return image_of(self.canvas)

    def frame_pose(self, frame: int) -> Array:
        """Return the pose (3,) of a touch by its number, of ARM or PLANE."""
        if frame == PLANE:
            return np.zeros(3)
        return self.arm if frame == ARM else np.asarray(self.poses[frame])


@dataclass(frozen=True, slots=True, eq=False)
class Outlier:
    """A constraint that disagrees with all others and is switched off."""

    constraint: Constraint
    chi2: float  #: of three numbers; 0.1 % of good ones pass 16


@dataclass(frozen=True, slots=True, eq=False)
class TouchPlacement:
    """Start and constraints of a new touch."""

    pose: Array  #: (3,) T_plane_touch to start from
    constraints: tuple[Constraint, ...]
    gain: float
    reason: str  #: "" where decoded or registered in all directions


def no_touches(sensor: SensorType, period_mm: float = PERIOD_MM) -> Mosaic:
    """Return an empty mosaic.

    Raises
    ------
    MosaicError
        The sensor's rows have another pitch than its columns.
    """
    if sensor.row_pitch_mm:
        raise MosaicError(
            f"rows are {sensor.row_pitch_mm:g} mm apart, columns {sensor.pitch_mm:g} mm",
            fix="read single touches (Reader), or scans by poses; mosaics need one pitch",
        )
    return Mosaic(
        sensor=sensor,
        period_mm=period_mm,
        touches=(),
        patches=(),
        poses=np.zeros((0, 3)),
        covariances=np.zeros((0, 3, 3)),
        reasons=(),
        gains=np.zeros(0),
        arm=np.zeros(3),
        arm_covariance=np.zeros((3, 3)),
        constraints=(),
        weights=np.zeros(0),
        chi2=np.zeros(0),
        entries=(),
        canvas=empty_canvas(sensor.pitch_mm),
    )


def outliers(mosaic: Mosaic) -> list[Outlier]:
    """Return the constraints that are switched off, the worst first."""
    found = [
        Outlier(constraint, float(chi2))
        for constraint, weight, chi2 in zip(
            mosaic.constraints, mosaic.weights, mosaic.chi2, strict=True
        )
        if weight < OUTLIER_WEIGHT
    ]
    return sorted(found, key=lambda outlier: -outlier.chi2)


def place_touch(
    mosaic: Mosaic, touch: PlacedTouch, patch: TouchPatch, number: int
) -> TouchPlacement:
    """Return start and constraints of a touch; the mosaic may contain it under its number."""
    given = _given_constraints(touch, number)
    predicted = _predict_pose(mosaic, touch, number)
    if touch.decoded is not None and _contradicts_decoded(mosaic, touch, number):
        # neighbours decide which source is right
        other = place_touch(mosaic, replace(touch, decoded=None), patch, number)
        if not other.reason:
            return replace(other, constraints=(given[0], *other.constraints))
    near = _overlapping_neighbours(mosaic, patch, predicted, number)
    reason, start = _search_mosaic(mosaic, patch, predicted, near, number)
    pairs: list[tuple[int, ImageRegistration]] = []
    if not reason:
        pairs = _register_neighbours(mosaic, patch, predicted, start, near)
    softer = 1 / INFLATION
    constraints = given + [
        Constraint(j, number, pair.pose, pair.information * softer, "pair", math.log(pair.gain))
        for j, pair in pairs
        if pair
    ]
    registered = [constraint for constraint in constraints if constraint.kind == "pair"]
    if touch.decoded is not None:
        reason = ""
    elif not reason and not registered:
        reason = pairs[0][1].reason if pairs else ALONE
    elif registered and _rank(mosaic, registered) < 3:
        reason = PARTLY
    starts = [predicted.pose, start]
    starts += [
        compose_poses(mosaic.frame_pose(constraint.a), constraint.pose)
        for constraint in constraints
        if constraint.a != ARM
    ]
    pose = min(starts, key=lambda pose: _disagreement(mosaic, constraints, pose))
    return TouchPlacement(pose, tuple(constraints), _gain(mosaic, pairs), reason)


def _given_constraints(touch: PlacedTouch, number: int) -> list[Constraint]:
    """Return the constraints by arm, steps and reader."""

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
    """Whether a decoded pose contradicts the arm or the step."""
    if touch.decoded is None or not len(mosaic) or not (touch.believed or touch.stepped):
        return False
    expected = _predict_pose(mosaic, replace(touch, decoded=None), number)
    away = pose_difference(touch.decoded.pose, expected.pose)
    spread = expected.covariance + touch.decoded.covariance
    return float(away @ np.linalg.solve(spread, away)) > FREE_CHI2


def _predict_pose(mosaic: Mosaic, touch: PlacedTouch, number: int) -> PlanarBelief:
    """Return the expected pose of a touch, without its image."""
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
            "a touch without a frame: no touch before it connects the arm to the face",
            fix="give one touch both a decoded place and the arm's pose",
            place=f"touch {touch.seq}",
        )
    return min(found, key=lambda place: float(np.trace(place.covariance[:2, :2])))


def _overlapping_neighbours(
    mosaic: Mosaic, patch: TouchPatch, predicted: PlanarBelief, number: int
) -> list[int]:
    """Return the neighbours for registration, the largest overlap first."""
    sensor = mosaic.sensor
    away = np.hypot(*(mosaic.poses[:, :2] - predicted.pose[:2]).T)
    some = [j for j in np.flatnonzero(away < 2 * sensor.reach_mm).tolist() if j != number]
    shares = {}
    for j in some:
        if mosaic.entries[j] is not None and mosaic.reasons[j] != CONSTANT:
            T_j_touch = relative_pose(mosaic.poses[j], predicted.pose)
            shares[j] = float(
                covers_points(sensor, transform_points(T_j_touch, patch.points_mm), 0.5).mean()
            )
    order = sorted(shares, key=lambda j: -shares[j])
    decoded = float(np.trace(predicted.covariance[:2, :2])) < (0.2 * sensor.pitch_mm) ** 2
    count = PARTNERS_DECODED if decoded else PARTNERS
    return [j for j in order if shares[j] >= LEAST_COMMON][:count]


def _search_mosaic(
    mosaic: Mosaic,
    patch: TouchPatch,
    predicted: PlanarBelief,
    near: Sequence[int],
    number: int,
) -> tuple[str, Array]:
    """Return the pose of a touch on the mean of the others, and a reason or ""."""
    pitch = mosaic.sensor.pitch_mm
    good = patch.good.reshape(-1)
    if patch.scale <= 0 or not shows_texture(patch, good):
        return CONSTANT, predicted.pose
    if not near:
        return ALONE, predicted.pose
    spread = predicted.covariance + mosaic.covariances[near[0]]
    reach = window_mm(spread)
    turn = SIGMAS * math.sqrt(spread[2, 2]) * mosaic.sensor.reach_mm
    if max(*reach, turn) <= NEAR_TACTELS * pitch:
        return "", predicted.pose
    canvas = mosaic.canvas
    if number < len(mosaic) and (own := mosaic.entries[number]) is not None:
        canvas = add_to_canvas(canvas, patch, own, -1)
    around = mosaic.sensor.reach_mm + math.hypot(*reach) + pitch
    shown = reference(canvas, float(predicted.pose[0]), float(predicted.pose[1]), around)
    found = search_reference(shown, patch, predicted.pose, spread)
    if not found.candidates:
        return NOISE, predicted.pose
    best = found.candidates[0]
    if best.images < SIGNIFICANCE + math.log(found.tried):
        return NOISE, predicted.pose
    motions = seen_motions(patch, good, np.zeros(3))
    back = rotation(-float(best.pose[2]))  # to the patch's axes
    beyond = max(reach) > mosaic.period_mm / 2
    least = MARGIN_BEYOND if beyond else MARGIN
    for other in found.candidates[1:]:
        away = pose_difference(other.pose, best.pose)
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
    widened = (WIDENED_TACTELS * scales(mosaic.sensor)) ** 2
    pairs = []
    for j in near:
        at, sure = mosaic.poses[j], mosaic.covariances[j]
        belief = relative_covariance(at, predicted.pose, sure, predicted.covariance)
        pair = register_patches(
            mosaic.patches[j],
            patch,
            relative_pose(at, predicted.pose),
            belief + np.diag(widened),
            starts=[relative_pose(at, start)],
            period_mm=mosaic.period_mm,
        )
        pairs.append((j, pair))
    return pairs


def _rank(mosaic: Mosaic, constraints: Sequence[Constraint]) -> int:
    """Return the number of motions of a touch that its pairs define."""
    unit = scales(mosaic.sensor)
    total = np.zeros((3, 3))
    for constraint in constraints:
        turned = rotation(float(mosaic.poses[constraint.a][2]))
        total += turned @ constraint.information @ turned.T * np.outer(unit, unit)
    values = np.linalg.eigvalsh(total)
    return int((values > 4.0).sum())  # half a tactel


def _disagreement(mosaic: Mosaic, constraints: Sequence[Constraint], pose: Array) -> float:
    """Return the robust cost of a touch's constraints at a pose."""
    chi2 = []
    for constraint in constraints:
        at = relative_pose(mosaic.frame_pose(constraint.a), pose)
        away = pose_difference(at, constraint.pose)
        chi2.append(float(away @ constraint.information @ away))
    return float(robust_cost(np.array(chi2))[0].sum())


def _gain(mosaic: Mosaic, pairs: Sequence[tuple[int, ImageRegistration]]) -> float:
    """Return the factor that makes the readings of a touch equal to its neighbours'."""
    found = [(mosaic.gains[j] * pair.gain, pair.rho) for j, pair in pairs if pair]
    if not found:
        return 1.0
    logs, weights = np.log([g for g, _ in found]), np.array([rho for _, rho in found]) ** 2
    return float(np.exp(weights @ logs / weights.sum()))
