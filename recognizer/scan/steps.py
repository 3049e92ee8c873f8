"""Steps from touch to touch: what is known of them, and what the touches themselves leave open.

Steps are poses (3,) of a touch in the axes of one before: x, y (mm), theta (rad). Thesis 4.3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.planar import (
    PlacedTouch,
    PlanarBelief,
    compose_poses,
    composed_covariance,
    relative_covariance,
    relative_pose,
    wrap_angle,
)
from recognizer.scan.settings import PATHS, ScanSettings
from recognizer.touch.symbols.fit import Fit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def steps_of(touches: Sequence[PlacedTouch], settings: ScanSettings) -> list[PlanarBelief]:
    """Return what is known of the step to each touch from the one before; of the first, nothing."""
    unknown = PlanarBelief(np.zeros(3), np.diag(np.square(settings.by_hand)))
    steps = [unknown]
    for before, touch in pairwise(touches):
        if touch.stepped is not None:
            steps.append(touch.stepped)
        elif before.believed is not None and touch.believed is not None:
            a, b = before.believed, touch.believed
            spread = relative_covariance(a.pose, b.pose, a.covariance, b.covariance)
            steps.append(PlanarBelief(relative_pose(a.pose, b.pose), spread))
        else:
            steps.append(unknown)
    return steps


def step_between(steps: Sequence[PlanarBelief], a: int, b: int) -> PlanarBelief:
    """Return what is known of the step from a touch to a later one."""
    pose, covariance = steps[a + 1].pose, steps[a + 1].covariance
    for more in steps[a + 2 : b + 1]:
        covariance = composed_covariance(pose, more.pose, covariance, more.covariance)
        pose = compose_poses(pose, more.pose)
    return PlanarBelief(pose, covariance)


def log_freedom(
    fits: Mapping[int, Fit],
    poses: Array,
    steps: Sequence[PlanarBelief],
    pitch_mm: float,
    order: int,
    settings: ScanSettings,
) -> float:
    """Return the log of one over the probability that touches by themselves give to a path.

    Whole pitches beside, a touch shows cells that were seen before with other symbols, or with the
    same ones by chance.

    Parameters
    ----------
    fits
        Of the touches that are placed, in their order.
    poses
        (n, 3) of all touches, in axes of the array.
    order
        Number of symbols.
    """
    seen: dict[tuple[int, int], Array] = {}
    total, before = 0.0, -1
    near = range(-PATHS.shifts, PATHS.shifts + 1)
    for t, fit in fits.items():
        cells = fit.cells + np.rint((poses[t, :2] - (fit.x_mm, fit.y_mm)) / pitch_mm).astype(int)
        said = np.maximum(fit.scores, -settings.look)
        if before >= 0:
            step, own = step_between(steps, before, t), _shares(said)
            values = {}
            for shift in ((i, j) for i in near for j in near):
                beside = poses[t] + np.array([*shift, 0.0]) * pitch_mm
                agreed = _log_agreement(seen, cells + shift, own, order)
                values[shift] = agreed - _cost(step, relative_pose(poses[before], beside))
            total += float(np.logaddexp.reduce(list(values.values()))) - values[0, 0]
        for cell, each in zip(map(tuple, cells.tolist()), said, strict=True):
            seen[cell] = seen[cell] + each if cell in seen else each
        before = t
    return total


def _log_agreement(
    seen: Mapping[tuple[int, int], Array], cells: Ints, own: Array, order: int
) -> float:
    """Return by how many nats cells show what was seen there, rather than any symbols."""
    both = [(seen[at], share) for at, share in zip(map(tuple, cells.tolist()), own, strict=True)
            if at in seen]  # fmt: skip
    if not both:
        return 0.0
    alike = (_shares(np.array([one for one, _ in both])) * [share for _, share in both]).sum(axis=1)
    return float(np.log(order * alike).sum())


def _cost(step: PlanarBelief, made: Array) -> float:
    """Return what a step (3,) costs, nats."""
    away = made - step.pose
    away[2] = wrap_angle(away[2])
    return 0.5 * float(away @ np.linalg.solve(step.covariance, away))


def _shares(scores: Array) -> Array:
    """Return probabilities (m, q + 1) of what cells show, by their log-likelihoods."""
    each = np.exp(scores - scores.max(axis=1, keepdims=True))
    return np.asarray(each / each.sum(axis=1, keepdims=True))
