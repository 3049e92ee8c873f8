"""Joint angles and wrist -> pose of the sensor in the base frame, and how sure it is. Thesis 4.1.

T_base_sensor = T_base_gripper(q) T_gripper_plate(wrist) T_plate_sensor. The wrist's three
freedoms follow the arm's five like further joints, so that errors of all eight go the same
way. The covariance is (6, 6) of (x, y, z, rx, ry, rz): displacement of the sensor's origin
(mm) and small turn about it (rad), both in base axes: T_true = [exp(r) R | p + (x, y, z)].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.arm.jacobian import jacobian
from probe.arm.links import AXES, Arm, forward
from probe.errors import PoseError
from probe.wrist.geometry import Wrist, WristPose, gripper_to_plate, plate_to_sensor


@dataclass(frozen=True, slots=True)
class SensorPose:
    """Where the sensor is, as far as joints and wrist tell."""

    T_base_sensor: NDArray[np.float64]  #: (4, 4), mm
    covariance: NDArray[np.float64]  #: (6, 6) of (x, y, z, rx, ry, rz), base axes, mm and rad


def sensor_pose(
    arm: Arm, q: ArrayLike, joint_covariance: ArrayLike, wrist: Wrist, hanging: WristPose
) -> SensorPose:
    """Return the pose of the sensor with its covariance.

    Parameters
    ----------
    arm
        The arm.
    q
        (5,) joint angles, rad.
    joint_covariance
        (5, 5) of their errors, rad^2; or (5,) standard deviations, rad.
    wrist, hanging
        The wrist, and how its plate hangs.

    Raises
    ------
    PoseError
        Joint angles or their covariance are none.
    """
    errors = np.asarray(joint_covariance, np.float64)
    if errors.shape == (AXES,):
        errors = np.diag(errors**2)
    if errors.shape != (AXES, AXES) or not np.isfinite(errors).all():
        raise PoseError(
            f"a joint covariance of shape {errors.shape}",
            fix="give (5,) standard deviations in rad, or (5, 5) in rad^2",
        )
    T_base_gripper = forward(arm, q)
    T_base_plate = T_base_gripper @ gripper_to_plate(wrist, hanging)
    T_base_sensor = T_base_plate @ plate_to_sensor(wrist)
    columns = np.hstack(
        [
            jacobian(arm, q, T_base_sensor[:3, 3]),
            _wrist_columns(wrist, T_base_gripper, T_base_plate, T_base_sensor),
        ]
    )
    both = np.zeros((AXES + 3, AXES + 3))
    both[:AXES, :AXES] = errors
    both[AXES:, AXES:] = hanging.covariance
    covariance = columns @ both @ columns.T
    return SensorPose(T_base_sensor, (covariance + covariance.T) / 2)


def _wrist_columns(
    wrist: Wrist,
    T_base_gripper: NDArray[np.float64],
    T_base_plate: NDArray[np.float64],
    T_base_sensor: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return what z, theta_x and theta_y do to the sensor, (6, 3)."""
    c, s = math.cos(wrist.gamma_rad), math.sin(wrist.gamma_rad)
    turn = T_base_gripper[:3, :3]
    along = turn[:, 2]
    about_y = turn @ np.array([s, c, 0.0])  # the plate turns about y last, before gamma
    about_x = T_base_plate[:3, 0]
    arm = T_base_sensor[:3, 3] - T_base_plate[:3, 3]
    move = np.stack([along, np.cross(about_x, arm), np.cross(about_y, arm)], axis=1)
    rotate = np.stack([np.zeros(3), about_x, about_y], axis=1)
    return np.concatenate([move, rotate])
