"""Answer of a touch, and where arm and wrist hold the sensor -> the object in the robot's base.

    T_robot_object = T_robot_probe T_object_probe^-1                         Thesis 4.1, 6.3

The recognizer gives three of the six freedoms, x, y and the turn on the face; contact gives the
others: the tips are pressed into the symbols and the sensor lies flat, within `Seating`.
Covariances are (6, 6) of (x, y, z, rx, ry, rz), displacement of the origin (mm) and small turn
about it (rad), in base axes: T_true = [exp(r) R | p + (x, y, z)].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.arm import Arm, SensorPose, sensor_pose
from probe.wrist import Wrist, distances_mm, wrist_pose
from recognizer.touch.recognition import Recognition

Array = NDArray[np.float64]

MOVED_CHANCE = 1e-3  #: of touches of an object that lay still being taken for moved
FUSION_STEPS = 3  #: of Gauss and Newton's method; the first is enough for turns below a degree


@dataclass(frozen=True, slots=True)
class Seating:
    """How the sensor lies on the face: standard deviations, and how deep it is pressed.

    Of the own contact model, 253 touches anywhere on a face that were answered, 20 ... 120 N, half
    of them with the arm .9 degrees (rms) off the normal. A sensor whose rim hangs over the border
    tips: depth and tilt grow from where the rim reaches the border to where the centre does.
    """

    pressed_mm: float = 0.55  #: of the tips' plane below the symbols' tops, wholly on the face
    pressed_border_mm: float = 0.5  #: more with the centre on the border
    z_mm: float = 0.3  #: about that; the overlay's, and so the same at every touch
    tilt_rad: float = 0.005  #: of the sensor against the face, both ways, wholly on the face
    tilt_border_rad: float = 0.064  #: with the centre on the border, in the direction it tips
    half_mm: float = 12.7  #: half the width of the sensor

    def beyond(self, inside_mm: float | None) -> float:
        """Return how far the sensor hangs over the border, 0 ... 1; 1 where it is not known."""
        inside = 0.0 if inside_mm is None else inside_mm
        return min(max(1.0 - inside / self.half_mm, 0.0), 1.0)

    def depth_mm(self, inside_mm: float | None) -> float:
        """Return how deep the sensor is pressed."""
        return self.pressed_mm + self.pressed_border_mm * self.beyond(inside_mm)

    def spread_rad(self, inside_mm: float | None) -> float:
        """Return the standard deviation of its tilt, each way."""
        return self.tilt_rad + (self.tilt_border_rad - self.tilt_rad) * self.beyond(inside_mm)


@dataclass(frozen=True, slots=True, eq=False)
class ObjectPose:
    """Where the object is in the robot's base frame."""

    T_robot_object: Array  #: (4, 4), mm
    covariance: Array  #: (6, 6) of (x, y, z, rx, ry, rz), base axes, mm and rad
    shared: Array = field(default_factory=lambda: np.zeros((6, 6)))
    """(6, 6) of it, what is the same at every touch of a face: how deep the sensor sinks in."""

    def __str__(self) -> str:
        at = ", ".join(f"{value:.1f}" for value in self.T_robot_object[:3, 3])
        spread = math.sqrt(max(float(self.covariance[:3, :3].trace()), 0.0))
        return f"object in the robot's base at ({at}) mm +- {spread:.1f}"


def carried_pose(
    arm: Arm, wrist: Wrist, joints_rad: ArrayLike, joint_covariance: ArrayLike, counts: ArrayLike
) -> SensorPose:
    """Return where arm and wrist hold the sensor.

    `joints_rad` (5,); `joint_covariance` (5,) standard deviations, rad, or (5, 5), rad^2; `counts`
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

    `sensor` is where the sensor was during the touch.

    With a = p_object - p_sensor and R from the face to the base, errors d and r of the sensor and e
    and s of the touch (face axes) move the object by d - R e + (r - R s) x a and turn it by r - R
    s.
    """
    T_face_probe, T_object_probe = recognition.T_face_probe, recognition.T_object_probe
    if T_face_probe is None or T_object_probe is None or recognition.covariance is None:
        return None
    seating = seating or Seating()
    pressed = np.eye(4)
    pressed[2, 3] = seating.depth_mm(recognition.inside_mm)
    T_robot_object = sensor.T_base_sensor @ pressed @ _inverse(T_object_probe)
    R_base_face = sensor.T_base_sensor[:3, :3] @ T_face_probe[:3, :3].T
    both = np.kron(np.eye(2), R_base_face)
    touch, sinks = np.zeros((6, 6)), np.zeros((6, 6))
    known = np.ix_([0, 1, 5], [0, 1, 5])
    touch[known] = recognition.covariance
    tilt = seating.spread_rad(recognition.inside_mm)
    touch[2, 2] = (tilt * seating.half_mm / 2) ** 2  # what tips sinks as well
    touch[3, 3] = touch[4, 4] = tilt**2
    sinks[2, 2] = seating.z_mm**2
    lever = np.eye(6)
    x, y, z = T_robot_object[:3, 3] - sensor.T_base_sensor[:3, 3]
    lever[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    shared = lever @ both @ sinks @ both.T @ lever.T
    covariance = lever @ (sensor.covariance + both @ touch @ both.T) @ lever.T + shared
    return ObjectPose(T_robot_object, (covariance + covariance.T) / 2, shared)


def _inverse(T: Array) -> Array:
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse


@dataclass(frozen=True, slots=True, eq=False)
class FusedPose:
    """The object's pose by several touches, and whether they agree."""

    pose: ObjectPose
    chi2: float  #: squared disagreement over the covariances
    since: int  #: index of the first pose since the object lies where it does now
    moved: bool  #: the object was moved before `since`: fuse what came since


def fuse_poses(poses: Sequence[ObjectPose]) -> FusedPose:
    """Return one pose of an object from those by single touches of a face.

    Errors of joints, wrist and symbols are independent from touch to touch and average out; how
    deep the sensor sinks in (`ObjectPose.shared`) does not. `poses` are one or more, in one base
    frame, in the order of their time; all are fused, whether or not the object was moved in
    between.
    """
    every = np.stack([pose.T_robot_object for pose in poses])
    own = [pose.covariance - pose.shared for pose in poses]
    weights = np.asarray(np.linalg.inv(own), np.float64)
    information = weights.sum(axis=0)
    T = every[0]
    for _ in range(FUSION_STEPS):
        pull = np.einsum("nij,nj->i", weights, _differences(every, T))
        T = _displaced(T, np.asarray(np.linalg.solve(information, pull)))
    offs = _differences(every, T)
    chi2 = float(np.einsum("ni,nij,nj->", offs, weights, offs))
    whole = np.linalg.inv(information) + poses[0].shared
    placed = ObjectPose(T, (whole + whole.T) / 2, poses[0].shared)
    since, moved = _last_move(offs, weights)
    return FusedPose(placed, chi2, since, moved)


def _last_move(offs: Array, weights: Array) -> tuple[int, bool]:
    """Return where to part poses (n, 6) so that both parts differ most; and whether they do.

    Both parts are means of their own; their difference has six freedoms, and one of n - 1 places to
    part was chosen.
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
    limit = 2 * float(gammaincinv(3.0, 1 - MOVED_CHANCE / len(apart)))
    since = 1 + int(np.argmax(apart))
    return (since, True) if apart[since - 1] > limit else (0, False)


def _differences(T_to: Array, T_from: Array) -> Array:
    """Return (n, 6) displacements and turns from one pose to others (n, 4, 4), base axes."""
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
