"""Touch by touch, or all at once: mosaic + touch -> mosaic. Thesis 4.3.

`add_touch` costs what the touch's neighbours cost, and one solution of the graph; it may be called
while the sensor is on its way to the next place. `settle_mosaic` tries again what could not be
placed when it came, evens out the gains and makes all covariances exact.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.scan.mosaic.canvas import Canvas, CanvasEntry, empty_canvas, lay_touch
from recognizer.scan.mosaic.errors import MosaicError
from recognizer.scan.mosaic.graph import (
    ARM,
    Constraint,
    PoseGraphSolution,
    covariances,
    solve_pose_graph,
)
from recognizer.scan.mosaic.mosaic import ALONE, PARTLY, Mosaic, MosaicSettings, no_touches
from recognizer.scan.mosaic.pair import CONSTANT
from recognizer.scan.mosaic.patch import TouchPatch, patch_of
from recognizer.scan.mosaic.place import place_touch
from recognizer.scan.mosaic.planar import compose_poses, inverse
from recognizer.scan.mosaic.settings import GRAPH, GROW
from recognizer.scan.mosaic.texture import far_apart
from recognizer.scan.mosaic.touch import PlacedTouch

Array = NDArray[np.float64]

_SHOWN = ("", ALONE, PARTLY, CONSTANT)  # reasons with which a touch is laid


def mosaic_of(
    sensor: SensorType, touches: Iterable[PlacedTouch], settings: MosaicSettings | None = None
) -> Mosaic:
    """Return the mosaic of touches, in the order of the scan.

    Raises
    ------
    MosaicError
        Another sensor's image, or a touch that hangs on nothing.
    """
    mosaic = no_touches(sensor, settings)
    for touch in touches:
        mosaic = add_touch(mosaic, touch)
    return settle_mosaic(mosaic)


def add_touch(mosaic: Mosaic, touch: PlacedTouch) -> Mosaic:
    """Return the mosaic with one touch more.

    Parameters
    ----------
    mosaic
        Of one face; `no_touches` to begin with.
    touch
        The signal, and what is known of its place. The first decoded one turns the mosaic's
        frame into that of the face; it needs a place in the old frame too.

    Raises
    ------
    MosaicError
        Another sensor's image, or a touch that hangs on nothing.
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
        laid=(*mosaic.laid, None),
        constraints=constraints,
    )
    fresh = {number, *(constraint.a for constraint in place.constraints if constraint.a >= 0)}
    found = _solve(grown)
    doubted = [k for k, constraint in enumerate(constraints) if constraint.kind == "decoded"]
    if any(found.weights[k] < GRAPH.outlier for k in doubted):
        found = _vote_on_frame(grown, found)
    return _apply_solution(grown, found, fresh)


def settle_mosaic(mosaic: Mosaic) -> Mosaic:
    """Return the mosaic with everything tried again that failed, and exact covariances."""
    for _ in range(GROW.rounds):
        open_ = [n for n, reason in enumerate(mosaic.reasons) if reason not in ("", CONSTANT)]
        before = mosaic.reasons
        for number in open_:
            mosaic = _place_again(mosaic, number)
        if mosaic.reasons == before:
            break
    if not len(mosaic):
        return mosaic
    mosaic = replace(mosaic, gains=_gains(mosaic))
    return _apply_solution(mosaic, _solve(mosaic), set(range(len(mosaic))), anew=True)


def _clear_alone(reasons: tuple[str, ...], constraints: tuple[Constraint, ...]) -> tuple[str, ...]:
    """Return reasons without "alone" for touches that were registered from a later one."""
    met = {constraint.a for constraint in constraints if constraint.kind == "pair"}
    return tuple("" if n in met and why == ALONE else why for n, why in enumerate(reasons))


def _place_again(mosaic: Mosaic, number: int) -> Mosaic:
    """Return the mosaic with one touch placed anew."""
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
        if not mosaic.on_face or touch.believed is None or _hangs_on_arm(mosaic):
            return mosaic
        # the arm's frame is not known: nothing decoded was believed as well
        return replace(mosaic, arm_covariance=np.full((3, 3), np.inf))
    believed = touch.believed
    if believed is not None and not _hangs_on_arm(mosaic) and (mosaic.on_face or not len(mosaic)):
        mosaic = replace(mosaic, arm=compose_poses(touch.decoded.pose, inverse(believed.pose)))
    if mosaic.on_face or not len(mosaic):
        return mosaic
    if believed is None and touch.stepped is None:
        raise MosaicError(
            "the first decoded touch does not say where it stands for the arm",
            fix="give what the arm believes of it, too",
            place=f"touch {touch.seq}",
        )
    stands = place_touch(mosaic, replace(touch, decoded=None), patch, len(mosaic)).pose
    T_face_plane = compose_poses(touch.decoded.pose, inverse(stands))
    return _change_frame(mosaic, T_face_plane)


