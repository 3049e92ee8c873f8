"""Registration of one touch against another, or the reason why there is none. Thesis 4.3.

Two patches + believed T_a_b with its covariance -> ImageRegistration. `search` looks through the
window of the belief, least squares refine its best maxima, and the refined places are compared by
how much they explain. No answer is given where nothing varies, where the best place is no better
than noise, and where another one is nearly as good: surfaces with symbols look alike one pitch
away, so once the window exceeds half a pitch the images themselves must exclude all other places.

Least squares (Lucas and Kanade) find displacement, turn and gain. With T = T_a_b and the tactels s
of both images,

    a(s)   = g b(T^-1 s) + o        at the tactels of a over b,
    a(T s) = g b(s)      + o        at the tactels of b over a,

g and o planes, since a tilted sensor presses more on one side. Both ways together are symmetric:
interpolation takes as much from one image as from the other, and the bias of the shift cancels.
Both contain one noise, so they count half. A belief about the pose is the prior; the information
of the images alone is returned separately.

Baker and Matthews, "Lucas-Kanade 20 years on", IJCV 56 (2004): the residuals of the forward and of
the inverse additive form together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.patch import (
    TouchPatch,
    covers_points,
    far_apart,
    holding_information,
    interpolate_patch,
    restrict_information,
    scales,
    seen_motions,
)
from recognizer.scan.mosaic.planar import inverse, pose_difference, transform_points, wrap_angle
from recognizer.scan.mosaic.search import (
    LEAST_OVERLAP,
    SIGMAS,
    magnify_patch,
    nats,
    search_reference,
    window_mm,
)

Array = NDArray[np.float64]

CONSTANT = "nothing to correlate"
APART = "too little overlap"
NOISE = "no better than noise"
AMBIGUOUS = "more than one place"

CONTRAST = 0.15  #: least standard deviation of a patch about a plane, in its upper levels
SIGNIFICANCE = 8.0  #: nats over the best of as many shifts of noise
MARGIN = 3.0  #: nats over the next place, in a window within half a period
MARGIN_BEYOND = 8.0  #: in a wider window
NEAR_TACTELS = 0.4  #: windows no wider than this need no search

STEPS = 12  #: of least squares, at most
REACH = 1.0  #: tactels from the start; a place farther away is another maximum
LEAST_TACTELS = 40  #: of each image over the other
FLOOR = 0.02  #: least standard deviation of a reading, share of the upper level
INFLATION = 2.6  #: of the variance: aliasing is not independent; measured on encoded faces
CUT = 6.0  #: standard deviations from which a reading counts ever less
FARTHEST = 0.4  #: tactels in one step
WIDEST_RAD = 0.1  #: in one step
DONE = 2e-3  #: tactels; a smaller step is the last one
GAIN_SLOPE = 0.5  #: standard deviation of the gain's slope, over the half width


@dataclass(frozen=True, slots=True, eq=False)
class ImageRegistration:
    """The pose of the second patch on the first."""

    pose: Array  #: (3,) T_a_b, mm and rad; the belief where there is a reason
    covariance: Array  #: (3, 3), of images and belief together
    information: Array  #: (3, 3) inverse covariance of the images alone; singular if rank < 3
    rank: int  #: motions that the images define: 2 along a ridge, 0 where there is a reason
    gain: float  #: readings of a over those of b
    rho: float  #: correlation; NaN where undefined
    margin: float  #: nats over the next place; inf if there is none
    reason: str = ""  #: why it is refused; "" if it is found

    def __bool__(self) -> bool:
        return not self.reason


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """The pose of b on a by least squares."""

    pose: Array  #: (3,) T_a_b, mm and rad
    information: Array  #: (3, 3) inverse covariance from the images alone; may be singular
    gain: float  #: a over b, in the middle of the overlap, in units of the patches
    rho: float  #: correlation of the explained part, 0 ... 1
    tactels: float  #: of the overlap, mean of both ways


def register_patches(
    a: TouchPatch,
    b: TouchPatch,
    believed: Array,
    covariance: Array,
    *,
    starts: Sequence[Array] | None = None,
    period_mm: float = math.inf,
) -> ImageRegistration:
    """Return T_a_b of two patches of one sensor, or a reason with the belief where none is certain.

    `believed` (3,) in mm and rad has `covariance` (3, 3); `starts` are poses to refine, found by
    `search` if not given; after `period_mm` the surface looks alike: the pitch of symbols, inf for
    others.
    """
    reach = window_mm(covariance)
    reason = _reject_reason(a, b, believed, math.hypot(*reach))
    if reason:
        return _refused(believed, covariance, reason)
    prior: Array = np.asarray(np.linalg.inv(covariance), np.float64)
    tried = 1.0
    if starts is None:
        turn = SIGMAS * math.sqrt(covariance[2, 2]) * a.sensor.reach_mm
        starts = [believed]
        if max(*reach, turn) > NEAR_TACTELS * a.sensor.pitch_mm:
            found = search_reference(magnify_patch(a), b, believed, covariance)
            starts, tried = [candidate.pose for candidate in found.candidates], found.tried
    refined: list[tuple[float, float, Alignment]] = []
    for start in starts:
        match = align_patches(a, b, start, believed, prior)
        if match is None:
            continue
        away = pose_difference(match.pose, believed)
        images = float(nats(np.array(match.rho), np.array(match.tactels)))
        refined.append((images - 0.5 * float(away @ prior @ away), images, match))
    refined.sort(key=lambda item: -item[0])
    if not refined or refined[0][1] < SIGNIFICANCE + math.log(tried):
        return _refused(believed, covariance, NOISE)
    score, _, best = refined[0]
    over = a.good.reshape(-1) & covers_points(
        a.sensor, transform_points(inverse(best.pose), a.points_mm)
    )
    motions = seen_motions(a, over, best.pose)
    if motions.shape[1] == 0:
        return _refused(believed, covariance, CONSTANT)
    if motions.shape[1] < 3:
        again = _align_seen_motions(a, b, best, motions, believed, prior)
        if again is None:
            return _refused(believed, covariance, NOISE)
        best = again
    information = restrict_information(best.information, motions, a.sensor, covariance)
    others = [
        v for v, _, other in refined[1:] if _is_elsewhere(best.pose, other.pose, information, a)
    ]
    margin = score - max(others, default=-math.inf)
    if margin < (MARGIN_BEYOND if max(reach) > period_mm / 2 else MARGIN):
        return _refused(believed, covariance, AMBIGUOUS, margin)
    return ImageRegistration(
        pose=best.pose,
        covariance=np.asarray(np.linalg.inv(information + prior), np.float64),
        information=information,
        rank=motions.shape[1],
        gain=best.gain * a.scale / b.scale,
        rho=best.rho,
        margin=margin,
    )


def shows_texture(patch: TouchPatch, over: NDArray[np.bool_]) -> bool:
    """Whether a patch shows more than a plane on some of its tactels (n,)."""
    values = patch.values.reshape(-1)[over]
    if len(values) < 4:
        return False
    plane = np.column_stack([np.ones(len(values)), patch.points_mm[over] / patch.sensor.half_mm])
    rest = values - plane @ np.linalg.lstsq(plane, values, rcond=None)[0]
    return bool(rest.std() > CONTRAST)


def align_patches(
    a: TouchPatch, b: TouchPatch, start: Array, believed: Array, prior: Array
) -> Alignment | None:
    """Return the pose that explains both images best, or None where there is none near.

    `start` (3,) T_a_b is wrong by up to about half a tactel; `believed` (3,) has the inverse
    covariance `prior` (3, 3), zeros for no belief.
    """
    pitch = a.sensor.pitch_mm
    pose = np.asarray(start, np.float64)
    steps = 0
    while True:
        rows, steps = _rows(a, b, pose), steps + 1
        if rows is None:
            return None
        found = _solve_step(rows, pose, believed, prior)
        if found is None:
            return None
        farthest, widest = FARTHEST * pitch, WIDEST_RAD
        shift = np.clip(found.step[:2], -farthest, farthest)
        turn = min(widest, max(-widest, float(found.step[2])))
        moves = max(np.abs(shift).max(), abs(turn) * a.sensor.reach_mm)
        if moves < DONE * pitch or steps == STEPS:
            break
        pose = np.append(pose[:2] + shift, wrap_angle(pose[2] + turn))
        if math.hypot(*(pose[:2] - start[:2])) > REACH * pitch:
            return None
    return Alignment(pose, found.information, found.gain, found.rho, len(rows.target) / 2)


def _refused(
    believed: Array, covariance: Array, reason: str, margin: float = 0.0
) -> ImageRegistration:
    return ImageRegistration(
        pose=np.array(believed),
        covariance=np.array(covariance),
        information=np.zeros((3, 3)),
        rank=0,
        gain=math.nan,
        rho=math.nan,
        margin=margin,
        reason=reason,
    )


def _reject_reason(a: TouchPatch, b: TouchPatch, believed: Array, reach_mm: float) -> str:
    """Return the reason why two patches cannot be registered, before anything is tried; or ""."""
    if min(a.scale, b.scale) <= 0:
        return CONSTANT
    for patch, T_patch_other in ((a, believed), (b, inverse(believed))):
        in_other = transform_points(inverse(T_patch_other), patch.points_mm)
        beyond = reach_mm / patch.sensor.pitch_mm + 0.5
        over = patch.good.reshape(-1) & covers_points(patch.sensor, in_other, beyond)
        if over.sum() < LEAST_OVERLAP * over.size:
            return APART
        if not shows_texture(patch, over):
            return CONSTANT
    return ""


def _align_seen_motions(
    a: TouchPatch, b: TouchPatch, found: Alignment, motions: Array, believed: Array, prior: Array
) -> Alignment | None:
    """Align again in the visible motions; all others stay as believed."""
    away = pose_difference(found.pose, believed)
    unit = scales(a.sensor)
    start = believed + unit * (motions @ (motions.T @ (away / unit)))
    return align_patches(a, b, start, believed, prior + holding_information(motions, a.sensor))


def _is_elsewhere(best: Array, other: Array, information: Array, a: TouchPatch) -> bool:
    """Whether two candidates differ in directions that the images define (not along an edge)."""
    away = pose_difference(other, best)
    far = far_apart(other, best, a.sensor) > 0.5
    return far and float(away @ information @ away) > 9.0


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Both ways of comparing, one row for each tactel."""

    target: Array  #: (m,) a
    values: Array  #: (m,) b
    plane: Array  #: (m, 3) 1, x, y from the middle of the overlap, in half widths
    slopes_b: Array  #: (n, 3) of b by the pose, in the first n rows, which interpolate b
    slopes_a: Array  #: (m - n, 3) of a by the pose, in the others, which interpolate a


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    step: Array  #: (3,)
    information: Array  #: (3, 3)
    gain: float
    rho: float


