"""Touch -> the few lattices that it may show; touches -> where they stand. Thesis 4.3, 6.2.

Poses (3,) are x, y (mm) and theta (rad). The plane is the arm's, in which touches are believed
to stand; a view's lattice has its own origin, whole pitches from that of any other view.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.grow import add_touch
from recognizer.scan.mosaic.mosaic import Mosaic, no_touches
from recognizer.scan.mosaic.planar import PlacedTouch, wrap_angle
from recognizer.scan.settings import VIEWS, ScanSettings
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.reader import Reader
from recognizer.touch.settings import FitSettings
from recognizer.touch.symbols.bends import guess_bends
from recognizer.touch.symbols.fit import Fit, fit_lattices, score_cells
from recognizer.touch.symbols.gain import Image, bend_image, first_gain
from recognizer.touch.symbols.refine import refine_lattices
from recognizer.touch.symbols.search import Bank
from recognizer.touch.symbols.template import ResponseTemplate

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class TouchPoses:
    """Where touches stand in the plane."""

    poses: Array  #: (n, 3) T_plane_touch
    covariances: Array  #: (n, 3, 3)
    mosaic: Mosaic | None  #: None as long as the arm is enough


@dataclass(frozen=True, slots=True, eq=False)
class LatticeView:
    """One lattice that a touch may show."""

    fit: Fit
    led: bool  #: found only because other touches led there: that it agrees says little


@dataclass(frozen=True, slots=True, eq=False)
class LatticeViews:
    """All lattices that touches may show, one after the other: m views of n touches."""

    fits: tuple[Fit, ...]
    led: NDArray[np.bool_]  #: (m,)
    touch: Ints  #: (m,)
    poses: Array  #: (m, 3) T_lattice_touch
    covariances: Array  #: (m, 3, 3)
    losses: Array  #: (m,) nats against the best view of the touch, 0 or less
    values: Array  #: (n,) nats of the best view of each touch; 0 for a touch without one


def stands_of(
    reader: Reader, touches: Sequence[PlacedTouch], before: TouchPoses | None, limits: ScanSettings
) -> TouchPoses:
    """Return where touches stand, the last one being new.

    The mosaic is asked from the first touch on whose place is uncertain by more
    than `loose` pitches.
    """
    last = touches[-1]
    pitch = min(encoding.style.pitch_mm for encoding in reader.lab.arrays)
    loose_mm = limits.loose * pitch
    mosaic = None if before is None else before.mosaic
    sure = last.believed is not None and widest_mm(last.believed.covariance) <= loose_mm
    if mosaic is None and sure and last.believed is not None:
        pose, covariance = last.believed.pose[None], last.believed.covariance[None]
        if before is None:
            return TouchPoses(pose, covariance, None)
        poses = np.concatenate([before.poses, pose])
        return TouchPoses(poses, np.concatenate([before.covariances, covariance]), None)
    if mosaic is None:
        mosaic = no_touches(reader.sensor, pitch)
        for touch in touches[:-1]:
            mosaic = add_touch(mosaic, touch)
    mosaic = add_touch(mosaic, last)
    return TouchPoses(mosaic.poses, mosaic.covariances, mosaic)


def is_unmeasured(touch: PlacedTouch, loose_mm: float) -> bool:
    """Whether nobody measured how a touch stands to the one before."""
    step = touch.stepped
    return touch.believed is None and step is not None and widest_mm(step.covariance) > loose_mm


def widest_mm(covariance: Array) -> float:
    """Return the largest standard deviation of a place, mm."""
    return math.sqrt(float(np.linalg.eigvalsh(covariance[:2, :2])[-1]))


def expected_view(
    image: Image, template: ResponseTemplate, reader: Reader, near: Array, clean: float
) -> tuple[LatticeView, ...]:
    """Return the lattice at the first of the poses (k, 3) that touches before lead to expect.

    None unless it explains the image so well (`clean`, noise) that nothing else need be looked for.
    """
    expected = _refine_near(image, template, reader.settings.first, near[:1], None)
    if expected and expected[0].noise <= clean:
        return (LatticeView(expected[0], led=True),)
    return ()


def fits_of(
    image: Image,
    template: ResponseTemplate,
    bank: Bank,
    reader: Reader,
    near: Array,
    alone: Sequence[Fit],
) -> tuple[LatticeView, ...]:
    """Return the likeliest lattices of an image, and those that lie near given ones.

    The latter leave more unexplained, and so say less of each cell, if the image shows what
    neither of them knows, such as the edge of a face.

    Parameters
    ----------
    near
        (k, 3) T_lattice_touch that other touches lead to expect.
    alone
        Fits of the touch read by itself, best first; none: they are looked for here.
    """
    settings = reader.settings.first
    found = _distinct_fits(alone, template.pitch_mm) or fit_lattices(
        image, template, bank, settings
    )
    views = tuple(LatticeView(fit, led=False) for fit in found)
    rest = [
        pose for pose in near if not any(_same_as_fit(pose, f, template.pitch_mm) for f in found)
    ]
    for fit in _refine_near(image, template, settings, np.array(rest).reshape(-1, 3), found):
        if not any(_same_as_fit(fit.pose[:3], view.fit, template.pitch_mm) for view in views):
            views = (*views, LatticeView(fit, led=True))
    return views


def _distinct_fits(fits: Sequence[Fit], pitch_mm: float) -> tuple[Fit, ...]:
    """Return fits, each lattice once."""
    kept: list[Fit] = []
    for fit in fits:
        if not any(_same_as_fit(fit.pose[:3], other, pitch_mm) for other in kept):
            kept.append(fit)
    return tuple(kept[: VIEWS.most])


def round_views(
    image: Image,
    template: ResponseTemplate,
    bank: Bank,
    reader: Reader,
    encoding: EmbossedArray,
    near: Array,
) -> tuple[LatticeView, ...]:
    """Return the likeliest lattices of an image of a round face, and those near given ones.

    Parameters
    ----------
    image
        As of a flat face.
    near
        (k, 3) as for `fits_of`.
    """
    settings = reader.settings
    views: list[LatticeView] = []
    for guess in guess_bends(
        image, reader.sensor, encoding.radii_mm, template.ink, settings.round.bends
    ):
        under = bend_image(image, reader.sensor, guess.bend)
        found = fit_lattices(under, template, bank, settings.first, [guess.gain])
        views += [LatticeView(fit, led=False) for fit in found]
        rest = [
            pose
            for pose in near
            if not any(_same_as_fit(pose, f, template.pitch_mm) for f in found)
        ]
        led = _refine_near(under, template, settings.first, np.array(rest).reshape(-1, 3), found)
        views += [LatticeView(fit, led=True) for fit in led]
    return tuple(views)


def _refine_near(
    image: Image,
    template: ResponseTemplate,
    settings: FitSettings,
    near: Array,
    found: tuple[Fit, ...] | None,
) -> tuple[Fit, ...]:
    """Return the fits that are reached from given poses (k, 3)."""
    gain = found[0].gain if found else first_gain(image, template.ink)
    if gain is None or not len(near):
        return ()
    gains = np.repeat(gain[None], len(near), axis=0)
    lattices = refine_lattices(image, template, near, gains, steps=settings.final_steps)
    return score_cells(image, template, lattices)


def views_of(found: Sequence[tuple[LatticeView, ...]]) -> LatticeViews:
    """Return the views of touches. Fits that do not say where they lie are left out."""
    kept = [tuple(view for view in each if tells_place(view.fit.covariance)) for each in found]
    every = tuple(view.fit for each in kept for view in each)
    touch = np.repeat(np.arange(len(kept)), [len(each) for each in kept])
    values = np.array([fit.value for fit in every])
    best = np.full(len(kept), -np.inf)
    np.maximum.at(best, touch, values)
    return LatticeViews(
        fits=every,
        led=np.array([view.led for each in kept for view in each], np.bool_),
        touch=touch,
        poses=np.array([[f.x_mm, f.y_mm, f.theta_rad] for f in every]).reshape(-1, 3),
        covariances=np.array([f.covariance for f in every]).reshape(-1, 3, 3),
        losses=values - best[touch],
        values=np.where(np.isfinite(best), best, 0.0),
    )


def tells_place(covariance: Array) -> bool:
    """Whether a covariance says where a touch stands: in all directions, and none too well."""
    if not np.isfinite(covariance).all():
        return False
    lowest = np.linalg.eigvalsh(covariance)[0]
    return bool(
        lowest > VIEWS.least_rad**2 and max(covariance[0, 0], covariance[1, 1]) < VIEWS.most_mm**2
    )


def _same_as_fit(pose: Array, fit: Fit, pitch_mm: float) -> bool:
    """Whether a lattice is that of a fit, whole pitches apart."""
    away = pose - (fit.x_mm, fit.y_mm, fit.theta_rad)
    at = away[:2] - np.rint(away[:2] / pitch_mm) * pitch_mm
    return math.hypot(*at) < VIEWS.same_mm and abs(float(wrap_angle(away[2]))) < VIEWS.same_rad
