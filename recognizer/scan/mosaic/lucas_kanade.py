"""Displacement, turn and gain of two images by least squares (Lucas and Kanade). Thesis 4.3.

With T = T_a_b and the tactels s of both images,

    a(s)   = g b(T^-1 s) + o        at the tactels of a over b,
    a(T s) = g b(s)      + o        at the tactels of b over a,

g and o planes, since a tilted sensor presses more on one side. Both ways together are symmetric:
what interpolation takes from one image it takes from the other, and the bias of the shift
cancels. Both hold the same noise, so they count half. A belief about the pose goes in as a
prior; what the images alone say is returned apart from it.

Baker and Matthews, "Lucas-Kanade 20 years on", IJCV 56 (2004): the residuals of the forward
and of the inverse additive form, side by side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.patch import TouchPatch, covers_points, interpolate_patch
from recognizer.scan.mosaic.planar import inverse, transform_points, wrap_angle
from recognizer.scan.mosaic.settings import LUCAS_KANADE

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """How b lies on a."""

    pose: Array  #: (3,) T_a_b, mm and rad
    information: Array  #: (3, 3) inverse covariance from the images alone; may be singular
    gain: float  #: a over b, in the middle of the overlap, in units of the patches
    rho: float  #: correlation of what is explained, 0 ... 1
    tactels: float  #: of the overlap, mean of both ways
    steps: int


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Both ways of comparing, a row for each tactel."""

    target: Array  #: (m,) a
    values: Array  #: (m,) b
    plane: Array  #: (m, 3) 1, x, y from the middle of the overlap, in half widths
    slopes_b: Array  #: (n, 3) of b by the pose, in the first n rows, where b is asked
    slopes_a: Array  #: (m - n, 3) of a by the pose, in the others, where a is asked


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    step: Array  #: (3,)
    information: Array  #: (3, 3)
    gain: float
    rho: float


def align_patches(
    a: TouchPatch, b: TouchPatch, start: Array, believed: Array, prior: Array
) -> Alignment | None:
    """Return the pose that explains both images best, or None where there is none near.

    Parameters
    ----------
    a, b
        Images of one sensor.
    start
        (3,) T_a_b, right to about half a tactel.
    believed, prior
        (3,) T_a_b and its inverse covariance (3, 3); zeros for no belief.
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
        farthest, widest = LUCAS_KANADE.farthest * pitch, LUCAS_KANADE.widest_rad
        shift = np.clip(found.step[:2], -farthest, farthest)
        turn = min(widest, max(-widest, float(found.step[2])))
        moves = max(np.abs(shift).max(), abs(turn) * a.sensor.reach_mm)
        if moves < LUCAS_KANADE.done * pitch or steps == LUCAS_KANADE.steps:
            break
        pose = np.append(pose[:2] + shift, wrap_angle(pose[2] + turn))
        if math.hypot(*(pose[:2] - start[:2])) > LUCAS_KANADE.reach * pitch:
            return None
    tactels = len(rows.target) / 2
    return Alignment(pose, found.information, found.gain, found.rho, tactels, steps)


def _rows(a: TouchPatch, b: TouchPatch, pose: Array) -> _Rows | None:
    there, here = transform_points(inverse(pose), a.points_mm), transform_points(pose, b.points_mm)
    over_b = a.good.reshape(-1) & covers_points(a.sensor, there)
    over_a = b.good.reshape(-1) & covers_points(b.sensor, here)
    if min(over_b.sum(), over_a.sum()) < LUCAS_KANADE.least:
        return None
    v, u = there[over_b], here[over_a]
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
    target, n, floor = rows.target, len(rows.slopes_b), LUCAS_KANADE.floor
    nuisance = np.concatenate([rows.values[:, None] * rows.plane, rows.plane], axis=1)
    ridge = np.diag([1e-9, 1.0, 1.0, 1e-9, 1.0, 1.0]) * (floor / LUCAS_KANADE.slope) ** 2
    gain = np.linalg.solve(nuisance.T @ nuisance + ridge, nuisance.T @ target)
    if gain[0] <= 0:
        return None
    residual = target - nuisance @ gain
    spread = max(floor, 1.4826 * float(np.median(np.abs(residual))))
    weights = 1.0 / (1.0 + (residual / (LUCAS_KANADE.cut * spread)) ** 2) ** 2
    variance = max(floor**2, float(weights @ residual**2 / weights.sum()))
    slopes = np.concatenate(
        [rows.slopes_b * (rows.plane[:n] @ gain[:3])[:, None], -rows.slopes_a], axis=0
    )
    design = np.concatenate([slopes, nuisance], axis=1)
    scale = 1.0 / (2 * LUCAS_KANADE.inflation * variance)
    normal = (design * weights[:, None]).T @ design
    normal[3:, 3:] += ridge
    right = design.T @ (weights * residual)
    right[3:] -= ridge @ gain
    held = np.linalg.solve(normal[3:, 3:], np.column_stack([normal[3:, :3], right[3:]]))
    information = scale * (normal[:3, :3] - normal[:3, 3:] @ held[:, :3])
    information = (information + information.T) / 2
    pull = scale * (right[:3] - normal[:3, 3:] @ held[:, 3])
    away = pose - believed
    away[2] = wrap_angle(away[2])
    damping = np.diag([1e-6, 1e-6, 1e-4]) * (1 + np.trace(information))
    step = np.linalg.solve(information + prior + damping, pull - prior @ away)
    mean = float(weights @ target / weights.sum())
    total = float(weights @ (target - mean) ** 2)
    explained = 1.0 - float(weights @ residual**2) / total if total > 0 else 0.0
    return _Step(step, information, float(gain[0]), math.sqrt(max(0.0, explained)))