def _rows(a: TouchPatch, b: TouchPatch, pose: Array) -> _Rows | None:
    in_b, in_a = transform_points(inverse(pose), a.points_mm), transform_points(pose, b.points_mm)
    over_b = a.good.reshape(-1) & covers_points(a.sensor, in_b)
    over_a = b.good.reshape(-1) & covers_points(b.sensor, in_a)
    if min(over_b.sum(), over_a.sum()) < LEAST_TACTELS:
        return None
    v, u = in_b[over_b], in_a[over_a]
    of_v, b_x, b_y = interpolate_patch(b, v)
    of_u, a_x, a_y = interpolate_patch(a, u)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x, y = (u - pose[:2]).T
    by_b = (s * b_y - c * b_x, -s * b_x - c * b_y, b_x * v[:, 1] - b_y * v[:, 0])
    by_a = (a_x, a_y, a_y * x - a_x * y)
    place = (np.concatenate([a.points_mm[over_b], u]) - pose[:2] / 2) / a.sensor.half_mm
    return _Rows(
        target=np.concatenate([a.values.reshape(-1)[over_b], of_u]),
        values=np.concatenate([of_v, b.values.reshape(-1)[over_a]]),
        plane=np.column_stack([np.ones(len(place)), place]),
        slopes_b=np.stack(by_b, axis=-1),
        slopes_a=np.stack(by_a, axis=-1),
    )


