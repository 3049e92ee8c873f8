"""Beliefs, steps, pairs and decoded places -> the poses that agree with them best. Thesis 4.3.

Every constraint says where frame b lies in frame a, and how sure it is:

    face   - touch    decoded by the reader
    arm    - touch    believed by the arm, in a frame of its own
    touch  - touch    registered images (`pair`), or a step that was counted on the way

so there is one residual, r = T_a^-1 T_b - z. A constraint that disagrees with the rest is let go:
its chi^2 is scaled by s^2, s = min(1, 2 f / (f + chi^2)), which leaves good constraints as they
are (dynamic covariance scaling). Levenberg-Marquardt on sparse normal equations.

Agarwal, Tipaldi, Spinello, Stachniss and Burgard, "Robust map optimization using dynamic
covariance scaling", ICRA 2013. Kuemmerle et al., "g2o", ICRA 2011.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.planar import relative_pose, wrap_angle
from recognizer.scan.mosaic.settings import GRAPH

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

PLANE, ARM = -2, -1  #: the mosaic's frame, which stands fast, and the arm's

Kind = Literal["decoded", "believed", "stepped", "pair"]


@dataclass(frozen=True, slots=True, eq=False)
class Constraint:
    """Where frame b lies in frame a."""

    a: int  #: number of a touch, PLANE or ARM
    b: int  #: number of a touch
    pose: Array  #: (3,) T_a_b, mm and rad
    information: Array  #: (3, 3) inverse covariance, axes of a; may be singular
    kind: Kind
    log_gain: float = 0.0  #: of readings of a over those of b


@dataclass(frozen=True, slots=True, eq=False)
class PoseGraphSolution:
    """Poses and what is known of them."""

    poses: Array  #: (n, 3) T_plane_touch
    arm: Array  #: (3,) T_plane_arm
    chi2: Array  #: (m,) of each constraint
    weights: Array  #: (m,) 0 ... 1; under `GRAPH.outlier` a constraint is taken as wrong
    cost: float
    steps: int
    normal: Any  #: sparse matrix (3 n + 3) square, inverse covariance of poses and arm


def solve_pose_graph(
    constraints: Sequence[Constraint], poses: Array, arm: Array, *, arm_stands: bool
) -> PoseGraphSolution:
    """Return the poses that agree best with all constraints.

    Parameters
    ----------
    constraints
        Every touch must hang on the plane by some of them.
    poses, arm
        (n, 3) and (3,) to start from.
    arm_stands
        The arm's frame is the plane's (no touch was decoded).
    """
    from scipy.sparse import diags
    from scipy.sparse.linalg import splu

    graph = _graph(constraints, len(poses), arm_stands=arm_stands)
    at = np.concatenate([poses, arm[None]])
    damping, steps = 1e-6, 0
    now = _linearise(graph, at)
    while steps < GRAPH.steps:
        steps += 1
        diagonal = diags(now.normal.diagonal() * damping)
        step = splu((now.normal + diagonal).tocsc()).solve(now.pull).reshape(-1, 3)
        moved = at + step
        moved[:, 2] = wrap_angle(moved[:, 2])
        then = _linearise(graph, moved)
        if then.cost > now.cost * (1 + 1e-12) and damping < 1e6:
            damping *= 10
            continue
        damping = max(damping / 10, 1e-9)
        at, now = moved, then
        if np.abs(step[:, :2]).max() < GRAPH.done_mm and np.abs(step[:, 2]).max() < GRAPH.done_rad:
            break
    return PoseGraphSolution(at[:-1], at[-1], now.chi2, now.weights, now.cost, steps, now.normal)


def covariances(normal: Any, numbers: Sequence[int]) -> Array:
    """Return (k, 3, 3) of some poses of `PoseGraphSolution.normal`, x, y (mm) and theta (rad).

    The arm's frame has the number n, after all touches.
    """
    from scipy.sparse.linalg import splu

    factor, size = splu(normal.tocsc()), normal.shape[0]
    found = np.empty((len(numbers), 3, 3))
    for first in range(0, len(numbers), GRAPH.at_once):
        some = np.asarray(numbers[first : first + GRAPH.at_once])
        rows = (3 * some[:, None] + np.arange(3)).reshape(-1)
        right = np.zeros((size, len(rows)))
        right[rows, np.arange(len(rows))] = 1.0
        blocks = factor.solve(right)[rows].reshape(len(some), 3, len(some), 3)
        k = np.arange(len(some))
        found[first : first + len(some)] = blocks[k, :, k, :]
    return (found + found.swapaxes(1, 2)) / 2


@dataclass(frozen=True, slots=True, eq=False)
class _Graph:
    """Ties as arrays; the plane has the number n + 1, the arm n."""

    a: Ints
    b: Ints
    pose: Array  #: (m, 3)
    information: Array  #: (m, 3, 3)
    n: int
    stands: NDArray[np.bool_]  #: (n + 2,) frames that are not moved


@dataclass(frozen=True, slots=True, eq=False)
class _Linearisation:
    cost: float
    chi2: Array
    weights: Array
    normal: Any
    pull: Array


def _graph(constraints: Sequence[Constraint], n: int, *, arm_stands: bool) -> _Graph:
    number = {PLANE: n + 1, ARM: n}
    stands = np.zeros(n + 2, np.bool_)
    hangs = any(constraint.a == ARM for constraint in constraints)
    stands[n + 1], stands[n] = True, arm_stands or not hangs
    return _Graph(
        a=np.array([number.get(constraint.a, constraint.a) for constraint in constraints]),
        b=np.array([constraint.b for constraint in constraints]),
        pose=np.array([constraint.pose for constraint in constraints]),
        information=np.array([constraint.information for constraint in constraints]),
        n=n,
        stands=stands,
    )


def _linearise(graph: _Graph, at: Array) -> _Linearisation:
    """Return cost, gradient and normal equations at poses (n + 1, 3), the arm's last."""
    from scipy.sparse import coo_matrix

    every = np.concatenate([at, np.zeros((1, 3))])
    relative = relative_pose(every[graph.a], every[graph.b])
    residual = relative - graph.pose
    residual[:, 2] = wrap_angle(residual[:, 2])
    pushed = (graph.information @ residual[:, :, None])[:, :, 0]
    chi2 = (residual * pushed).sum(axis=1)
    scale = np.minimum(1.0, 2 * GRAPH.free / (GRAPH.free + chi2))
    weights = np.maximum(scale**2, GRAPH.least)
    cost = float((scale**2 * chi2 + GRAPH.free * (1 - scale) ** 2).sum())
    by_a, by_b = _slopes(every[graph.a, 2], relative)
    heavy = graph.information * weights[:, None, None]
    rows, columns, blocks = [], [], []
    pull = np.zeros((graph.n + 2, 3))
    for one, by_one in ((graph.a, by_a), (graph.b, by_b)):
        left = by_one.swapaxes(1, 2) @ heavy
        free = ~graph.stands[one]
        np.add.at(pull, one[free], -(left @ residual[:, :, None])[free, :, 0])
        for other, by_other in ((graph.a, by_a), (graph.b, by_b)):
            both = free & ~graph.stands[other]
            rows.append(one[both])
            columns.append(other[both])
            blocks.append((left @ by_other)[both])
    fast = np.flatnonzero(graph.stands[:-1])  # the arm, where it stands
    rows.append(fast)
    columns.append(fast)
    blocks.append(np.broadcast_to(np.eye(3), (len(fast), 3, 3)))
    row, column = (3 * np.concatenate(k) for k in (rows, columns))
    i, j = np.mgrid[:3, :3]
    normal = coo_matrix(
        (
            np.concatenate(blocks).reshape(-1),
            (
                (row[:, None, None] + i).reshape(-1),
                (column[:, None, None] + j).reshape(-1),
            ),
        ),
        shape=(3 * graph.n + 3, 3 * graph.n + 3),
    ).tocsc()
    return _Linearisation(cost, chi2, weights, normal, pull[:-1].reshape(-1))


def _slopes(theta_a: Array, relative: Array) -> tuple[Array, Array]:
    """Return what the residuals change by the poses of a and b, (m, 3, 3) each."""
    c, s = np.cos(theta_a), np.sin(theta_a)
    by_b = np.zeros((len(theta_a), 3, 3))
    by_b[:, 0, 0], by_b[:, 0, 1] = c, s
    by_b[:, 1, 0], by_b[:, 1, 1] = -s, c
    by_b[:, 2, 2] = 1.0
    by_a = -by_b
    by_a[:, 0, 2], by_a[:, 1, 2] = relative[:, 1], -relative[:, 0]
    return by_a, by_b
