"""One touch against another: where the second lies on the first, or why it cannot be told.

Two patches + believed T_a_b with its covariance -> ImageRegistration. `search` looks through the
window that the belief leaves, `lucas_kanade` refines its best maxima, and they are compared
by what they explain. No answer is given where there is nothing to correlate, where the best
place is no better than noise would give, and where another one is nearly as good: surfaces
with symbols look alike one pitch away, so once the window passes half a pitch the images
themselves must exclude all other places. Thesis 4.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.lucas_kanade import Alignment, align_patches
from recognizer.scan.mosaic.patch import TouchPatch, covers_points
from recognizer.scan.mosaic.planar import inverse, transform_points, wrap_angle
from recognizer.scan.mosaic.raster import magnify_patch
from recognizer.scan.mosaic.search import nats, search_reference, window_mm
from recognizer.scan.mosaic.settings import ImageSearchSettings
from recognizer.scan.mosaic.texture import (
    far_apart,
    holding_information,
    restrict_information,
    scales,
    seen_motions,
)

Array = NDArray[np.float64]

CONSTANT = "nothing to correlate"
APART = "too little overlap"
NOISE = "no better than noise"
AMBIGUOUS = "more than one place"


@dataclass(frozen=True, slots=True, eq=False)
class ImageRegistration:
    """How the second patch lies on the first."""

    pose: Array  #: (3,) T_a_b, mm and rad; the belief where there is a reason
    covariance: Array  #: (3, 3), of images and belief together
    information: Array  #: (3, 3) inverse covariance of the images alone; singular if rank < 3
    rank: int  #: motions that the images define: 2 along a ridge, 0 where there is a reason
    gain: float  #: readings of a over those of b
    rho: float  #: correlation; NaN where undefined
    margin: float  #: nats over the next place; inf if there is none
    reason: str = ""  #: "" where it is found

    def __bool__(self) -> bool:
        return not self.reason


def register_patches(
    a: TouchPatch,
    b: TouchPatch,
    believed: Array,
    covariance: Array,
    *,
    starts: Sequence[Array] | None = None,
    period_mm: float = math.inf,
    settings: ImageSearchSettings | None = None,
) -> ImageRegistration:
    """Register two patches.

    Parameters
    ----------
    a, b
        Of one sensor.
    believed, covariance
        T_a_b (3,) in mm and rad, and (3, 3).
    starts
        Poses (3,) to refine; found by `search` if not given.
    period_mm
        Distance after which the surface looks alike: the pitch of symbols; inf for others.
    settings
        Limits.

    Returns
    -------
    ImageRegistration
        With a reason, and the belief as its pose, where the place cannot be told.
    """
    limits = settings or ImageSearchSettings()
    reach = window_mm(covariance, limits)
    reason = _reject_reason(a, b, believed, limits, math.hypot(*reach))
    if reason:
        return refused_registration(believed, covariance, reason)
    prior: Array = np.asarray(np.linalg.inv(covariance), np.float64)
    tried = 1.0
    if starts is None:
        turn = limits.sigmas * math.sqrt(covariance[2, 2]) * a.sensor.reach_mm
        starts = [believed]
        if max(*reach, turn) > limits.near_tactels * a.sensor.pitch_mm:
            found = search_reference(magnify_patch(a), b, believed, covariance, limits)
            starts, tried = [candidate.pose for candidate in found.candidates], found.tried
    refined: list[tuple[float, float, Alignment]] = []
    for start in starts:
        match = align_patches(a, b, start, believed, prior)
        if match is None:
            continue
        away = match.pose - believed
        away[2] = wrap_angle(away[2])
        images = float(nats(np.array(match.rho), np.array(match.tactels), limits))
        refined.append((images - 0.5 * float(away @ prior @ away), images, match))
    refined.sort(key=lambda item: -item[0])
    if not refined or refined[0][1] < limits.significance + math.log(tried):
        return refused_registration(believed, covariance, NOISE)
    score, _, best = refined[0]
    over = a.good.reshape(-1) & covers_points(
        a.sensor, transform_points(inverse(best.pose), a.points_mm)
    )
    motions = seen_motions(a, over, best.pose)
    if motions.shape[1] == 0:
        return refused_registration(believed, covariance, CONSTANT)
    if motions.shape[1] < 3:
        again = _align_seen_motions(a, b, best, motions, believed, prior)
        if again is None:
            return refused_registration(believed, covariance, NOISE)
        best = again
    information = restrict_information(best.information, motions, a.sensor, covariance)
    others = [
        v for v, _, other in refined[1:] if _is_elsewhere(best.pose, other.pose, information, a)
    ]
    margin = score - max(others, default=-math.inf)
    if margin < (limits.margin_beyond if max(reach) > period_mm / 2 else limits.margin):
        return refused_registration(believed, covariance, AMBIGUOUS, margin)
    return ImageRegistration(
        pose=best.pose,
        covariance=np.asarray(np.linalg.inv(information + prior), np.float64),
        information=information,
        rank=motions.shape[1],
        gain=best.gain * a.scale / b.scale,
        rho=best.rho,
        margin=margin,
    )


def refused_registration(
    believed: Array, covariance: Array, reason: str, margin: float = 0.0
) -> ImageRegistration:
    """Return a registration that says nothing but why."""
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


def shows_texture(patch: TouchPatch, over: NDArray[np.bool_], contrast: float) -> bool:
    """Whether a patch shows more than a plane on some of its tactels (n,)."""
    values = patch.values.reshape(-1)[over]
    if len(values) < 4:
        return False
    plane = np.column_stack([np.ones(len(values)), patch.points_mm[over] / patch.sensor.half_mm])
    rest = values - plane @ np.linalg.lstsq(plane, values, rcond=None)[0]
    return bool(rest.std() > contrast)


def _reject_reason(
    a: TouchPatch, b: TouchPatch, believed: Array, limits: ImageSearchSettings, reach_mm: float
) -> str:
    """Return why two patches cannot be registered, before anything is tried; or nothing."""
    if min(a.scale, b.scale) <= 0:
        return CONSTANT
    for patch, T_patch_other in ((a, believed), (b, inverse(believed))):
        there = transform_points(inverse(T_patch_other), patch.points_mm)
        beyond = reach_mm / patch.sensor.pitch_mm + 0.5
        over = patch.good.reshape(-1) & covers_points(patch.sensor, there, beyond)
        if over.sum() < limits.overlap * over.size:
            return APART
        if not shows_texture(patch, over, limits.contrast):
            return CONSTANT
    return ""


def _align_seen_motions(
    a: TouchPatch, b: TouchPatch, found: Alignment, motions: Array, believed: Array, prior: Array
) -> Alignment | None:
    """Align again in the motions that are seen; what they leave open stays as believed."""
    away = found.pose - believed
    away[2] = wrap_angle(away[2])
    unit = scales(a.sensor)
    start = believed + unit * (motions @ (motions.T @ (away / unit)))
    return align_patches(a, b, start, believed, prior + holding_information(motions, a.sensor))


def _is_elsewhere(best: Array, other: Array, information: Array, a: TouchPatch) -> bool:
    """Whether two candidates differ by more than the images leave open (along an edge, say)."""
    away = other - best
    away[2] = wrap_angle(away[2])
    far = far_apart(other, best, a.sensor) > 0.5
    return far and float(away @ information @ away) > 9.0
