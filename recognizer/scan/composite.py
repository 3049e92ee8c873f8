"""What all touches say of each cell of a lattice, summed into one fit. Thesis 6.3.

Each touch says at most so much of a cell. Touches of one print by one sensor err alike, so n
of them count as n / (1 + (n - 1) rho) that err by chance, n being how many really look at the
cell. A touch that contradicts all others is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.lattice import Agreement, expected_at
from recognizer.scan.settings import ScanSettings
from recognizer.scan.views import LatticeViews, TouchPoses
from recognizer.touch.symbols.fit import Fit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Composite:
    """A lattice of the plane with all that is known of its cells."""

    agreement: Agreement
    fit: Fit  #: of all touches; its pose is that of the last one
    looks: Array  #: (cells,) by how many touches a cell is seen, in effect
    last: Fit | None  #: of the last touch by itself, its cells as here; None: it does not agree


def composite(
    views: LatticeViews,
    touch_poses: TouchPoses,
    agreement: Agreement,
    pitch_mm: float,
    limits: ScanSettings,
) -> Composite | None:
    """Return the sum of what agrees; None where nothing does."""
    contradicting = True
    while contradicting:
        if not (agreement.chosen >= 0).any():
            return None
        cells, scores, seen, looks, against = _sum_evidence(views, agreement, limits)
        worst = int(np.argmin(against))
        contradicting = against[worst] < -limits.contradicts and (agreement.chosen >= 0).sum() > 2
        if contradicting:
            others = np.arange(len(agreement.chosen)) != worst
            agreement = replace(
                agreement,
                chosen=np.where(others, agreement.chosen, -1),
                score=agreement.score - limits.left_out - agreement.scores[worst],
                scores=np.where(others, agreement.scores, -limits.left_out),
            )
    most = scores.max(axis=1)
    last = len(agreement.chosen) - 1
    view = int(agreement.chosen[last])
    pose, covariance = expected_at(
        agreement.lattice, touch_poses.poses[last], touch_poses.covariances[last]
    )
    shown = views.fits[view if view >= 0 else int(agreement.chosen.max())]
    if view >= 0:
        pose = views.poses[view] - np.append(agreement.shifts[last] * pitch_mm, 0.0)
        covariance = views.covariances[view]
    own = replace(shown, cells=shown.cells - agreement.shifts[last]) if view >= 0 else None
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
    return Composite(agreement, fit, looks, own)


def expected_fit(found: Composite, touch_poses: TouchPoses) -> Fit:
    """Return a composite's fit with the last touch where the others lead to expect it."""
    pose, covariance = expected_at(
        found.agreement.lattice, touch_poses.poses[-1], touch_poses.covariances[-1]
    )
    x, y, theta = pose.tolist()
    return replace(found.fit, x_mm=x, y_mm=y, theta_rad=theta, covariance=covariance)


def _sum_evidence(
    views: LatticeViews, agreement: Agreement, limits: ScanSettings
) -> tuple[Ints, Array, Array, Array, Array]:
    """Return cells, scores, how much is seen, looks, and (n,) what each touch is contradicted."""
    touches = np.flatnonzero(agreement.chosen >= 0)
    chosen = [views.fits[agreement.chosen[t]] for t in touches]
    every = np.concatenate(
        [fit.cells - agreement.shifts[t] for t, fit in zip(touches, chosen, strict=True)]
    )
    owner = np.repeat(touches, [len(fit.cells) for fit in chosen])
    said = np.maximum(np.concatenate([fit.scores for fit in chosen]), -limits.look)
    cells, place = np.unique(every, axis=0, return_inverse=True)
    place = place.reshape(-1)

    def summed(values: Array) -> Array:
        return np.bincount(place, values, len(cells)).astype(np.float64)

    told = -said.min(axis=1)
    looks = summed(told) ** 2 / np.maximum(summed(told**2), 1e-12)
    looks = np.maximum(looks, 1.0)
    factor = 1 / (1 + (looks - 1) * limits.alike)
    scores = np.stack([summed(column) for column in said.T], axis=1)
    best = scores.argmax(axis=1)
    lost = said[np.arange(len(said)), best[place]]
    against = np.bincount(owner, lost, len(agreement.chosen))
    seen = summed(np.concatenate([fit.seen for fit in chosen]))
    return cells, scores * factor[:, None], seen, looks, against.astype(np.float64)
