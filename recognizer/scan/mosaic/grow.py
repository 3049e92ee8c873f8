"""A mosaic grows touch by touch, or by all touches at once. Thesis 4.3.

`add_touch` costs the registration of the touch with its neighbours and one solution of the pose
graph; it may run while the sensor is on its way to the next place. `settle_mosaic` tries again to
place touches that failed, evens out the gains and makes all covariances exact.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.errors import MosaicError
from recognizer.scan.mosaic.canvas import Canvas, CanvasEntry, add_to_canvas, empty_canvas
from recognizer.scan.mosaic.mosaic import (
    ALONE,
    PARTLY,
    PERIOD_MM,
    Mosaic,
    no_touches,
    place_touch,
)
from recognizer.scan.mosaic.patch import TouchPatch, far_apart, patch_of
from recognizer.scan.mosaic.planar import PlacedTouch, compose_poses, inverse, rotation
from recognizer.scan.mosaic.pose_graph import (
    ARM,
    OUTLIER_WEIGHT,
    Constraint,
    PoseGraphSolution,
    covariances,
    solve_pose_graph,
)
from recognizer.scan.mosaic.register import CONSTANT

Array = NDArray[np.float64]

SHOWN = ("", ALONE, PARTLY, CONSTANT)  #: reasons with which a touch is part of the image
MOVED_TACTELS = 0.2  #: less than one cell, by which a pose changes before its entry does
ROUNDS = 3  #: in which touches are tried again
GAIN_SPREAD_LOG = 0.5  #: standard deviation of gains from touch to touch
PAIR_SPREAD_LOG = 0.05  #: standard deviation of the gain of a pair


def mosaic_of(
    sensor: SensorType, touches: Iterable[PlacedTouch], period_mm: float = PERIOD_MM
) -> Mosaic:
    """Return the mosaic of touches, in the order of the scan.

    Raises
    ------
    MosaicError
        Another sensor's image, or a touch without a frame.
    """
    mosaic = no_touches(sensor, period_mm)
    for touch in touches:
        mosaic = add_touch(mosaic, touch)
    return settle_mosaic(mosaic)


def add_touch(mosaic: Mosaic, touch: PlacedTouch) -> Mosaic:
    """Return the mosaic of one face with one touch added; the first is `no_touches`.

    The first decoded touch turns the mosaic's frame into that of the face; it needs a place in the
    old frame, too.

    Raises
    ------
    MosaicError
        Another sensor's image, or a touch without a frame.
    """
    shape = touch.signal.forces.shape
    if shape != (mosaic.sensor.rows, mosaic.sensor.columns):
        raise MosaicError(
            f"an image of {shape[0]} x {shape[1]} tactels",
            fix=f"the sensor has {mosaic.sensor.rows} x {mosaic.sensor.columns}",
            place=f"touch {touch.seq}",
        )
    number = len(mosaic)
    patch = patch_of(mosaic.sensor, touch.signal)
    mosaic = _frame_for_touch(mosaic, touch, patch)
    place = place_touch(mosaic, touch, patch, number)
    constraints = mosaic.constraints + place.constraints
    grown = replace(
        mosaic,
        touches=(*mosaic.touches, touch),
        patches=(*mosaic.patches, patch),
        poses=np.concatenate([mosaic.poses, place.pose[None]]),
        covariances=np.concatenate([mosaic.covariances, np.full((1, 3, 3), np.nan)]),
        reasons=(*_clear_alone(mosaic.reasons, place.constraints), place.reason),
        gains=np.append(mosaic.gains, place.gain),
        entries=(*mosaic.entries, None),
        constraints=constraints,
    )
    fresh = {number, *(constraint.a for constraint in place.constraints if constraint.a >= 0)}
    found = _solve(grown)
    doubted = [k for k, constraint in enumerate(constraints) if constraint.kind == "decoded"]
    if any(found.weights[k] < OUTLIER_WEIGHT for k in doubted):
        found = _vote_on_frame(grown, found)
    return _apply_solution(grown, found, fresh)


def settle_mosaic(mosaic: Mosaic) -> Mosaic:
    """Return the mosaic with failed touches tried again, and exact covariances."""
    for _ in range(ROUNDS):
        open_ = [n for n, reason in enumerate(mosaic.reasons) if reason not in ("", CONSTANT)]
        before = mosaic.reasons
        for number in open_:
            mosaic = _place_again(mosaic, number)
        if mosaic.reasons == before:
            break
    if not len(mosaic):
        return mosaic
    mosaic = replace(mosaic, gains=_gains(mosaic))
    return _apply_solution(mosaic, _solve(mosaic), set(range(len(mosaic))), again=True)


def _clear_alone(reasons: tuple[str, ...], constraints: tuple[Constraint, ...]) -> tuple[str, ...]:
    """Return reasons without ALONE for touches that a later one was registered with."""
    met = {constraint.a for constraint in constraints if constraint.kind == "pair"}
    return tuple("" if n in met and why == ALONE else why for n, why in enumerate(reasons))


def _place_again(mosaic: Mosaic, number: int) -> Mosaic:
    """Return the mosaic with one touch placed again."""
    touch = mosaic.touches[number]
    place = place_touch(mosaic, touch, mosaic.patches[number], number)
    known = {constraint.b for constraint in mosaic.constraints if constraint.a == number}
    pairs = tuple(
        constraint
        for constraint in place.constraints
        if constraint.kind == "pair" and constraint.a not in known
    )
    if not pairs and place.reason != CONSTANT:
        return mosaic
    others = tuple(
        constraint
        for constraint in mosaic.constraints
        if constraint.kind != "pair" or constraint.b != number
    )
    poses, gains, reasons = mosaic.poses.copy(), mosaic.gains.copy(), list(mosaic.reasons)
    poses[number], gains[number], reasons[number] = place.pose, place.gain, place.reason
    tried = replace(
        mosaic, poses=poses, gains=gains, reasons=tuple(reasons), constraints=others + pairs
    )
    return _apply_solution(tried, _solve(tried), {number})


def _frame_for_touch(mosaic: Mosaic, touch: PlacedTouch, patch: TouchPatch) -> Mosaic:
    """Return the mosaic in the frame in which a touch can be placed."""
    if touch.decoded is None:
        if not mosaic.on_face or touch.believed is None or _uses_arm(mosaic):
            return mosaic
        # the arm's frame is not known: no decoded touch has a pose by the arm
        return replace(mosaic, arm_covariance=np.full((3, 3), np.inf))
    believed = touch.believed
    if believed is not None and not _uses_arm(mosaic) and (mosaic.on_face or not len(mosaic)):
        mosaic = replace(mosaic, arm=compose_poses(touch.decoded.pose, inverse(believed.pose)))
    if mosaic.on_face or not len(mosaic):
        return mosaic
    if believed is None and touch.stepped is None:
        raise MosaicError(
            "the first decoded touch has no pose by the arm",
            fix="give the arm's pose of it, too",
            place=f"touch {touch.seq}",
        )
    pose = place_touch(mosaic, replace(touch, decoded=None), patch, len(mosaic)).pose
    T_face_plane = compose_poses(touch.decoded.pose, inverse(pose))
    return _change_frame(mosaic, T_face_plane)


def _change_frame(mosaic: Mosaic, T_new_old: Array) -> Mosaic:
    """Return the mosaic in another frame."""
    turn = rotation(float(T_new_old[2]))
    canvas, entries = empty_canvas(mosaic.sensor.pitch_mm), list(mosaic.entries)
    for n, entry in enumerate(mosaic.entries):
        if entry is not None:
            pose = compose_poses(T_new_old, entry.pose)
            moved = CanvasEntry(pose, turn @ entry.covariance @ turn.T, entry.gain)
            entries[n] = moved
            canvas = add_to_canvas(canvas, mosaic.patches[n], moved)
    return replace(
        mosaic,
        poses=compose_poses(T_new_old, mosaic.poses),
        covariances=turn @ mosaic.covariances @ turn.T,
        arm=compose_poses(T_new_old, mosaic.arm),
        arm_covariance=turn @ mosaic.arm_covariance @ turn.T,
        entries=tuple(entries),
        canvas=canvas,
    )


def _uses_arm(mosaic: Mosaic) -> bool:
    return any(constraint.a == ARM for constraint in mosaic.constraints)


def _solve(mosaic: Mosaic) -> PoseGraphSolution:
    fixed = not mosaic.on_face
    return solve_pose_graph(mosaic.constraints, mosaic.poses, mosaic.arm, arm_fixed=fixed)


def _vote_on_frame(mosaic: Mosaic, found: PoseGraphSolution) -> PoseGraphSolution:
    """Return a better solution, if other decoded touches give the face another pose.

    The first decoded touch fixes the frame. If it is wrong, all later ones look wrong: each of them
    proposes a frame, and the cost decides.
    """
    for constraint in mosaic.constraints:
        if constraint.kind == "decoded":
            shift = compose_poses(constraint.pose, inverse(found.poses[constraint.b]))
            if far_apart(shift, np.zeros(3), mosaic.sensor) < 0.1:
                continue
            moved = replace(
                mosaic, poses=compose_poses(shift, found.poses), arm=compose_poses(shift, found.arm)
            )
            other = _solve(moved)
            if other.cost < found.cost - 1e-6:
                found = other
    return found


def _apply_solution(
    mosaic: Mosaic, found: PoseGraphSolution, fresh: set[int], *, again: bool = False
) -> Mosaic:
    """Return the mosaic with the poses of a solution, and its image with them."""
    numbers = sorted(fresh)
    free = mosaic.on_face and _uses_arm(mosaic)
    spread = covariances(found.normal, [*numbers, len(mosaic)] if free else numbers)
    kept = mosaic.covariances.copy()
    kept[numbers] = spread[: len(numbers)]
    canvas = empty_canvas(mosaic.sensor.pitch_mm) if again else mosaic.canvas
    entries: list[CanvasEntry | None] = list(mosaic.entries)
    for n in range(len(mosaic)):
        canvas, entries[n] = _move_entry(mosaic, canvas, found, n, None if again else entries[n])
    return replace(
        mosaic,
        poses=found.poses,
        covariances=kept,
        arm=found.arm,
        arm_covariance=spread[-1] if free else np.zeros((3, 3)),
        weights=found.weights,
        chi2=found.chi2,
        entries=tuple(entries),
        canvas=canvas,
    )


def _move_entry(
    mosaic: Mosaic, canvas: Canvas, found: PoseGraphSolution, n: int, now: CanvasEntry | None
) -> tuple[Canvas, CanvasEntry | None]:
    """Return the canvas with a touch at its pose, and its entry."""
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


def _gains(mosaic: Mosaic) -> Array:
    """Return gains (n,) that agree with all pairs at once, near 1 without pairs."""
    n = len(mosaic)
    normal, right = np.eye(n) / GAIN_SPREAD_LOG**2, np.zeros(n)
    variance = PAIR_SPREAD_LOG**2
    for constraint, weight in zip(mosaic.constraints, mosaic.weights, strict=True):
        if constraint.kind == "pair" and weight > OUTLIER_WEIGHT:
            normal[[constraint.a, constraint.b], [constraint.a, constraint.b]] += 1 / variance
            normal[[constraint.a, constraint.b], [constraint.b, constraint.a]] -= 1 / variance
            right[constraint.b] += constraint.log_gain / variance
            right[constraint.a] -= constraint.log_gain / variance
    return np.asarray(np.exp(np.linalg.solve(normal, right)))
