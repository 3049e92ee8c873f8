"""Speeds of the gripper for speeds of the joints, and back without blowing up. Thesis 4.1.

Geometric Jacobian: rows are the velocity of a point (mm/s) and the angular velocity (rad/s),
both in base axes; columns are the joints. Singular where the arm is stretched or folded
(elbow), where the gripper stands over the base's axis (shoulder).

References
----------
Y. Nakamura, H. Hanafusa, "Inverse kinematic solutions with singularity robustness", 1986;
A. A. Maciejewski, C. A. Klein, "Numerical filtering for the operation of robotic manipulators
through kinematically singular configurations", 1988: damping by singular direction.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.arm.links import AXES, Arm, joint_frames
from probe.arm.settings import ARM_MOTION
from probe.errors import PoseError

GAIN: Final = 2 / 3**0.5  #: joint speed by damping, at most, times the least singular value


def jacobian(arm: Arm, q: ArrayLike, point_mm: ArrayLike | None = None) -> NDArray[np.float64]:
    """Return the geometric Jacobian, (6, 5).

    Parameters
    ----------
    arm
        The arm.
    q
        (5,) joint angles, rad.
    point_mm
        (3,) the point that moves, base frame; the gripper's origin if not given.

    Returns
    -------
    Rows v (mm/s per rad/s) and omega, base axes.
    """
    frames = joint_frames(arm, q)
    point = frames[AXES, :3, 3] if point_mm is None else np.asarray(point_mm, np.float64)
    axes = frames[:AXES, :3, 2]
    arms = point - frames[:AXES, :3, 3]
    return np.concatenate([np.cross(axes, arms).T, axes.T])


def condition(arm: Arm, q: ArrayLike) -> float:
    """Return the condition number of the Jacobian, lengths in links; infinite where singular."""
    values = np.linalg.svd(_scaled_jacobian(arm, q), compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0 else np.inf


def joint_speeds(arm: Arm, q: ArrayLike, twist: ArrayLike) -> NDArray[np.float64]:
    """Return joint speeds (5,), rad/s, that follow a twist as well as bounded speeds can.

    Least squares by singular directions. One that is weaker than `ARM_MOTION.least_singular` is
    damped, the more the weaker it is, so that nothing jumps on the way into a singularity, the
    other directions are followed exactly, and no unit of speed (a link's length per second) asks
    for more than GAIN over that value, 58 rad/s.

    Parameters
    ----------
    arm
        The arm.
    q
        (5,) joint angles, rad.
    twist
        (6,) velocity of the gripper's origin (mm/s) and angular velocity (rad/s), base axes.

    Raises
    ------
    PoseError
        A value that is no number.
    """
    wanted = np.asarray(twist, np.float64)
    if wanted.shape != (6,) or not np.isfinite(wanted).all():
        raise PoseError(f"a twist {wanted.tolist()}", fix="give 3 speeds in mm/s and 3 in rad/s")
    wanted = wanted / np.repeat([ARM_MOTION.length_mm, 1.0], 3)
    u, values, v = np.linalg.svd(_scaled_jacobian(arm, q), full_matrices=False)
    weak = np.clip(values / ARM_MOTION.least_singular, 0.0, 1.0)
    damping = (1 - weak**2) * (ARM_MOTION.least_singular / 2) ** 2
    safe = np.where(values > 0, values, 1.0)
    gains = np.where(values > 0, values / (safe**2 + damping), 0.0)
    speeds: NDArray[np.float64] = v.T @ (gains * (u.T @ wanted))
    return speeds


def _scaled_jacobian(arm: Arm, q: ArrayLike) -> NDArray[np.float64]:
    scaled: NDArray[np.float64] = (
        jacobian(arm, q) / np.repeat([ARM_MOTION.length_mm, 1.0], 3)[:, None]
    )
    return scaled