def _change_frame(mosaic: Mosaic, T_new_old: Array) -> Mosaic:
    """Return the mosaic in another frame, laid anew."""
    c, s = np.cos(T_new_old[2]), np.sin(T_new_old[2])
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    canvas, lying = empty_canvas(mosaic.sensor.pitch_mm), list(mosaic.laid)
    for n, how in enumerate(mosaic.laid):
        if how is not None:
            pose = compose_poses(T_new_old, how.pose)
            again = CanvasEntry(pose, turn @ how.covariance @ turn.T, how.gain)
            lying[n] = again
            canvas = lay_touch(canvas, mosaic.patches[n], again)
    return replace(
        mosaic,
        poses=compose_poses(T_new_old, mosaic.poses),
        covariances=turn @ mosaic.covariances @ turn.T,
        arm=compose_poses(T_new_old, mosaic.arm),
        arm_covariance=turn @ mosaic.arm_covariance @ turn.T,
        laid=tuple(lying),
        canvas=canvas,
    )


def _hangs_on_arm(mosaic: Mosaic) -> bool:
    return any(constraint.a == ARM for constraint in mosaic.constraints)


def _solve(mosaic: Mosaic) -> PoseGraphSolution:
    stands = not mosaic.on_face
    return solve_pose_graph(mosaic.constraints, mosaic.poses, mosaic.arm, arm_stands=stands)


def _vote_on_frame(mosaic: Mosaic, found: PoseGraphSolution) -> PoseGraphSolution:
    """Return a better solution, if the face lies where other decoded touches say.

    The first decoded touch decides where everything lies. If it was wrong, all later ones look
    wrong: so each of them may propose, and the cost decides.
    """
    for constraint in mosaic.constraints:
        if constraint.kind == "decoded":
            shift = compose_poses(constraint.pose, inverse(found.poses[constraint.b]))
            if far_apart(shift, np.zeros(3), mosaic.sensor) < 0.1:
                continue
            moved_ = replace(
                mosaic, poses=compose_poses(shift, found.poses), arm=compose_poses(shift, found.arm)
            )
            other = _solve(moved_)
            if other.cost < found.cost - 1e-6:
                found = other
    return found


def _apply_solution(
    mosaic: Mosaic, found: PoseGraphSolution, fresh: set[int], *, anew: bool = False
) -> Mosaic:
    """Return the mosaic with the poses of a solution, touches laid where they stand now."""
    numbers = sorted(fresh)
    free = mosaic.on_face and _hangs_on_arm(mosaic)
    spread = covariances(found.normal, [*numbers, len(mosaic)] if free else numbers)
    kept = mosaic.covariances.copy()
    kept[numbers] = spread[: len(numbers)]
    canvas = empty_canvas(mosaic.sensor.pitch_mm) if anew else mosaic.canvas
    lying: list[CanvasEntry | None] = list(mosaic.laid)
    for n in range(len(mosaic)):
        canvas, lying[n] = _lay_again(mosaic, canvas, found, n, None if anew else lying[n])
    return replace(
        mosaic,
        poses=found.poses,
        covariances=kept,
        arm=found.arm,
        arm_covariance=spread[-1] if free else np.zeros((3, 3)),
        weights=found.weights,
        chi2=found.chi2,
        laid=tuple(lying),
        canvas=canvas,
    )


def _lay_again(
    mosaic: Mosaic, canvas: Canvas, found: PoseGraphSolution, n: int, now: CanvasEntry | None
) -> tuple[Canvas, CanvasEntry | None]:
    """Return the canvas with a touch where it belongs, and how it lies there."""
    pose, gain = found.poses[n], float(mosaic.gains[n])
    shown = mosaic.reasons[n] in _SHOWN and mosaic.patches[n].scale >= 0
    if now is not None:
        near = far_apart(now.pose, pose, mosaic.sensor) < GROW.relaid
        if shown and near and abs(gain / now.gain - 1) < 0.02:
            return canvas, now
        canvas = lay_touch(canvas, mosaic.patches[n], now, -1)
    if not shown:
        return canvas, None
    block = found.normal[3 * n : 3 * n + 3, 3 * n : 3 * n + 3].toarray()
    how = CanvasEntry(np.array(pose), np.asarray(np.linalg.inv(block), np.float64), gain)
    return lay_touch(canvas, mosaic.patches[n], how), how


def _gains(mosaic: Mosaic) -> Array:
    """Return gains (n,) that agree with all pairs at once, near 1 where nothing is known."""
    n = len(mosaic)
    normal, right = np.eye(n) / GROW.spread_log**2, np.zeros(n)
    variance = GROW.sure_log**2
    for constraint, weight in zip(mosaic.constraints, mosaic.weights, strict=True):
        if constraint.kind == "pair" and weight > GRAPH.outlier:
            normal[[constraint.a, constraint.b], [constraint.a, constraint.b]] += 1 / variance
            normal[[constraint.a, constraint.b], [constraint.b, constraint.a]] -= 1 / variance
            right[constraint.b] += constraint.log_gain / variance
            right[constraint.a] -= constraint.log_gain / variance
    return np.asarray(np.exp(np.linalg.solve(normal, right)))
