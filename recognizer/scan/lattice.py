"""Views of touches -> the lattice that most agree with, and the evidence of each cell.

A lattice of the plane is `T_lattice_plane` with a covariance, that of a small motion
(x, y, theta) about the lattice's origin. It predicts the pose of every touch; a view of the touch
agrees if it has that pose up to whole pitches. Weighted least squares move the lattice to the
agreeing views. Lattice axes, mm and rad. Thesis 4.3, 6.3.

The evidence of a cell is the sum over touches, each limited. Touches of one print by one sensor
share errors, so n of them count as n / (1 + (n - 1) rho) independent ones, n being the effective
number that see the cell. A touch that contradicts all others is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.planar import (
    compose_poses,
    inverse,
    pose_difference,
    rotation,
    wrap_angle,
)
from recognizer.scan.views import LatticeViews, TouchPoses
from recognizer.touch.symbols.fit import Fit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

LEFT_OUT_NATS = 10.0  #: cost of a touch that agrees with no lattice
WORSE_NATS = 250.0  #: below the best view of a touch, beyond which a view never agrees
AGREEMENT_NATS = 7.0  #: gain of a view on a lattice that did not predict it
SHIFT_MARGIN_NATS = 6.0  #: between the likeliest integer shift of a touch and the next
FLOOR_MM, FLOOR_RAD = 0.25, 0.01  #: standard deviation of poses, beyond their own
SCALE = 0.01  #: standard deviation of the print's scale: distant places drift apart
ROUNDS = 2  #: of choosing views and moving the lattice
SETTLED_MM = 0.05  #: change of all predicted places that ends them
#: share of a view's loss that counts: of two views without evidence for a lattice the likelier wins
TIE = 1e-6
LEAST_VARIANCE = 1e-12  #: mm^2 or rad^2

CELL_NATS = 10.0  #: most that one touch contributes to one cell
CORRELATION = 0.25  #: of the errors of touches at one cell: at most 1/.25 independent ones
CONTRADICTION_NATS = 20.0  #: against all others, from which a touch is left out

_NEIGHBOURS = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j], np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class PlaneLattice:
    """The pose of a lattice in the plane."""

    T_lattice_plane: Array  #: (3,)
    covariance: Array  #: (3, 3)


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """A lattice and the views that agree with it."""

    lattice: PlaneLattice
    chosen: Ints  #: (n,) the view of each touch, -1 where none agrees
    shifts: Ints  #: (n, 2) whole pitches from the lattice's origin to that of the view
    predicted: Array  #: (n, 3) T_lattice_touch
    scores: Array  #: (n,) nats of each touch
    score: float  #: their sum

    @property
    def touches(self) -> int:
        """Number of touches that agree."""
        return int((self.chosen >= 0).sum())


@dataclass(frozen=True, slots=True, eq=False)
class LatticeEvidence:
    """The accumulated evidence of the cells of a lattice."""

    agreement: Agreement
    fit: Fit  #: of all touches; its pose is that of the last one


def seed_lattice(views: LatticeViews, touch_poses: TouchPoses, view: int) -> PlaneLattice:
    """Return the lattice of one view."""
    touch, pose = int(views.touch[view]), views.poses[view]
    T_lattice_plane = compose_poses(pose, inverse(touch_poses.poses[touch]))
    turned = _rotate(touch_poses.covariances[touch], T_lattice_plane)
    back = np.linalg.inv(_lever(pose[None])[0])
    return PlaneLattice(T_lattice_plane, back @ (views.covariances[view] + turned) @ back.T)


def refine_agreement(
    views: LatticeViews, touch_poses: TouchPoses, lattice: PlaneLattice, pitch_mm: float
) -> Agreement:
    """Return a lattice moved to the views that agree with it, and these views."""
    found = _agreement_with(views, touch_poses, lattice, pitch_mm)
    for _ in range(ROUNDS):
        lattice = _refit_lattice(views, touch_poses, found, pitch_mm)
        before, found = found, _agreement_with(views, touch_poses, lattice, pitch_mm)
        moved = np.abs(found.predicted - before.predicted)[:, :2].max()
        if moved < SETTLED_MM and (found.chosen == before.chosen).all():
            break
    return found


def same_lattice(a: PlaneLattice, b: PlaneLattice, at: Array, pitch_mm: float) -> bool:
    """Whether two lattices are one, as seen from a touch (3,) of the plane."""
    away = compose_poses(a.T_lattice_plane, at) - compose_poses(b.T_lattice_plane, at)
    off = away[:2] - np.rint(away[:2] / pitch_mm) * pitch_mm
    return bool(np.hypot(*off) < 0.2 * pitch_mm and abs(wrap_angle(away[2])) < 0.2)


def predict_pose(lattice: PlaneLattice, touch_poses: TouchPoses) -> tuple[Array, Array]:
    """Return T_lattice_touch (3,) of the last touch by its pose in the plane, and its spread."""
    at = compose_poses(lattice.T_lattice_plane, touch_poses.poses[-1])
    lever = _lever(at[None])[0]
    turned = _rotate(touch_poses.covariances[-1], lattice.T_lattice_plane)
    return at, lever @ lattice.covariance @ lever.T + turned


def accumulate(
    views: LatticeViews, touch_poses: TouchPoses, agreement: Agreement, pitch_mm: float
) -> LatticeEvidence | None:
    """Return the evidence of all touches that agree; None where none does."""
    contradicting = True
    while contradicting:
        if not agreement.touches:
            return None
        cells, scores, seen, against = _sum_evidence(views, agreement)
        worst = int(np.argmin(against))
        contradicting = against[worst] < -CONTRADICTION_NATS and agreement.touches > 2
        if contradicting:
            others = np.arange(len(agreement.chosen)) != worst
            agreement = replace(
                agreement,
                chosen=np.where(others, agreement.chosen, -1),
                score=agreement.score - LEFT_OUT_NATS - agreement.scores[worst],
                scores=np.where(others, agreement.scores, -LEFT_OUT_NATS),
            )
    most = scores.max(axis=1)
    view = int(agreement.chosen[-1])
    if view >= 0:
        pose = views.poses[view] - np.append(agreement.shifts[-1] * pitch_mm, 0.0)
        covariance = views.covariances[view]
    else:
        pose, covariance = predict_pose(agreement.lattice, touch_poses)
    shown = views.fits[view if view >= 0 else int(agreement.chosen.max())]
    used = agreement.chosen[agreement.chosen >= 0]
    fit = Fit(
        x_mm=float(pose[0]),
        y_mm=float(pose[1]),
        theta_rad=float(pose[2]),
        nuisance=shown.nuisance,
        gain=shown.gain,
        cells=cells,
        scores=scores - most[:, None],
        seen=seen,
        noise=float(np.median([views.fits[k].noise for k in used])),
        value=float(most.sum()) + agreement.score + float(views.values.sum()),
        covariance=covariance,
    )
    return LatticeEvidence(agreement, fit)


def predicted_fit(evidence: LatticeEvidence, touch_poses: TouchPoses) -> Fit:
    """Return the fit of the evidence with the last touch at its predicted pose."""
    pose, covariance = predict_pose(evidence.agreement.lattice, touch_poses)
    x, y, theta = pose.tolist()
    return replace(evidence.fit, x_mm=x, y_mm=y, theta_rad=theta, covariance=covariance)


def _agreement_with(
    views: LatticeViews, touch_poses: TouchPoses, lattice: PlaneLattice, pitch_mm: float
) -> Agreement:
    number = len(touch_poses.poses)
    predicted = compose_poses(lattice.T_lattice_plane, touch_poses.poses)
    away, shifts = _residuals(views, predicted, pitch_mm)
    own = _view_covariances(views, touch_poses, lattice, predicted)
    lever = _lever(predicted)[views.touch]
    spread = own + lever @ lattice.covariance @ lever.swapaxes(1, 2)
    precision: Array = np.asarray(np.linalg.inv(spread), np.float64)
    chi2 = np.einsum("mi,mij,mj->m", away, precision, away)
    likely = (chi2 < 2 * LEFT_OUT_NATS) & _unambiguous_shifts(away, precision, pitch_mm)
    likely &= views.losses > -WORSE_NATS
    score = np.maximum(views.losses, -LEFT_OUT_NATS) - chi2 / 2
    score += np.where(views.predicted, 0.0, AGREEMENT_NATS)
    score += views.losses * TIE
    chosen, best = np.full(number, -1), np.full(number, -LEFT_OUT_NATS)
    best[np.setdiff1d(np.arange(number), views.touch)] = 0.0  # touches without views
    rising = np.argsort(score, kind="stable")
    rising = rising[likely[rising]]
    chosen[views.touch[rising]] = rising  # the last one wins
    best[chosen >= 0] = np.maximum(score[chosen[chosen >= 0]], -LEFT_OUT_NATS)
    taken = np.zeros((number, 2), np.int64)
    taken[chosen >= 0] = shifts[chosen[chosen >= 0]]
    return Agreement(lattice, chosen, taken, predicted, best, float(best.sum()))


def _residuals(views: LatticeViews, predicted: Array, pitch_mm: float) -> tuple[Array, Ints]:
    """Return residuals (m, 3) of views against predictions, and whole pitches (m, 2) removed."""
    away = pose_difference(views.poses, predicted[views.touch])
    shifts = np.rint(away[:, :2] / pitch_mm)
    away[:, :2] -= shifts * pitch_mm
    return away, shifts.astype(np.int64)


def _view_covariances(
    views: LatticeViews, touch_poses: TouchPoses, lattice: PlaneLattice, predicted: Array
) -> Array:
    """Return covariances (m, 3, 3) of views against a lattice that is known exactly."""
    turned = _rotate(touch_poses.covariances, lattice.T_lattice_plane)[views.touch]
    middle = predicted[:, :2].mean(axis=0)
    drift = (SCALE * (predicted[:, :2] - middle)[views.touch]) ** 2
    own = views.covariances + turned + np.diag([FLOOR_MM**2, FLOOR_MM**2, FLOOR_RAD**2])
    own[:, 0, 0] += drift[:, 0]
    own[:, 1, 1] += drift[:, 1]
    return np.asarray(own)


def _unambiguous_shifts(away: Array, precision: Array, pitch_mm: float) -> NDArray[np.bool_]:
    """Whether no other whole pitch fits views (m,) nearly as well."""
    # (away + s)' P (away + s) - away' P away for the eight neighbours s
    by_shift = _NEIGHBOURS @ (precision[:, :2] @ away[..., None])[:, :, 0].T * pitch_mm
    square = np.einsum("ki,mij,kj->km", _NEIGHBOURS, precision[:, :2, :2], _NEIGHBOURS)
    margin = (2 * by_shift + square * pitch_mm**2).min(axis=0)
    return np.asarray(margin > 2 * SHIFT_MARGIN_NATS)


def _refit_lattice(
    views: LatticeViews, touch_poses: TouchPoses, found: Agreement, pitch_mm: float
) -> PlaneLattice:
    chosen = found.chosen[found.chosen >= 0]
    if not len(chosen):
        return found.lattice
    away, _ = _residuals(views, found.predicted, pitch_mm)
    own = _view_covariances(views, touch_poses, found.lattice, found.predicted)[chosen]
    lever = _lever(found.predicted)[views.touch[chosen]]
    weighted = lever.swapaxes(1, 2) @ np.linalg.inv(own)
    covariance = np.linalg.inv((weighted @ lever).sum(axis=0))
    motion = covariance @ (weighted @ away[chosen][..., None]).sum(axis=0)[:, 0]
    at = compose_poses(motion, found.lattice.T_lattice_plane)
    return PlaneLattice(at, covariance + LEAST_VARIANCE * np.eye(3))


def _sum_evidence(views: LatticeViews, agreement: Agreement) -> tuple[Ints, Array, Array, Array]:
    """Return cells, scores, tactels that see them, and (n,) nats for each touch by the others."""
    touches = np.flatnonzero(agreement.chosen >= 0)
    fits = [views.fits[agreement.chosen[t]] for t in touches]
    every = np.concatenate(
        [fit.cells - agreement.shifts[t] for t, fit in zip(touches, fits, strict=True)]
    )
    owner = np.repeat(touches, [len(fit.cells) for fit in fits])
    bounded = np.maximum(np.concatenate([fit.scores for fit in fits]), -CELL_NATS)
    cells, place = np.unique(every, axis=0, return_inverse=True)
    place = place.reshape(-1)

    def summed(values: Array) -> Array:
        return np.bincount(place, values, len(cells)).astype(np.float64)

    strength = -bounded.min(axis=1)
    looks = summed(strength) ** 2 / np.maximum(summed(strength**2), 1e-12)
    factor = 1 / (1 + (np.maximum(looks, 1.0) - 1) * CORRELATION)
    scores = np.stack([summed(column) for column in bounded.T], axis=1)
    best = scores.argmax(axis=1)
    lost = bounded[np.arange(len(bounded)), best[place]]
    against = np.bincount(owner, lost, len(agreement.chosen)).astype(np.float64)
    seen = summed(np.concatenate([fit.seen for fit in fits]))
    return cells, scores * factor[:, None], seen, against


def _lever(poses: Array) -> Array:
    """Return derivatives (n, 3, 3) of poses (n, 3) by a small motion about the origin."""
    lever = np.tile(np.eye(3), (len(poses), 1, 1))
    lever[:, 0, 2], lever[:, 1, 2] = -poses[:, 1], poses[:, 0]
    return lever


def _rotate(covariances: Array, T_lattice_plane: Array) -> Array:
    """Return covariances (..., 3, 3) of the plane in the axes of a lattice."""
    turn = rotation(float(T_lattice_plane[2]))
    return np.asarray(turn @ covariances @ turn.T)
