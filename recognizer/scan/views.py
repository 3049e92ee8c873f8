"""The few lattices that a touch may show, and the poses of touches in a plane. Thesis 4.3, 6.2.

Poses (3,) are x, y (mm) and theta (rad). The plane is that of the arm's beliefs; the lattice of a
view has its own origin, whole pitches from that of any other view.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.mosaic import Mosaic, add_touch, no_touches
from recognizer.scan.mosaic.planar import PlacedTouch, pose_difference
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.options import Effort
from recognizer.touch.reader import Reader
from recognizer.touch.symbols.curvature import guess_curvatures
from recognizer.touch.symbols.fit import (
    Fit,
    fit_lattices,
    refine_lattices,
    score_cells,
    search_image,
)
from recognizer.touch.symbols.image import Image, bend_image, first_gain
from recognizer.touch.symbols.search import Bank
from recognizer.touch.verify import CURVATURES

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

UNCERTAIN_PITCHES = 0.25  #: standard deviation of a place from which the mosaic is used
CLEAN_NOISE = 0.15  #: standard deviation of psi of a touch with the predicted symbols: no search
LEAST_SD_RAD = 1e-5  #: standard deviation of poses that are believed
MOST_SD_MM = 3.0  #: standard deviation of places that are believed
SAME_MM, SAME_RAD = 0.3, 0.03  #: within which two fits of a touch are one
MOST_VIEWS = 6  #: fits of a touch by itself that are views


@dataclass(frozen=True, slots=True, eq=False)
class TouchPoses:
    """Poses of touches in the plane."""

    poses: Array  #: (n, 3) T_plane_touch
    covariances: Array  #: (n, 3, 3)
    mosaic: Mosaic | None  #: None while the arm is certain enough


@dataclass(frozen=True, slots=True, eq=False)
class LatticeView:
    """One lattice that a touch may show."""

    fit: Fit
    predicted: bool  #: found only near a pose predicted by other touches: weak evidence


@dataclass(frozen=True, slots=True, eq=False)
class LatticeViews:
    """The views of n touches, one after the other: m views."""

    fits: tuple[Fit, ...]
    predicted: NDArray[np.bool_]  #: (m,)
    touch: Ints  #: (m,)
    poses: Array  #: (m, 3) T_lattice_touch
    covariances: Array  #: (m, 3, 3)
    losses: Array  #: (m,) nats against the best view of the touch, 0 or less
    values: Array  #: (n,) nats of the best view of each touch; 0 for a touch without one


def estimate_poses(
    reader: Reader, touches: Sequence[PlacedTouch], before: TouchPoses | None
) -> TouchPoses:
    """Return the poses of touches, the last one being new.

    The mosaic is used from the first touch on that the arm places with a standard deviation of more
    than `UNCERTAIN_PITCHES`.
    """
    believed = touches[-1].believed
    pitch = min(embossed.style.pitch_mm for embossed in reader.lab.arrays)
    mosaic = None if before is None else before.mosaic
    if mosaic is None:
        if believed and position_sd_mm(believed.covariance) <= UNCERTAIN_PITCHES * pitch:
            poses, covariances = believed.pose[None], believed.covariance[None]
            if before is not None:
                poses = np.concatenate([before.poses, poses])
                covariances = np.concatenate([before.covariances, covariances])
            return TouchPoses(poses, covariances, None)
        mosaic = no_touches(reader.sensor, pitch)
        for touch in touches[:-1]:
            mosaic = add_touch(mosaic, touch)
    mosaic = add_touch(mosaic, touches[-1])
    return TouchPoses(mosaic.poses, mosaic.covariances, mosaic)


def is_unmeasured(touch: PlacedTouch, pitch_mm: float) -> bool:
    """Whether the step to a touch was not measured."""
    step = touch.stepped
    if touch.believed is not None or step is None:
        return False
    return position_sd_mm(step.covariance) > UNCERTAIN_PITCHES * pitch_mm


def position_sd_mm(covariance: Array) -> float:
    """Return the largest standard deviation of a place, mm."""
    return math.sqrt(float(np.linalg.eigvalsh(covariance[:2, :2])[-1]))


def predicted_view(image: Image, effort: Effort, near: Array) -> tuple[LatticeView, ...]:
    """Return the lattice at the first predicted pose (k, 3), if it explains the image alone."""
    found = _refine_near(image, effort, near[:1], ())
    return tuple(LatticeView(fit, predicted=True) for fit in found[:1] if fit.noise <= CLEAN_NOISE)


def flat_views(
    image: Image, bank: Bank, effort: Effort, near: Array, alone: Sequence[Fit]
) -> tuple[LatticeView, ...]:
    """Return the likeliest lattices of an image, and those near predicted poses.

    Where the image contains more than symbols, such as the edge of a face, both leave more
    unexplained, so each cell has less evidence. `near` (k, 3) T_lattice_touch are predicted by
    other touches; `alone` are fits of the touch by itself, best first, searched for if there are
    none.
    """
    found: list[Fit] = []
    for fit in alone:
        if not any(_same_as_fit(fit.pose[:3], other, image.template.pitch_mm) for other in found):
            found.append(fit)
    fits = tuple(found[:MOST_VIEWS]) or fit_lattices(image, bank, effort)
    views = tuple(LatticeView(fit, predicted=False) for fit in fits)
    for fit in _refine_near(image, effort, near, fits):
        if not any(_same_as_fit(fit.pose[:3], view.fit, image.template.pitch_mm) for view in views):
            views = (*views, LatticeView(fit, predicted=True))
    return views


def round_views(
    image: Image, bank: Bank, reader: Reader, embossed: EmbossedArray, near: Array
) -> tuple[LatticeView, ...]:
    """Return the likeliest lattices of an image of a round face, and those near predicted poses.

    `image` is as of a flat face, `near` (k, 3) as for `flat_views`.
    """
    effort, views = reader.options.first, list[LatticeView]()
    for guess in guess_curvatures(image, reader.sensor, embossed.radii_mm, CURVATURES):
        under = bend_image(image, reader.sensor, guess.bend)
        fits = fit_lattices(under, bank, effort, search_image(under, bank, [guess.gain]))
        views += [LatticeView(fit, predicted=False) for fit in fits]
        near_fits = _refine_near(under, effort, near, fits)
        views += [LatticeView(fit, predicted=True) for fit in near_fits]
    return tuple(views)


def stack_views(found: Sequence[tuple[LatticeView, ...]]) -> LatticeViews:
    """Return the views of touches. Fits with an indefinite pose are left out."""
    kept = [tuple(view for view in each if is_definite(view.fit.covariance)) for each in found]
    every = tuple(view.fit for each in kept for view in each)
    touch = np.repeat(np.arange(len(kept)), [len(each) for each in kept])
    values = np.array([fit.value for fit in every])
    best = np.full(len(kept), -np.inf)
    np.maximum.at(best, touch, values)
    return LatticeViews(
        fits=every,
        predicted=np.array([view.predicted for each in kept for view in each], np.bool_),
        touch=touch,
        poses=np.array([[f.x_mm, f.y_mm, f.theta_rad] for f in every]).reshape(-1, 3),
        covariances=np.array([f.covariance for f in every]).reshape(-1, 3, 3),
        losses=values - best[touch],
        values=np.where(np.isfinite(best), best, 0.0),
    )


def is_definite(covariance: Array) -> bool:
    """Whether a covariance defines a pose in all directions, and none too well."""
    if not np.isfinite(covariance).all():
        return False
    lowest = np.linalg.eigvalsh(covariance)[0]
    most = max(covariance[0, 0], covariance[1, 1])
    return bool(lowest > LEAST_SD_RAD**2 and most < MOST_SD_MM**2)


def _refine_near(
    image: Image, effort: Effort, near: Array, found: Sequence[Fit]
) -> tuple[Fit, ...]:
    """Return the fits reached from predicted poses (k, 3) that no found fit has."""
    pitch = image.template.pitch_mm
    rest = [p for p in near if not any(_same_as_fit(p, fit, pitch) for fit in found)]
    gain = found[0].gain if found else first_gain(image)
    if gain is None or not rest:
        return ()
    gains = np.repeat(gain[None], len(rest), axis=0)
    lattices = refine_lattices(image, np.array(rest), gains, steps=effort.final_steps)
    return score_cells(image, lattices)


def _same_as_fit(pose: Array, fit: Fit, pitch_mm: float) -> bool:
    """Whether a lattice is that of a fit, whole pitches apart."""
    away = pose_difference(pose, fit.pose[:3])
    at = away[:2] - np.rint(away[:2] / pitch_mm) * pitch_mm
    return math.hypot(*at) < SAME_MM and abs(float(away[2])) < SAME_RAD
