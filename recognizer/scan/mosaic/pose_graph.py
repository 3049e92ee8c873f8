"""Poses that agree best with beliefs, steps, registrations and decoded places. Thesis 4.3.

Every constraint gives the pose of frame b in frame a with its information:

    plane  - touch    decoded by the reader, or believed by the arm
    touch  - touch    registered images (`register`), or a counted step

so there is one residual, r = T_a^-1 T_b - z. A constraint that disagrees with the rest is switched
off: its chi^2 is scaled by s^2, s = min(1, 2 f / (f + chi^2)), which leaves good constraints
unchanged (dynamic covariance scaling). Levenberg-Marquardt on sparse normal equations.

Agarwal, Tipaldi, Spinello, Stachniss and Burgard, "Robust map optimization using dynamic
covariance scaling", ICRA 2013. Kuemmerle et al., "g2o", ICRA 2011.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.planar import pose_difference, relative_pose, wrap_angle

Array = NDArray[np.float64]

PLANE = -1  #: the mosaic's frame, which is fixed

FREE_CHI2 = 16.0  #: chi^2 of three numbers from which a constraint is doubted; .1 % of good ones
LEAST_WEIGHT = 1e-4  #: of a constraint that is switched off; keeps every touch somewhere
STEPS = 30  #: at most
DONE_MM = 1e-4  #: of x and y: a step under both is the last one
DONE_RAD = 1e-6  #: of turns


@dataclass(frozen=True, slots=True, eq=False)
class Constraint:
    """The pose of frame b in frame a."""

    a: int  #: number of a touch, or PLANE
    b: int  #: number of a touch
    pose: Array  #: (3,) T_a_b, mm and rad
    information: Array  #: (3, 3) inverse covariance, axes of a; may be singular


@dataclass(frozen=True, slots=True, eq=False)
class PoseGraphSolution:
    """Poses with the fit of each constraint."""

    poses: Array  #: (n, 3) T_plane_touch
    weights: Array  #: (m,) 0 ... 1; less for a constraint that disagrees
    cost: float
    normal: Any  #: sparse matrix (3 n) square, inverse covariance of poses


def solve_pose_graph(constraints: Sequence[Constraint], poses: Array) -> PoseGraphSolution:
    """Return the poses that agree best with all constraints.

    Constraints connect every touch to the plane; `poses` (n, 3) are the start.
    """
    from scipy.sparse import diags
    from scipy.sparse.linalg import splu

    linearise = _linearise(constraints, len(poses))
    at, damping = poses, 1e-6
    cost, weights, normal, pull = linearise(at)
    for _ in range(STEPS):
        diagonal = diags(normal.diagonal() * damping)
        step = splu((normal + diagonal).tocsc()).solve(pull).reshape(-1, 3)
        moved = at + step
        moved[:, 2] = wrap_angle(moved[:, 2])
        then = linearise(moved)
        if then[0] > cost * (1 + 1e-12) and damping < 1e6:
            damping *= 10
            continue
        damping = max(damping / 10, 1e-9)
        at, (cost, weights, normal, pull) = moved, then
        if np.abs(step[:, :2]).max() < DONE_MM and np.abs(step[:, 2]).max() < DONE_RAD:
            break
    return PoseGraphSolution(at, weights, cost, normal)


def covariances(normal: Any, numbers: Sequence[int]) -> Array:
    """Return covariances (k, 3, 3) of some poses (mm and rad)."""
    from scipy.sparse.linalg import splu

    count = len(numbers)
    rows = (3 * np.asarray(numbers)[:, None] + np.arange(3)).reshape(-1)
    right = np.zeros((normal.shape[0], 3 * count))
    right[rows, np.arange(3 * count)] = 1.0
    blocks = splu(normal.tocsc()).solve(right)[rows].reshape(count, 3, count, 3)
    found: Array = blocks[np.arange(count), :, np.arange(count), :]
    return (found + found.swapaxes(1, 2)) / 2


def robust_cost(chi2: Array) -> tuple[Array, Array]:
    """Return costs of constraints with dynamic covariance scaling, and their weights."""
    scale = np.minimum(1.0, 2 * FREE_CHI2 / (FREE_CHI2 + chi2))
    cost = scale**2 * chi2 + FREE_CHI2 * (1 - scale) ** 2
    return np.asarray(cost), np.maximum(scale**2, LEAST_WEIGHT)


def _linearise(
    constraints: Sequence[Constraint], n: int
) -> Callable[[Array], tuple[float, Array, Any, Array]]:
    """Return the cost, weights (m,), normal matrix and its right side by poses (n, 3).

    The plane, which is fixed, has the number n.
    """
    from scipy.sparse import coo_matrix

    a = np.array([n if constraint.a == PLANE else constraint.a for constraint in constraints])
    b = np.array([constraint.b for constraint in constraints])
    measured = np.array([constraint.pose for constraint in constraints])
    information = np.array([constraint.information for constraint in constraints])
    i, j = np.mgrid[:3, :3]

    def linearise(at: Array) -> tuple[float, Array, Any, Array]:
        every = np.concatenate([at, np.zeros((1, 3))])
        relative = relative_pose(every[a], every[b])
        residual = pose_difference(relative, measured)
        chi2 = (residual * (information @ residual[:, :, None])[:, :, 0]).sum(axis=1)
        costs, weights = robust_cost(chi2)
        by_a, by_b = _slopes(every[a, 2], relative)
        heavy = information * weights[:, None, None]
        rows, columns, blocks = [], [], []
        pull = np.zeros((n + 1, 3))
        for one, by_one in ((a, by_a), (b, by_b)):
            left = by_one.swapaxes(1, 2) @ heavy
            np.add.at(pull, one, -(left @ residual[:, :, None])[:, :, 0])
            for other, by_other in ((a, by_a), (b, by_b)):
                both = (one < n) & (other < n)
                rows.append(one[both])
                columns.append(other[both])
                blocks.append((left @ by_other)[both])
        row, column = (3 * np.concatenate(k)[:, None, None] for k in (rows, columns))
        places = (row + i).reshape(-1), (column + j).reshape(-1)
        normal = coo_matrix((np.concatenate(blocks).reshape(-1), places), shape=(3 * n, 3 * n))
        return float(costs.sum()), weights, normal.tocsc(), pull[:-1].reshape(-1)

    return linearise


def _slopes(theta_a: Array, relative: Array) -> tuple[Array, Array]:
    """Return the derivatives of the residuals by the poses of a and b, (m, 3, 3) each."""
    c, s = np.cos(theta_a), np.sin(theta_a)
    by_b = np.zeros((len(theta_a), 3, 3))
    by_b[:, 0, 0], by_b[:, 0, 1] = c, s
    by_b[:, 1, 0], by_b[:, 1, 1] = -s, c
    by_b[:, 2, 2] = 1.0
    by_a = -by_b
    by_a[:, 0, 2], by_a[:, 1, 2] = relative[:, 1], -relative[:, 0]
    return by_a, by_b