def _solve_step(rows: _Rows, pose: Array, believed: Array, prior: Array) -> _Step | None:
    """Return a step of pose, gain and offset together; None where the images are not alike."""
    target, n, floor = rows.target, len(rows.slopes_b), FLOOR
    nuisance = np.concatenate([rows.values[:, None] * rows.plane, rows.plane], axis=1)
    ridge = np.diag([1e-9, 1.0, 1.0, 1e-9, 1.0, 1.0]) * (floor / GAIN_SLOPE) ** 2
    gain = np.linalg.solve(nuisance.T @ nuisance + ridge, nuisance.T @ target)
    if gain[0] <= 0:
        return None
    residual = target - nuisance @ gain
    spread = max(floor, 1.4826 * float(np.median(np.abs(residual))))
    weights = 1.0 / (1.0 + (residual / (CUT * spread)) ** 2) ** 2
    variance = max(floor**2, float(weights @ residual**2 / weights.sum()))
    slopes = np.concatenate(
        [rows.slopes_b * (rows.plane[:n] @ gain[:3])[:, None], -rows.slopes_a], axis=0
    )
    design = np.concatenate([slopes, nuisance], axis=1)
    scale = 1.0 / (2 * INFLATION * variance)
    normal = (design * weights[:, None]).T @ design
    normal[3:, 3:] += ridge
    right = design.T @ (weights * residual)
    right[3:] -= ridge @ gain
    held = np.linalg.solve(normal[3:, 3:], np.column_stack([normal[3:, :3], right[3:]]))
    information = scale * (normal[:3, :3] - normal[:3, 3:] @ held[:, :3])
    information = (information + information.T) / 2
    pull = scale * (right[:3] - normal[:3, 3:] @ held[:, 3])
    away = pose_difference(pose, believed)
    damping = np.diag([1e-6, 1e-6, 1e-4]) * (1 + np.trace(information))
    step = np.linalg.solve(information + prior + damping, pull - prior @ away)
    mean = float(weights @ target / weights.sum())
    total = float(weights @ (target - mean) ** 2)
    explained = 1.0 - float(weights @ residual**2) / total if total > 0 else 0.0
    return _Step(step, information, float(gain[0]), math.sqrt(max(0.0, explained)))
