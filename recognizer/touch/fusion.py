"""Poses of an object by several touches -> one pose, and whether the object was moved.

Poses and covariances as in `recognizer.touch.robot`: (6, 6) of (x, y, z, rx, ry, rz), base axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.robot import ObjectPose

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FusedPose:
    """Where the object is by several touches, and whether they agree."""

    pose: ObjectPose
    chi2: float  #: squared disagreement over the covariances
    freedoms: int  #: 6 for each pose beyond the first
    since: int  #: index of the first pose since the object lies where it does now
    moved: bool  #: the object was moved before `since`: fuse what came since


@dataclass(frozen=True, slots=True)
class FusionSettings:
    """When poses of an object do not belong to one place."""

    chance: float = 1e-3  #: of touches of an object that lay still being taken for moved
    steps: int = 3  #: of Gauss and Newton's method; the first is enough for turns below a degree


FUSION = FusionSettings()


def fuse_poses(poses: Sequence[ObjectPose]) -> FusedPose:
    """Return one pose of an object from those that single touches of a face told.

    Errors of joints, wrist and symbols are drawn anew at every touch and average out. How deep the
    sensor sinks in (`ObjectPose.shared`) is the same each time, and stays.

    Parameters
    ----------
    poses
        One or more of one object, in one base frame, as `object_pose` gives them, in the order of
        their time. All are fused, whether or not it was moved in between.
    """
    told = np.stack([pose.T_robot_object for pose in poses])
    own = [pose.covariance - pose.shared for pose in poses]
    weights = np.asarray(np.linalg.inv(own), np.float64)
    information = weights.sum(axis=0)
    T = told[0]
    for _ in range(FUSION.steps):
        pull = np.einsum("nij,nj->i", weights, _differences(told, T))
        T = _displaced(T, np.asarray(np.linalg.solve(information, pull)))
    offs = _differences(told, T)
    chi2 = float(np.einsum("ni,nij,nj->", offs, weights, offs))
    whole = np.linalg.inv(information) + poses[0].shared
    placed = ObjectPose(T, (whole + whole.T) / 2, poses[0].shared)
    since, moved = _last_move(offs, weights)
    return FusedPose(placed, chi2, 6 * (len(poses) - 1), since, moved)


def _last_move(offs: Array, weights: Array) -> tuple[int, bool]:
    """Return where to part poses (n, 6) so that both parts differ most; and whether they do.

    Both parts are means of their own; their difference has six freedoms, and one of n - 1 places
    to part was chosen.
    """
    from scipy.special import gammaincinv

    if len(offs) < 2:
        return 0, False
    information = np.cumsum(weights, axis=0)
    pulls = np.cumsum(np.einsum("nij,nj->ni", weights, offs), axis=0)
    before = np.linalg.inv(information[:-1])
    after = np.linalg.inv(information[-1] - information[:-1])
    steps = np.einsum("nij,nj->ni", after, pulls[-1] - pulls[:-1])
    steps -= np.einsum("nij,nj->ni", before, pulls[:-1])
    apart = np.einsum("ni,nij,nj->n", steps, np.linalg.inv(before + after), steps)
    limit = 2 * float(gammaincinv(3.0, 1 - FUSION.chance / len(apart)))
    since = 1 + int(np.argmax(apart))
    return (since, True) if apart[since - 1] > limit else (0, False)


def _differences(T_to: Array, T_from: Array) -> Array:
    """Return (n, 6) what displaces and turns one pose into each of others (n, 4, 4), base axes."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_matrix(T_to[:, :3, :3] @ T_from[:3, :3].T).as_rotvec()
    return np.concatenate([T_to[:, :3, 3] - T_from[:3, 3], turns], axis=1)


def _displaced(T: Array, step: Array) -> Array:
    """Return a pose displaced and turned by (6,), base axes."""
    from scipy.spatial.transform import Rotation

    moved = T.copy()
    moved[:3, 3] += step[:3]
    moved[:3, :3] = Rotation.from_rotvec(step[3:]).as_matrix() @ T[:3, :3]
    return moved
