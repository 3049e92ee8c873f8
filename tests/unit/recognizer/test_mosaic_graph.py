"""Constraints of all kinds -> poses, covariances and the constraints that were let go."""

from __future__ import annotations

import numpy as np
import pytest

from recognizer.scan.mosaic.planar import compose_poses, relative_pose, wrap_angle
from recognizer.scan.mosaic.pose_graph import (
    ARM,
    OUTLIER_WEIGHT,
    PLANE,
    Constraint,
    covariances,
    solve_pose_graph,
)

BELIEF, PAIR = np.diag([0.4, 0.4, 4e3]), np.diag([90.0, 60.0, 6e4])
SURE = np.diag([1e3, 1e3, 3e5])


def scene(rng, n=12):
    poses = np.column_stack([rng.uniform(0, 60, (n, 2)), rng.normal(0, 0.02, n)])
    near = [(a, b) for b in range(n) for a in range(b) if np.hypot(*(poses[b] - poses[a])[:2]) < 30]
    return poses, near


def noisy(rng, pose, information):
    return pose + rng.multivariate_normal(np.zeros(3), np.linalg.inv(information))


def test_constraints_without_errors_give_the_truth_from_afar():
    rng = np.random.default_rng(1)
    true, near = scene(rng)
    arm = np.array([5.0, -8.0, 0.6])
    constraints = [
        Constraint(ARM, n, relative_pose(arm, pose), BELIEF, "believed")
        for n, pose in enumerate(true)
    ]
    constraints += [
        Constraint(a, b, relative_pose(true[a], true[b]), PAIR, "pair") for a, b in near
    ]
    constraints += [Constraint(PLANE, n, true[n], SURE, "decoded") for n in (0, 7)]
    start = true + rng.normal(0, [2, 2, 0.02], true.shape)
    found = solve_pose_graph(
        constraints, start, arm + 0.05 * np.array([40, -40, 1]), arm_fixed=False
    )
    assert found.poses == pytest.approx(true, abs=1e-5)
    assert found.arm == pytest.approx(arm, abs=1e-4)
    assert found.cost < 1e-6
    assert found.steps < 15


def test_wrong_pairs_are_switched_off_and_named():
    rng = np.random.default_rng(2)
    true, near = scene(rng, 16)
    constraints = [
        Constraint(ARM, n, noisy(rng, p, BELIEF), BELIEF, "believed") for n, p in enumerate(true)
    ]
    wrong = set(range(3, len(near), 7))
    for k, (a, b) in enumerate(near):
        pose = noisy(rng, relative_pose(true[a], true[b]), PAIR)
        constraints.append(
            Constraint(a, b, pose + np.array([7.0 * (k in wrong), 0, 0]), PAIR, "pair")
        )
    found = solve_pose_graph(
        constraints, np.array([t.pose for t in constraints[:16]]), np.zeros(3), arm_fixed=True
    )
    assert set((np.flatnonzero(found.weights < OUTLIER_WEIGHT) - 16).tolist()) == wrong
    shape = (found.poses - true)[:, :2]
    assert np.hypot(*(shape - shape.mean(axis=0)).T).max() < 1.0


def test_covariances_are_true():
    rng = np.random.default_rng(3)
    true, near = scene(rng)
    inside = []
    for _ in range(60):
        constraints = [
            Constraint(ARM, n, noisy(rng, p, BELIEF), BELIEF, "believed")
            for n, p in enumerate(true)
        ]
        for a, b in near:
            pose = noisy(rng, relative_pose(true[a], true[b]), PAIR)
            constraints.append(Constraint(a, b, pose, PAIR, "pair"))
        found = solve_pose_graph(constraints, true, np.zeros(3), arm_fixed=True)
        spread = covariances(found.normal, range(len(true)))
        dense = np.linalg.inv(found.normal.toarray())
        assert spread[5] == pytest.approx(dense[15:18, 15:18], rel=1e-6, abs=1e-12)
        away = found.poses - true
        away[:, 2] = wrap_angle(away[:, 2])
        inside.append(np.einsum("ni,nij,nj->n", away, np.linalg.inv(spread), away) < 7.815)
    assert 0.9 < np.mean(inside) < 0.99


def test_a_constraint_along_a_ridge_leaves_the_rest_to_belief():
    across_only = np.diag([500.0, 0.0, 1e5])
    constraints = [
        Constraint(ARM, 0, np.zeros(3), SURE, "believed"),
        Constraint(ARM, 1, np.array([5.0, 1.0, 0.0]), BELIEF, "believed"),
        Constraint(0, 1, np.array([4.0, 9.0, 0.01]), across_only, "pair"),
    ]
    found = solve_pose_graph(constraints, np.zeros((2, 3)), np.zeros(3), arm_fixed=True)
    assert found.poses[1] == pytest.approx([4.0, 1.0, 0.01], abs=0.01)
    spread = covariances(found.normal, [1])[0]
    assert spread[1, 1] == pytest.approx(2.5, rel=0.01)
    assert spread[0, 0] < 0.01


def test_the_frame_does_not_matter():
    rng = np.random.default_rng(4)
    true, near = scene(rng)
    T = np.array([100.0, -40.0, 2.5])
    poses = [noisy(rng, pose, SURE) for pose in true]
    links = [(a, b, noisy(rng, relative_pose(true[a], true[b]), PAIR)) for a, b in near]

    def solution(shift):
        sure = np.diag([1e3, 1e3, 3e5])  # round, so that it may be turned
        constraints = [
            Constraint(PLANE, n, compose_poses(shift, p), sure, "decoded")
            for n, p in enumerate(poses)
        ]
        constraints += [Constraint(a, b, pose, PAIR, "pair") for a, b, pose in links]
        start = compose_poses(shift, np.array(poses))
        return solve_pose_graph(constraints, start, np.zeros(3), arm_fixed=False).poses

    assert compose_poses(T, solution(np.zeros(3))) == pytest.approx(solution(T), abs=1e-5)
