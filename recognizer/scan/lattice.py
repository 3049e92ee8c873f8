"""Views of touches -> the lattice of the plane that most of them agree with. Thesis 4.3, 6.3.

A lattice of the plane is `T_lattice_plane` with a covariance, that of a small motion
(x, y, theta) about the lattice's origin. Under it every touch is expected at a pose; a view of
the touch agrees if it lies there up to whole pitches. The motion that the views ask for is
found by weighted least squares. Lattice axes, mm and rad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.planar import compose_poses, inverse, wrap_angle
from recognizer.scan.settings import LATTICES, ScanSettings
from recognizer.scan.views import LatticeViews, TouchPoses

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_NEIGHBOURS = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j], np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class PlaneLattice:
    """Where a lattice lies in the plane."""

    T_lattice_plane: Array  #: (3,)
    covariance: Array  #: (3, 3)


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """A lattice and the views that agree with it."""

    lattice: PlaneLattice
    chosen: Ints  #: (n,) the view of each touch, -1 where none agrees
    shifts: Ints  #: (n, 2) whole pitches from the lattice's origin to that of the view
    expected: Array  #: (n, 3) T_lattice_touch
    scores: Array  #: (n,) nats that each touch adds
    score: float  #: their sum


def seed_lattice(views: LatticeViews, touch_poses: TouchPoses, view: int) -> PlaneLattice:
    """Return the lattice that one view shows."""
    touch, pose = int(views.touch[view]), views.poses[view]
    T_lattice_plane = compose_poses(pose, inverse(touch_poses.poses[touch]))
    turned = _rotate_covariances(touch_poses.covariances[touch], float(T_lattice_plane[2]))
    back = np.linalg.inv(_lever(pose[None])[0])
    return PlaneLattice(T_lattice_plane, back @ (views.covariances[view] + turned) @ back.T)


def refine_agreement(
    views: LatticeViews,
    touch_poses: TouchPoses,
    lattice: PlaneLattice,
    pitch_mm: float,
    limits: ScanSettings,
) -> Agreement:
    """Return what agrees with a lattice, and the lattice moved to where that wants it."""
    found = _agreement_with(views, touch_poses, lattice, pitch_mm, limits)
    for _ in range(LATTICES.rounds):
        lattice = _refit_lattice(views, touch_poses, found, pitch_mm, limits)
        before, found = found, _agreement_with(views, touch_poses, lattice, pitch_mm, limits)
        away = np.abs(found.expected - before.expected)[:, :2].max()
        if away < LATTICES.settled_mm and (found.chosen == before.chosen).all():
            break
    return found


def same_lattice(a: PlaneLattice, b: PlaneLattice, at: Array, pitch_mm: float) -> bool:
    """Whether two lattices are one, as seen from a touch (3,) of the plane."""
    away = compose_poses(a.T_lattice_plane, at) - compose_poses(b.T_lattice_plane, at)
    off = away[:2] - np.rint(away[:2] / pitch_mm) * pitch_mm
    return bool(np.hypot(*off) < 0.2 * pitch_mm and abs(wrap_angle(away[2])) < 0.2)


def expected_at(lattice: PlaneLattice, pose: Array, covariance: Array) -> tuple[Array, Array]:
    """Return T_lattice_touch (3,) and its covariance for a touch that stands in the plane."""
    at = compose_poses(lattice.T_lattice_plane, pose)
    lever = _lever(at[None])[0]
    turned = _rotate_covariances(covariance, float(lattice.T_lattice_plane[2]))
    return at, lever @ lattice.covariance @ lever.T + turned


def _agreement_with(
    views: LatticeViews,
    touch_poses: TouchPoses,
    lattice: PlaneLattice,
    pitch_mm: float,
    limits: ScanSettings,
) -> Agreement:
    number = len(touch_poses.poses)
    expected = compose_poses(lattice.T_lattice_plane, touch_poses.poses)
    away, shifts = _residuals(views, expected, pitch_mm)
    own = _view_covariances(views, touch_poses, lattice, expected, limits)
    lever = _lever(expected)[views.touch]
    spread = own + lever @ lattice.covariance @ lever.swapaxes(1, 2)
    precision: Array = np.asarray(np.linalg.inv(spread), np.float64)
    chi2 = np.einsum("mi,mij,mj->m", away, precision, away)
    likely = (chi2 < 2 * limits.left_out) & _unambiguous_shifts(
        away, precision, pitch_mm, limits.shift_margin
    )
    likely &= views.losses > -limits.plainly
    score = np.maximum(views.losses, -limits.left_out) - chi2 / 2
    score += np.where(views.led, 0.0, limits.agreement)
    score += views.losses * LATTICES.tie
    chosen, best = np.full(number, -1), np.full(number, -limits.left_out)
    best[np.setdiff1d(np.arange(number), views.touch)] = 0.0  # nothing is felt there
    rising = np.argsort(score, kind="stable")
    rising = rising[likely[rising]]
    chosen[views.touch[rising]] = rising  # the last one wins
    best[chosen >= 0] = np.maximum(score[chosen[chosen >= 0]], -limits.left_out)
    taken = np.zeros((number, 2), np.int64)
    taken[chosen >= 0] = shifts[chosen[chosen >= 0]]
    return Agreement(lattice, chosen, taken, expected, best, float(best.sum()))


def _residuals(views: LatticeViews, expected: Array, pitch_mm: float) -> tuple[Array, Ints]:
    """Return how far (m, 3) views lie from what is expected, and whole pitches (m, 2) beyond."""
    away = views.poses - expected[views.touch]
    shifts = np.rint(away[:, :2] / pitch_mm)
    away[:, :2] -= shifts * pitch_mm
    away[:, 2] = wrap_angle(away[:, 2])
    return away, shifts.astype(np.int64)


def _view_covariances(
    views: LatticeViews,
    touch_poses: TouchPoses,
    lattice: PlaneLattice,
    expected: Array,
    limits: ScanSettings,
) -> Array:
    """Return covariances (m, 3, 3) of views against a lattice that is known exactly."""
    turned = _rotate_covariances(touch_poses.covariances, float(lattice.T_lattice_plane[2]))[
        views.touch
    ]
    middle = expected[:, :2].mean(axis=0)
    drift = (limits.scale * (expected[:, :2] - middle)[views.touch]) ** 2
    floor = np.array([limits.floor_mm, limits.floor_mm, limits.floor_rad]) ** 2
    own = views.covariances + turned + np.diag(floor)
    own[:, 0, 0] += drift[:, 0]
    own[:, 1, 1] += drift[:, 1]
    return np.asarray(own)


def _unambiguous_shifts(
    away: Array, precision: Array, pitch_mm: float, margin: float
) -> NDArray[np.bool_]:
    """Whether no other whole pitch fits views (m,) nearly as well."""
    # (away + s)' P (away + s) - away' P away for the eight neighbours s
    by_shift = _NEIGHBOURS @ (precision[:, :2] @ away[..., None])[:, :, 0].T * pitch_mm
    square = np.einsum("ki,mij,kj->km", _NEIGHBOURS, precision[:, :2, :2], _NEIGHBOURS)
    return np.asarray((2 * by_shift + square * pitch_mm**2).min(axis=0) > 2 * margin)


def _refit_lattice(
    views: LatticeViews,
    touch_poses: TouchPoses,
    found: Agreement,
    pitch_mm: float,
    limits: ScanSettings,
) -> PlaneLattice:
    """Return the lattice where the chosen views want it."""
    chosen = found.chosen[found.chosen >= 0]
    if not len(chosen):
        return found.lattice
    away, _ = _residuals(views, found.expected, pitch_mm)
    own = _view_covariances(views, touch_poses, found.lattice, found.expected, limits)[chosen]
    lever = _lever(found.expected)[views.touch[chosen]]
    weighted = lever.swapaxes(1, 2) @ np.linalg.inv(own)
    covariance = np.linalg.inv((weighted @ lever).sum(axis=0))
    motion = covariance @ (weighted @ away[chosen][..., None]).sum(axis=0)[:, 0]
    at = compose_poses(motion, found.lattice.T_lattice_plane)
    return PlaneLattice(at, covariance + LATTICES.least * np.eye(3))


def _lever(poses: Array) -> Array:
    """Return (n, 3, 3): what a small motion about the origin does to poses (n, 3)."""
    lever = np.tile(np.eye(3), (len(poses), 1, 1))
    lever[:, 0, 2], lever[:, 1, 2] = -poses[:, 1], poses[:, 0]
    return lever


def _rotate_covariances(covariance: Array, angle: float) -> Array:
    """Return covariances (..., 3, 3) of x, y, theta in axes turned back by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ covariance @ turn.T)
