"""Registration of one touch against another, or the reason why there is none. Thesis 4.3.

Two patches + believed T_a_b with its covariance + a start near the true place -> ImageRegistration.
No answer is given where nothing varies and where the place is no better than noise; `mosaic`
excludes other places that look alike before a start is taken.

Least squares (Lucas and Kanade) find displacement, turn and gain. With T = T_a_b and the tactels s
of both images,

    a(s)   = g b(T^-1 s) + o        at the tactels of a over b,
    a(T s) = g b(s)      + o        at the tactels of b over a,

g and o planes, since a tilted sensor presses more on one side. Both ways together are symmetric:
interpolation takes as much from one image as from the other, and the bias of the shift cancels.
Both contain one noise, so they count half. A belief about the pose is the prior; the information
of the images alone is returned.

Baker and Matthews, "Lucas-Kanade 20 years on", IJCV 56 (2004): the residuals of the forward and of
the inverse additive form together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.patch import (
    TouchPatch,
    covers_points,
    holding_information,
    interpolate_patch,
    restrict_information,
    scales,
    seen_motions,
)
from recognizer.scan.mosaic.planar import inverse, pose_difference, transform_points, wrap_angle
from recognizer.scan.mosaic.search import LEAST_OVERLAP, nats, window_mm

Array = NDArray[np.float64]

CONSTANT = "nothing to correlate"
APART = "too little overlap"
NOISE = "no better than noise"

CONTRAST = 0.15  #: least standard deviation of a patch about a plane, in its upper levels
SIGNIFICANCE = 8.0  #: nats over the best of as many shifts of noise

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
    """The pose of patch b on patch a; false where there is a reason."""

    pose: Array  #: (3,) T_a_b, mm and rad; the belief where there is a reason
    information: Array  #: (3, 3) inverse covariance of the images alone; may be singular
    gain: float  #: readings of a over those of b
    rho: float  #: correlation of the explained part, 0 ... 1; NaN where there is a reason
    tactels: float = 0.0  #: of the overlap, mean of both ways
    reason: str = ""  #: why it is refused; "" if it is found

    def __bool__(self) -> bool:
        return not self.reason


def register_patches(
    a: TouchPatch, b: TouchPatch, believed: Array, covariance: Array, start: Array
) -> ImageRegistration:
    """Return T_a_b of two patches of one sensor near `start` (3,), or the belief with a reason.

    `believed` (3,) in mm and rad has `covariance` (3, 3).
    """

    def refused(reason: str) -> ImageRegistration:
        none = np.zeros((3, 3)), math.nan, math.nan
        return ImageRegistration(np.array(believed), *none, reason=reason)

    reason = _reject_reason(a, b, believed, math.hypot(*window_mm(covariance)))
    if reason:
        return refused(reason)
    prior: Array = np.asarray(np.linalg.inv(covariance), np.float64)
    best = align_patches(a, b, start, believed, prior)
    if best is None or nats(np.array(best.rho), np.array(best.tactels)) < SIGNIFICANCE:
        return refused(NOISE)
    on_b = transform_points(inverse(best.pose), a.points_mm)
    motions = seen_motions(a, a.good.reshape(-1) & covers_points(a.sensor, on_b), best.pose)
    if motions.shape[1] == 0:
        return refused(CONSTANT)
    if motions.shape[1] < 3:  # align again in the visible motions; all others stay as believed
        away, unit = pose_difference(best.pose, believed), scales(a.sensor)
        start = believed + unit * (motions @ (motions.T @ (away / unit)))
        held = prior + holding_information(motions, a.sensor)
        best = align_patches(a, b, start, believed, held)
        if best is None:
            return refused(NOISE)
    information = restrict_information(best.information, motions, a.sensor, covariance)
    return replace(best, information=information, gain=best.gain * a.scale / b.scale)


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
) -> ImageRegistration | None:
    """Return the pose that explains both images best, or None where there is none near.

    `start` (3,) T_a_b is wrong by up to about half a tactel; `believed` (3,) has the inverse
    covariance `prior` (3, 3), zeros for no belief. The gain is in units of the patches.
    """
    pitch = a.sensor.pitch_mm
    pose = np.asarray(start, np.float64)
    for done in range(1, STEPS + 1):
        rows = _rows(a, b, pose)
        found = None if rows is None else _solve_step(rows, pose, believed, prior)
        if rows is None or found is None:
            return None
        step, information, gain, rho = found
        shift = np.clip(step[:2], -FARTHEST * pitch, FARTHEST * pitch)
        turn = min(WIDEST_RAD, max(-WIDEST_RAD, float(step[2])))
        moves = max(np.abs(shift).max(), abs(turn) * a.sensor.reach_mm)
        if moves < DONE * pitch or done == STEPS:
            return ImageRegistration(pose, information, gain, rho, len(rows.target) / 2)
        pose = np.append(pose[:2] + shift, wrap_angle(pose[2] + turn))
        if math.hypot(*(pose[:2] - start[:2])) > REACH * pitch:
            return None
    return None


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


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Both ways of comparing, one row for each tactel."""

    target: Array  #: (m,) a
    values: Array  #: (m,) b
    plane: Array  #: (m, 3) 1, x, y from the middle of the overlap, in half widths
    slopes_b: Array  #: (n, 3) of b by the pose, in the first n rows, which interpolate b
    slopes_a: Array  #: (m - n, 3) of a by the pose, in the others, which interpolate a


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


def _solve_step(
    rows: _Rows, pose: Array, believed: Array, prior: Array
) -> tuple[Array, Array, float, float] | None:
    """Return step (3,), information (3, 3), gain and correlation; None where images differ."""
    target, n = rows.target, len(rows.slopes_b)
    nuisance = np.concatenate([rows.values[:, None] * rows.plane, rows.plane], axis=1)
    ridge = np.diag([1e-9, 1.0, 1.0, 1e-9, 1.0, 1.0]) * (FLOOR / GAIN_SLOPE) ** 2
    gain = np.linalg.solve(nuisance.T @ nuisance + ridge, nuisance.T @ target)
    if gain[0] <= 0:
        return None
    residual = target - nuisance @ gain
    spread = max(FLOOR, 1.4826 * float(np.median(np.abs(residual))))
    weights = 1.0 / (1.0 + (residual / (CUT * spread)) ** 2) ** 2
    variance = max(FLOOR**2, float(weights @ residual**2 / weights.sum()))
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
    return step, information, float(gain[0]), math.sqrt(max(0.0, explained))
