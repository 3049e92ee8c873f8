"""What a touch says and where arm and wrist hold the sensor -> the object in the robot's base.

    T_robot_object = T_robot_probe T_object_probe^-1                         Thesis 4.1, 6.3

The recognizer tells three of the six freedoms, x, y and the turn on the face. The other three
are told by contact: the tips lie on the symbols and the sensor lies flat, as well as `Seating`
says. Covariances are (6, 6) of (x, y, z, rx, ry, rz), displacement of the origin (mm) and small
turn about it (rad), both in base axes: T_true = [exp(r) R | p + (x, y, z)].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

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
    shared: Array = field(default_factory=lambda: np.zeros((6, 6)))
    """(6, 6) of it, what is the same at every touch of a face: how the sensor sits."""

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
    sits = both @ _on_face(np.zeros((3, 3)), seating or Seating()) @ both.T
    touch = both @ _on_face(recognition.covariance, Seating(0.0, 0.0)) @ both.T + sits
    lever = np.eye(6)
    x, y, z = T_robot_object[:3, 3] - sensor.T_base_sensor[:3, 3]
    lever[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    covariance = lever @ (sensor.covariance + touch) @ lever.T
    return ObjectPose(T_robot_object, (covariance + covariance.T) / 2, lever @ sits @ lever.T)


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


@dataclass(frozen=True, slots=True, eq=False)
class FusedPose:
    """Where the object is by several touches, and whether they agree."""

    pose: ObjectPose
    chi2: float  #: squared disagreement over the covariances
    freedoms: int  #: 6 for each pose beyond the first
    moved: bool  #: they disagree by more than `FUSION.chance` would: the object was moved


@dataclass(frozen=True, slots=True)
class FusionSettings:
    """When poses of an object do not belong to one place."""

    chance: float = 1e-3  #: of touches of an object that lay still being taken for moved
    steps: int = 3  #: of Gauss and Newton's method; the first is enough for turns below a degree


FUSION = FusionSettings()


def fuse_poses(poses: Sequence[ObjectPose]) -> FusedPose:
    """Return one pose of an object from those that single touches of a face told.

    Errors of joints, wrist and symbols are drawn anew at every touch and average out. How the
    sensor sits on the face (`ObjectPose.shared`) is the same each time, and stays.

    Parameters
    ----------
    poses
        One or more of one object, in one base frame, as `object_pose` gives them.
    """
    from scipy.special import gammaincinv

    own = [pose.covariance - pose.shared for pose in poses]
    T = poses[0].T_robot_object
    for _ in range(FUSION.steps):
        information, pull = np.zeros((6, 6)), np.zeros(6)
        for pose, covariance in zip(poses, own, strict=True):
            weight = np.linalg.inv(covariance)
            information += weight
            pull += weight @ _difference(pose.T_robot_object, T)
        step = np.asarray(np.linalg.solve(information, pull), np.float64)
        T = _displaced(T, step)
    offs = [_difference(pose.T_robot_object, T) for pose in poses]
    chi2 = sum(
        float(off @ np.linalg.solve(spread, off)) for off, spread in zip(offs, own, strict=True)
    )
    freedoms = 6 * (len(poses) - 1)
    limit = 2 * float(gammaincinv(freedoms / 2, 1 - FUSION.chance)) if freedoms else math.inf
    whole = np.linalg.inv(information) + poses[0].shared
    placed = ObjectPose(T, (whole + whole.T) / 2, poses[0].shared)
    return FusedPose(placed, chi2, freedoms, chi2 > limit)


def _difference(T_to: Array, T_from: Array) -> Array:
    """Return (6,) what displaces and turns one pose into another, base axes."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_matrix(T_to[:3, :3] @ T_from[:3, :3].T).as_rotvec()
    return np.concatenate([T_to[:3, 3] - T_from[:3, 3], turn])


def _displaced(T: Array, step: Array) -> Array:
    """Return a pose displaced and turned by (6,), base axes."""
    from scipy.spatial.transform import Rotation

    moved = T.copy()
    moved[:3, 3] += step[:3]
    moved[:3, :3] = Rotation.from_rotvec(step[3:]).as_matrix() @ T[:3, :3]
    return moved
