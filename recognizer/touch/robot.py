"""What a touch says and where arm and wrist hold the sensor -> the object in the robot's base.

    T_robot_object = T_robot_probe T_object_probe^-1                         Thesis 4.1, 6.3

The recognizer tells three of the six freedoms, x, y and the turn on the face. The other three
are told by contact: the tips lie on the symbols and the sensor lies flat, as well as `Seating`
says. Covariances are (6, 6) of (x, y, z, rx, ry, rz), displacement of the origin (mm) and small
turn about it (rad), both in base axes: T_true = [exp(r) R | p + (x, y, z)].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.arm.carried import SensorPose, sensor_pose
from probe.arm.links import Arm
from probe.wrist.distances import distances_mm, wrist_pose
from probe.wrist.geometry import Wrist
from recognizer.touch.recognition import Recognition

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Seating:
    """How well the sensor lies on the face; standard deviations."""

    z_mm: float = 0.9  #: by which the tips are pressed in, 0.4 ... 1.4 mm at 20 ... 120 N
    tilt_rad: float = math.radians(1.5)  #: of the sensor against the face, both ways


@dataclass(frozen=True, slots=True, eq=False)
class ObjectPose:
    """Where the object is in the robot's base frame."""

    T_robot_object: Array  #: (4, 4), mm
    covariance: Array  #: (6, 6) of (x, y, z, rx, ry, rz), base axes, mm and rad

    def __str__(self) -> str:
        at = ", ".join(f"{value:.1f}" for value in self.T_robot_object[:3, 3])
        spread = math.sqrt(max(float(self.covariance[:3, :3].trace()), 0.0))
        return f"object in the robot's base at ({at}) mm +- {spread:.1f}"


def carried_pose(
    arm: Arm, wrist: Wrist, joints_rad: ArrayLike, joint_covariance: ArrayLike, counts: ArrayLike
) -> SensorPose:
    """Return where arm and wrist hold the sensor.

    Parameters
    ----------
    arm, wrist
        Their geometry.
    joints_rad
        (5,) joint angles, rad.
    joint_covariance
        (5,) standard deviations, rad; or (5, 5), rad^2.
    counts
        (4,) readings of the wrist's transducers.

    Raises
    ------
    PoseError
        Joint angles that are none, or distances that no plate can have.
    """
    hanging = wrist_pose(wrist, distances_mm(wrist, counts))
    return sensor_pose(arm, joints_rad, joint_covariance, wrist, hanging)


def object_pose(
    recognition: Recognition, sensor: SensorPose, seating: Seating | None = None
) -> ObjectPose | None:
    """Return the recognised object in the robot's base; None where nothing was recognised.

    Parameters
    ----------
    recognition
        Of a touch.
    sensor
        Where the sensor was during it.
    seating
        How well it lay on the face.

    Notes
    -----
    With a = p_object - p_sensor and R from the face to the base, errors d and r of the sensor and
    e and s of the touch (face axes) move the object by d - R e + (r - R s) x a and turn it by
    r - R s.
    """
    T_face_probe, T_object_probe = recognition.T_face_probe, recognition.T_object_probe
    if T_face_probe is None or T_object_probe is None or recognition.covariance is None:
        return None
    T_robot_object = sensor.T_base_sensor @ _inverse(T_object_probe)
    R_base_face = sensor.T_base_sensor[:3, :3] @ T_face_probe[:3, :3].T
    both = np.kron(np.eye(2), R_base_face)
    touch = both @ _on_face(recognition.covariance, seating or Seating()) @ both.T
    lever = np.eye(6)
    x, y, z = T_robot_object[:3, 3] - sensor.T_base_sensor[:3, 3]
    lever[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    covariance = lever @ (sensor.covariance + touch) @ lever.T
    return ObjectPose(T_robot_object, (covariance + covariance.T) / 2)


def _on_face(covariance: Array, seating: Seating) -> Array:
    """Return (6, 6) of the probe on the face, face axes."""
    whole = np.zeros((6, 6))
    known = np.ix_([0, 1, 5], [0, 1, 5])
    whole[known] = covariance
    whole[2, 2] = seating.z_mm**2
    whole[3, 3] = whole[4, 4] = seating.tilt_rad**2
    return whole


def _inverse(T: Array) -> Array:
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse
