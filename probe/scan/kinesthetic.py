"""What the arm believes of its pose, and what is true: backlash and noise. Thesis 4.3.

Commanded poses of the sensor -> joint angles -> believed and true poses, with the covariance
that belongs to the errors. The encoders sit before the gears: what the arm believes is what
was commanded. A joint follows its motor only when the play is used up, so its error depends
on the way it came; on top there is noise, drawn for each touch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.arm import AXES, Arm, forward, inverse, sensor_pose
from probe.errors import PoseError
from probe.wrist import Wrist, WristPose, gripper_to_plate, plate_to_sensor


@dataclass(frozen=True, slots=True)
class JointErrors:
    """How joints fail to stand where they should."""

    noise_rad: tuple[float, ...] = (3e-4,) * AXES  #: standard deviation
    backlash_rad: tuple[float, ...] = (1e-3,) * AXES  #: whole width of the play

    def covariance(self) -> NDArray[np.float64]:
        """Return (5, 5), rad^2, the way the joint came taken as unknown."""
        noise, play = np.array(self.noise_rad), np.array(self.backlash_rad)
        return np.diag(noise**2 + play**2 / 12)


@dataclass(frozen=True, slots=True)
class ArmPath:
    """Poses of a scan, one after the other."""

    believed: NDArray[np.float64]  #: (n, 4, 4) T_base_sensor, mm
    true: NDArray[np.float64]  #: (n, 4, 4) T_base_sensor, mm
    covariance: NDArray[np.float64]  #: (n, 6, 6) of true about believed, as in `probe.arm`


def follow_poses(
    arm: Arm, commanded: Sequence[ArrayLike], errors: JointErrors, rng: np.random.Generator
) -> ArmPath:
    """Follow commanded poses (n, 4, 4) T_base_sensor, mm, with an arm that is not perfect.

    They are in the order of the scan; lifts between touches may be among them, they decide on which
    side of its play a joint arrives. `rng` draws the noise, and where in their play the joints
    start. The probe hangs level and half way.

    Raises `PoseError` for a pose that the arm cannot reach.
    """
    wrist = Wrist()
    hanging = WristPose(sum(wrist.travel_mm) / 2, 0.0, 0.0, np.zeros((3, 3)))
    T_gripper_sensor = gripper_to_plate(wrist, hanging) @ plate_to_sensor(wrist)
    back = np.linalg.inv(T_gripper_sensor)
    angles = joint_path(arm, [np.asarray(T, np.float64) @ back for T in commanded])
    actual = (
        joints_with_play(angles, errors, rng) + rng.normal(0, 1, angles.shape) * errors.noise_rad
    )
    spread = errors.covariance()
    believed = [sensor_pose(arm, q, spread, wrist, hanging) for q in angles]
    true = [forward(arm, q) @ T_gripper_sensor for q in actual]
    return ArmPath(
        np.array([pose.T_base_sensor for pose in believed]).reshape(-1, 4, 4),
        np.array(true).reshape(-1, 4, 4),
        np.array([pose.covariance for pose in believed]).reshape(-1, 6, 6),
    )


def joint_path(arm: Arm, poses: Sequence[ArrayLike]) -> NDArray[np.float64]:
    """Return joint angles (n, 5) for poses T_base_gripper, each branch next to the last one.

    Raises `PoseError` for a pose that the arm cannot reach; the message names its number.
    """
    path: list[NDArray[np.float64]] = []
    for number, pose in enumerate(poses):
        try:
            branches = inverse(arm, pose)
        except PoseError as error:
            raise PoseError(
                f"pose {number} of {len(poses)}: {error.cause}", fix=error.fix, place=error.place
            ) from error
        last = path[-1] if path else branches[0]
        path.append(min(branches, key=lambda q: float(np.abs(q - last).max())))
    return np.array(path).reshape(-1, AXES)


def joints_with_play(
    angles: NDArray[np.float64], errors: JointErrors, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return where joints with play stand, (n, 5), when their motors go through `angles`.

    A joint stays where it is while its motor moves within the play, and is dragged along at
    either end of it.
    """
    half = np.array(errors.backlash_rad) / 2
    stands = np.empty_like(angles)
    now = angles[:1] + rng.uniform(-1, 1, (1, AXES)) * half
    for i, motor in enumerate(angles):
        now = np.clip(now, motor - half, motor + half)
        stands[i] = now
    return stands
