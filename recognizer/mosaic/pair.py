"""One touch against another: where the second lies on the first, or why it cannot be told.

Two patches + believed T_a_b with its covariance -> Registration. Normalised correlation looks
through the window that the belief leaves (three standard deviations); its best few maxima are
refined by `lucas_kanade` and compared by what they explain,

    nats = -(n / 2) log(1 - rho^2) - d^T C^-1 d / 2,

n the independent readings in the overlap, d the way from the belief. No answer is given where
there is nothing to correlate, where the best maximum is no better than noise would give, and
where another one is nearly as good: surfaces with symbols look alike one pitch away, so once
the window passes half a pitch the others must be excluded by the images. Thesis 4.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.mosaic.correlation import MAGNIFIED, correlated, footprint, peaks, view
from recognizer.mosaic.lucas_kanade import Aligned, aligned
from recognizer.mosaic.patch import Patch, covered
from recognizer.mosaic.planar import inverse, moved, wrapped

Array = NDArray[np.float64]

CONSTANT = "nothing to correlate"
APART = "too little overlap"
NOISE = "no better than noise"
AMBIGUOUS = "more than one place"


@dataclass(frozen=True, slots=True)
class Settings:
    """When a registration is given."""

    sigmas: float = 3.0  #: half width of the window, standard deviations of the belief
    contrast: float = 0.2  #: least spread of a patch over its upper level, planes taken out
    overlap: float = 0.25  #: least share of the matrix
    significance: float = 8.0  #: nats over what the best of as many shifts of noise gives
    margin: float = 3.0  #: nats over the next place, in a window within half a period
    margin_beyond: float = 8.0  #: the same in a wider window
    independent: float = 0.4  #: readings to a tactel: smoothing ties neighbours together
    candidates: int = 4  #: maxima that are refined
    near_tactels: float = 0.35  #: windows no wider than this need no search


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """How the second patch lies on the first."""

    pose: Array  #: (3,) T_a_b, mm and rad; the belief where there is a reason
    covariance: Array  #: (3, 3), of images and belief together
    information: Array  #: (3, 3) inverse covariance of the images alone; may be singular
    gain: float  #: readings of a over those of b
    rho: float  #: correlation; NaN where undefined
    margin: float  #: nats over the next place; inf if there is none
    reason: str = ""  #: "" where it is found

    def __bool__(self) -> bool:
        return not self.reason


def registered(
    a: Patch,
    b: Patch,
    believed: Array,
    covariance: Array,
    *,
    period_mm: float = math.inf,
    settings: Settings | None = None,
) -> Registration:
    """Register two patches.

    Parameters
    ----------
    a, b
        Of one sensor.
    believed, covariance
        T_a_b (3,) in mm and rad, and (3, 3).
    period_mm
        Distance after which the surface looks alike: the pitch of symbols; inf for others.
    settings
        Limits.

    Returns
    -------
    Registration
        With a reason, and the belief as its pose, where the place cannot be told.
    """
    limits = settings or Settings()
    if not (_varies(a, believed, b, limits) and _varies(b, inverse(believed), a, limits)):
        shown = min(a.scale, b.scale) > 0
        known = _shared(a, b, believed) >= limits.overlap
        return refused(believed, covariance, APART if shown and not known else CONSTANT)
    prior = np.linalg.inv(covariance)
    reach = limits.sigmas * np.sqrt(np.diag(covariance))
    pitch = a.sensor.pitch_mm
    if max(*reach[:2], reach[2] * a.sensor.reach_mm) <= limits.near_tactels * pitch:
        starts, shifts = [believed], 1
    else:
        starts, shifts = _starts(a, b, believed, prior, reach, limits)
    return _chosen(a, b, starts, shifts, believed, covariance, period_mm, limits)


def refused(believed: Array, covariance: Array, reason: str, margin: float = 0.0) -> Registration:
    """Return a registration that says nothing but why."""
    return Registration(
        pose=np.array(believed),
        covariance=np.array(covariance),
        information=np.zeros((3, 3)),
        gain=math.nan,
        rho=math.nan,
        margin=margin,
        reason=reason,
    )


def nats(rho: Array, tactels: Array, limits: Settings) -> Array:
    """Return how much likelier images are if they show the same, by their correlation."""
    positive = np.clip(np.nan_to_num(rho), 0.0, 0.9999)
    return np.asarray(-limits.independent * tactels / 2 * np.log1p(-(positive**2)))


def turns(sigma_rad: float, sigmas: float, reach_mm: float, pitch_mm: float) -> Array:
    """Return the turns to try about a belief: at the rim they move the image by a tactel."""
    step = pitch_mm / reach_mm
    count = math.floor(min(sigmas * sigma_rad, math.pi) / step + 0.5)
    return np.arange(-count, count + 1) * step


def _varies(a: Patch, T_a_b: Array, b: Patch, limits: Settings) -> bool:
    """Whether a patch has contrast where the other one may lie over it, planes taken out."""
    over = a.good.reshape(-1) & covered(a.sensor, moved(inverse(T_a_b), a.points_mm), beyond=0.5)
    if over.sum() < limits.overlap * over.size:
        return False
    values = a.values.reshape(-1)[over]
    plane = np.column_stack([np.ones(len(values)), a.points_mm[over]])
    rest = values - plane @ np.linalg.lstsq(plane, values, rcond=None)[0]
    return bool(rest.std() > limits.contrast * max(values.max(), 1e-12))


def _shared(a: Patch, b: Patch, T_a_b: Array) -> float:
    return float(covered(a.sensor, moved(inverse(T_a_b), a.points_mm), beyond=0.5).mean())


def _starts(
    a: Patch, b: Patch, believed: Array, prior: Array, reach: Array, limits: Settings
) -> tuple[list[Array], int]:
    """Return the best maxima of the correlation, and how many shifts were tried."""
    h = a.sensor.pitch_mm / MAGNIFIED
    reach_mm = (float(reach[0]), float(reach[1]))
    rows, columns = math.ceil(reach_mm[1] / h) + 1, math.ceil(reach_mm[0] / h) + 1
    found: list[tuple[float, Array]] = []
    tried = turns(reach[2] / limits.sigmas, limits.sigmas, a.sensor.reach_mm, a.sensor.pitch_mm)
    for turn in tried.tolist():
        theta = float(wrapped(believed[2] + turn))
        grid = footprint(b, theta, (columns * h, rows * h))
        reference = view(a, grid, np.array([-believed[0], -believed[1], 0.0]))
        image = view(b, grid, np.array([0.0, 0.0, theta]))
        map_ = correlated(reference, image, (rows, columns))
        k, n = np.mgrid[-rows : rows + 1, -columns : columns + 1]
        away = np.stack([n * h, -k * h, np.full(k.shape, turn)], axis=-1)
        tactels = map_.overlap / MAGNIFIED**2
        score = nats(map_.rho, tactels, limits)
        score -= 0.5 * np.einsum("kni,ij,knj->kn", away, prior, away)
        score[~(map_.rho > 0) | (tactels < limits.overlap * a.good.size)] = -np.inf
        for i, j, value in peaks(score, limits.candidates):
            shift = ((j - columns) * h, (rows - i) * h)
            found.append((value, believed + np.array([*shift, turn])))
    found.sort(key=lambda item: -item[0])
    size = (2 * rows + 1) * (2 * columns + 1) * len(tried)
    return [pose for _, pose in found[: limits.candidates]], size


def _chosen(
    a: Patch,
    b: Patch,
    starts: list[Array],
    shifts: int,
    believed: Array,
    covariance: Array,
    period_mm: float,
    limits: Settings,
) -> Registration:
    prior = np.linalg.inv(covariance)
    refined: list[tuple[float, float, Aligned]] = []
    for start in starts:
        found = aligned(a, b, start, believed, prior)
        if found is None:
            continue
        away = found.pose - believed
        away[2] = wrapped(away[2])
        images = float(nats(np.array(found.rho), np.array(found.tactels), limits))
        refined.append((images - 0.5 * float(away @ prior @ away), images, found))
    if not refined:
        return refused(believed, covariance, NOISE)
    refined.sort(key=lambda item: -item[0])
    score, images, best = refined[0]
    if images < limits.significance + math.log(shifts / MAGNIFIED**2 + 1):
        return refused(believed, covariance, NOISE)
    others = [value for value, _, other in refined[1:] if _elsewhere(best, other, a)]
    margin = score - max(others, default=-math.inf)
    window = limits.sigmas * math.sqrt(max(covariance[0, 0], covariance[1, 1]))
    if margin < (limits.margin_beyond if window > period_mm / 2 else limits.margin):
        return refused(believed, covariance, AMBIGUOUS, margin)
    return Registration(
        pose=best.pose,
        covariance=np.linalg.inv(best.information + prior),
        information=best.information,
        gain=best.gain * a.scale / b.scale,
        rho=best.rho,
        margin=margin,
    )


def _elsewhere(best: Aligned, other: Aligned, a: Patch) -> bool:
    """Whether two candidates differ by more than the images leave open (along an edge, say)."""
    away = other.pose - best.pose
    away[2] = wrapped(away[2])
    lever = np.array([1.0, 1.0, a.sensor.reach_mm / 2])
    far = float(np.linalg.norm(away * lever)) > 0.5 * a.sensor.pitch_mm
    return far and float(away @ best.information @ away) > 9.0
