"""The recognised object in the robot's base: by joint angles and wrist, or by a recorded pose."""

from __future__ import annotations

import math

import numpy as np

from probe.arm.carried import SensorPose
from probe.arm.links import Arm
from probe.errors import PoseError
from probe.wrist.geometry import Wrist
from recognizer.touch.contacts import TouchImage
from recognizer.touch.recognition import Recognition
from recognizer.touch.robot import ObjectPose, carried_pose, object_pose


def object_in_base(
    touch: TouchImage,
    recognition: Recognition,
    joints_deg: tuple[float, ...] | None,
    joint_error_deg: float,
) -> tuple[ObjectPose | None, str]:
    """Return where the object is, if that is known, and what kept it from being known.

    Parameters
    ----------
    touch, recognition
        What was touched; its pose counts where no joint angles are given, taken as exact.
    joints_deg, joint_error_deg
        (5,) joint angles, and the standard deviation of each, degrees.
    """
    if joints_deg is None:
        if touch.pose is None:
            return None, ""
        return object_pose(recognition, SensorPose(touch.pose, np.zeros((6, 6)))), ""
    errors = np.full(len(joints_deg), math.radians(joint_error_deg))
    try:
        sensor = carried_pose(Arm(), Wrist(), np.radians(joints_deg), errors, touch.wrist)
    except PoseError as error:
        return None, str(error)
    return object_pose(recognition, sensor), ""
