"""Several poses of an object as one: tighter, honest, and a move is noticed."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from recognizer.touch.robot import MOVED_CHANCE, ObjectPose, fuse_poses


def pose_of(rotvec, at):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotvec).as_matrix()
    T[:3, 3] = at
    return T


def moved(T, error):
    """A pose with an error of its origin and a small turn about it."""
    turn = Rotation.from_rotvec(error[3:]) * Rotation.from_matrix(T[:3, :3])
    return pose_of(turn.as_rotvec(), T[:3, 3] + error[:3])


BASE = pose_of([0.2, -0.1, 0.9], [320.0, 40.0, 30.0])
SPREAD = np.diag([0.2, 0.2, 0.4, 2e-3, 2e-3, 2e-3]) ** 2


def drawn(rng, number, shift=None, after=0):
    """Poses of an object that is shifted after some of them."""
    poses = []
    for k in range(number):
        T = BASE if shift is None or k < after else moved(BASE, np.array(shift))
        poses.append(ObjectPose(moved(T, rng.multivariate_normal(np.zeros(6), SPREAD)), SPREAD))
    return poses


def test_several_touches_tighten_and_hold():
    """Errors drawn anew shrink by the root of the number; what is shared stays, and is honest."""
    rng = np.random.default_rng(6)
    base = BASE
    roots = [rng.normal(0, 1, (6, 6)) * np.repeat([0.2, 0.002], 3)[:, None] for _ in range(9)]
    own = [root @ root.T for root in roots]
    shared = np.diag([0.0, 0.0, 0.16, 1e-4, 1e-4, 0.0])
    inside, moved_ones, number = 0, 0, 400
    for _ in range(number):
        common = rng.multivariate_normal(np.zeros(6), shared)
        poses = []
        for covariance in own:
            off = rng.multivariate_normal(np.zeros(6), covariance) + common
            poses.append(ObjectPose(moved(base, -off), covariance + shared, shared))
        fused = fuse_poses(poses)
        moved_ones += fused.moved
        left = np.concatenate(
            [
                base[:3, 3] - fused.pose.T_robot_object[:3, 3],
                Rotation.from_matrix(
                    base[:3, :3] @ fused.pose.T_robot_object[:3, :3].T
                ).as_rotvec(),
            ]
        )
        inside += left @ np.linalg.solve(fused.pose.covariance, left) < 12.592
    assert 0.92 < inside / number < 0.98
    assert moved_ones <= 3
    tight = np.linalg.inv(sum(np.linalg.inv(covariance) for covariance in own)) + shared
    assert fused.pose.covariance == pytest.approx(tight, rel=1e-6, abs=1e-12)
    assert fused.freedoms == 48


@pytest.mark.parametrize("after", [1, 3, 5])
def test_a_moved_object_is_noticed_and_since_when(after):
    rng = np.random.default_rng(7)
    shift = [2.0, -1.5, 0.0, 0.0, 0.0, 0.02]
    for _ in range(20):
        fused = fuse_poses(drawn(rng, 6, shift, after))
        assert (fused.moved, fused.since) == (True, after)
        again = fuse_poses(drawn(rng, 6, shift, after)[fused.since :])
        assert (again.moved, again.since) == (False, 0)


def test_an_object_that_lies_still_is_not_taken_for_moved():
    rng = np.random.default_rng(8)
    number = 600
    alarms = sum(fuse_poses(drawn(rng, 2 + k % 4)).moved for k in range(number))
    assert alarms <= 4  # MOVED_CHANCE of them, .6
    assert MOVED_CHANCE == 1e-3


def test_one_pose_fused_is_itself():
    placed = ObjectPose(BASE, SPREAD)
    fused = fuse_poses([placed])
    assert fused.pose.T_robot_object == pytest.approx(placed.T_robot_object, abs=1e-12)
    assert fused.pose.covariance == pytest.approx(placed.covariance, rel=1e-6)
    assert (fused.freedoms, fused.moved, fused.since) == (0, False, 0)
