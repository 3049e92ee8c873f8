"""The mosaic of a face: touches, their poses and covariances, and the image. Thesis 4.3.

Its frame is that of the face where touches are decoded, otherwise that of the arm's plane; all
touches have one kind of place. `add_touch` costs the registration of the touch with its neighbours
and one solution of the pose graph.

A decoded touch has its pose; images of neighbours only check it. Any other touch is searched for on
the mean of all touches near it, which shows more than each of them and excludes more places that
look alike; then it is registered with each neighbour.
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
from recognizer.scan.mosaic.patch import (
    TouchPatch,
    covers_points,
    far_apart,
    patch_of,
    scales,
    seen_motions,
)
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
    PLANE,
    Constraint,
    PoseGraphSolution,
    covariances,
    robust_cost,
    solve_pose_graph,
)
from recognizer.scan.mosaic.register import (
    CONSTANT,
    NOISE,
    SIGNIFICANCE,
    ImageRegistration,
    register_patches,
    shows_texture,
)
from recognizer.scan.mosaic.search import SIGMAS, search_reference, window_mm

Array = NDArray[np.float64]

ALONE = "no neighbour"
AMBIGUOUS = "more than one place"
PARTLY = "in one direction only"

NEAR_TACTELS = 0.4  #: windows no wider than this need no search
MARGIN = 3.0  #: nats over the next place, in a window within half a period
MARGIN_BEYOND = 8.0  #: in a wider window
PERIOD_MM = 7.0  #: pitch of symbols, after which the surface looks alike
PARTNERS = 4  #: neighbours that a touch is registered with
PARTNERS_DECODED = 2  #: of a decoded touch: they only check it
LEAST_COMMON = 0.3  #: share of the matrix that partners have in common
WIDENED_TACTELS = 0.5  #: standard deviation added to beliefs while images are compared
INFLATION = 1.5  #: of pairs' covariance: pairs of one touch share its noise; measured

SHOWN = ("", ALONE, PARTLY, CONSTANT)  #: reasons with which a touch is part of the image
MOVED_TACTELS = 0.2  #: less than one cell, by which a pose changes before its entry does


@dataclass(frozen=True, slots=True, eq=False)
class Mosaic:
    """A value; `add_touch` returns the next one."""

    sensor: SensorType
    period_mm: float  #: after which the surface looks alike; inf: never
    touches: tuple[PlacedTouch, ...]
    patches: tuple[TouchPatch, ...]
    poses: Array  #: (n, 3) T_plane_touch, mm and rad
    covariances: Array  #: (n, 3, 3); of older touches too large
    reasons: tuple[str, ...]  #: "" where decoded or registered, otherwise why not
    gains: Array  #: (n,) factors that make the readings of touches equal
    constraints: tuple[Constraint, ...]
    entries: tuple[CanvasEntry | None, ...]  #: of each touch on the canvas
    canvas: Canvas

    def __len__(self) -> int:
        return len(self.touches)

    @property
    def image(self) -> GlobalImage:
        """The global tactile image."""
        return image_of(self.canvas)


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
        constraints=(),
        entries=(),
        canvas=empty_canvas(sensor.pitch_mm),
    )


def add_touch(mosaic: Mosaic, touch: PlacedTouch) -> Mosaic:
    """Return the mosaic of one face with one touch added; the first is `no_touches`.

    Raises
    ------
    MosaicError
        Another sensor's image, or a touch in another frame.
    """
    shape = touch.signal.forces.shape
    if shape != (mosaic.sensor.rows, mosaic.sensor.columns):
        raise MosaicError(
            f"an image of {shape[0]} x {shape[1]} tactels",
            fix=f"the sensor has {mosaic.sensor.rows} x {mosaic.sensor.columns}",
            place=f"touch {touch.seq}",
        )
    if len(mosaic) and (touch.decoded is None) != (mosaic.touches[0].decoded is None):
        raise MosaicError(
            "touches in two frames: some are decoded, some have a pose by the arm",
            fix="give all touches a decoded place, or none",
            place=f"touch {touch.seq}",
        )
    grown = _join_touch(mosaic, touch, patch_of(mosaic.sensor, touch.signal))
    joined = (constraint.a for constraint in grown.constraints[len(mosaic.constraints) :])
    fresh = {len(mosaic), *(a for a in joined if a != PLANE)}
    return _apply_solution(grown, solve_pose_graph(grown.constraints, grown.poses), fresh)


def _join_touch(mosaic: Mosaic, touch: PlacedTouch, patch: TouchPatch) -> Mosaic:
    """Return the mosaic with a touch at the pose to start from, and its constraints."""
    number = len(mosaic)
    predicted = _predict_pose(mosaic, touch)
    near = _overlapping_neighbours(mosaic, patch, predicted)
    reason, start = _search_mosaic(mosaic, patch, predicted, near)
    pairs: list[tuple[int, ImageRegistration]] = []
    widened = np.diag((WIDENED_TACTELS * scales(mosaic.sensor)) ** 2)
    for j in near if not reason else ():
        at, sure = mosaic.poses[j], mosaic.covariances[j]
        spread = relative_covariance(at, predicted.pose, sure, predicted.covariance) + widened
        believed, near_start = relative_pose(at, predicted.pose), relative_pose(at, start)
        pair = register_patches(mosaic.patches[j], patch, believed, spread, near_start)
        pairs.append((j, pair))
    softer = 1 / INFLATION
    registered = [
        Constraint(j, number, pair.pose, pair.information * softer) for j, pair in pairs if pair
    ]
    if touch.decoded is not None:
        reason = ""
    elif not reason and not registered:
        reason = pairs[0][1].reason if pairs else ALONE
    elif registered and _rank(mosaic, registered) < 3:
        reason = PARTLY
    constraints = _given_constraints(touch, number) + registered
    starts = [predicted.pose, start]
    starts += [
        compose_poses(mosaic.poses[constraint.a], constraint.pose)
        for constraint in constraints
        if constraint.a != PLANE
    ]
    pose = min(starts, key=lambda pose: _disagreement(mosaic, constraints, pose))
    met = {constraint.a for constraint in registered}
    reasons = ["" if n in met and why == ALONE else why for n, why in enumerate(mosaic.reasons)]
    return replace(
        mosaic,
        touches=(*mosaic.touches, touch),
        patches=(*mosaic.patches, patch),
        poses=np.concatenate([mosaic.poses, pose[None]]),
        covariances=np.concatenate([mosaic.covariances, np.full((1, 3, 3), np.nan)]),
        reasons=(*reasons, reason),
        gains=np.append(mosaic.gains, _gain(mosaic, pairs)),
        entries=(*mosaic.entries, None),
        constraints=(*mosaic.constraints, *constraints),
    )


def _given_constraints(touch: PlacedTouch, number: int) -> list[Constraint]:
    places = [(PLANE, touch.decoded or touch.believed)]
    if number > 0 and touch.decoded is None:
        places.append((number - 1, touch.stepped))
    return [
        Constraint(a, number, place.pose, np.asarray(np.linalg.inv(place.covariance)))
        for a, place in places
        if place is not None
    ]


def _predict_pose(mosaic: Mosaic, touch: PlacedTouch) -> PlanarBelief:
    """Return the expected pose of a touch, without its image."""
    if touch.decoded is not None:
        return touch.decoded
    found = [] if touch.believed is None else [touch.believed]
    if touch.stepped is not None and len(mosaic):
        pose, covariance = touch.stepped.pose, touch.stepped.covariance
        before, sure = mosaic.poses[-1], mosaic.covariances[-1]
        spread = composed_covariance(before, pose, sure, covariance)
        found.append(PlanarBelief(compose_poses(before, pose), spread))
    if not found:
        raise MosaicError(
            "the first touch has a step, and no touch before it",
            fix="give it the arm's pose",
            place=f"touch {touch.seq}",
        )
    return min(found, key=lambda place: float(np.trace(place.covariance[:2, :2])))


def _overlapping_neighbours(
    mosaic: Mosaic, patch: TouchPatch, predicted: PlanarBelief
) -> list[int]:
    """Return the neighbours for registration, the largest overlap first."""
    sensor = mosaic.sensor
    away = np.hypot(*(mosaic.poses[:, :2] - predicted.pose[:2]).T)
    shares = {}
    for j in np.flatnonzero(away < 2 * sensor.reach_mm).tolist():
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
    mosaic: Mosaic, patch: TouchPatch, predicted: PlanarBelief, near: Sequence[int]
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
    around = mosaic.sensor.reach_mm + math.hypot(*reach) + pitch
    x_mm, y_mm = predicted.pose[:2].tolist()
    shown = reference(mosaic.canvas, x_mm, y_mm, around)
    candidates, tried = search_reference(shown, patch, predicted.pose, spread)
    if not candidates or candidates[0].images < SIGNIFICANCE + math.log(tried):
        return NOISE, predicted.pose
    best = candidates[0]
    motions = seen_motions(patch, good, np.zeros(3))
    back = rotation(-float(best.pose[2]))  # to the patch's axes
    beyond = max(reach) > mosaic.period_mm / 2
    least = MARGIN_BEYOND if beyond else MARGIN
    for other in candidates[1:]:
        away = pose_difference(other.pose, best.pose)
        apart = float(np.linalg.norm(motions.T @ (back @ away / scales(mosaic.sensor))))
        if apart > 1.0 and best.score - other.score < least:
            return AMBIGUOUS, predicted.pose
    return "", best.pose


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
        a = constraint.a
        at = pose if a == PLANE else relative_pose(mosaic.poses[a], pose)
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


def _apply_solution(mosaic: Mosaic, found: PoseGraphSolution, fresh: set[int]) -> Mosaic:
    """Return the mosaic with the poses of a solution, and its image with them."""
    numbers = sorted(fresh)
    kept = mosaic.covariances.copy()
    kept[numbers] = covariances(found.normal, numbers)
    canvas, entries = mosaic.canvas, list(mosaic.entries)
    for n, entry in enumerate(entries):
        canvas, entries[n] = _move_entry(mosaic, canvas, found, n, entry)
    return replace(
        mosaic, poses=found.poses, covariances=kept, entries=tuple(entries), canvas=canvas
    )


def _move_entry(
    mosaic: Mosaic, canvas: Canvas, found: PoseGraphSolution, n: int, now: CanvasEntry | None
) -> tuple[Canvas, CanvasEntry | None]:
    pose, gain = found.poses[n], float(mosaic.gains[n])
    shown = mosaic.reasons[n] in SHOWN and mosaic.patches[n].scale >= 0
    if now is not None:
        near = far_apart(now.pose, pose, mosaic.sensor) < MOVED_TACTELS
        if shown and near and abs(gain / now.gain - 1) < 0.02:
            return canvas, now
        canvas = add_to_canvas(canvas, mosaic.patches[n], now, -1)
    if not shown:
        return canvas, None
    block = found.normal[3 * n : 3 * n + 3, 3 * n : 3 * n + 3].toarray()
    entry = CanvasEntry(np.array(pose), np.asarray(np.linalg.inv(block), np.float64), gain)
    return add_to_canvas(canvas, mosaic.patches[n], entry), entry
