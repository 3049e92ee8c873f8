"""The five-axis manipulator that carries the probe. Thesis 4.1, figure 4.2.

Link table: Denavit and Hartenberg's parameters (theta_i = q_i, d_i, a_i, alpha_i); joint i turns
about z_{i-1}. The gripper's z is its approach direction. All-zero angles: the arm stretched out
horizontally along the base's x, the gripper pointing down. mm, rad. Poses are 4x4,
`T_base_gripper` and `T_base_sensor`; base frame: z up, along the first joint's axis.

Inverse (closed form, every branch): five joints reach the poses whose approach direction lies in
the vertical plane through the arm. Up to four branches: base forwards or backwards, elbow up or
down; the elbow branches meet where the arm is stretched. Holds for the thesis's link twists.

Jacobian: rows are the velocity of a point (mm/s) and the angular velocity (rad/s), both in base
axes; columns are the joints. Singular where the arm is stretched or folded (elbow), and where the
gripper stands over the base's axis (shoulder).

Pose of the sensor: T_base_sensor = T_base_gripper(q) T_gripper_plate(wrist) T_plate_sensor. The
wrist's three freedoms follow the arm's five like further joints. The covariance is (6, 6) of
(x, y, z, rx, ry, rz): displacement of the sensor's origin (mm) and small turn about it (rad), both
in base axes: T_true = [exp(r) R | p + (x, y, z)].

Where the thesis is wrong as printed: element (2, 1) of the arm matrix must end in -C1 S5, not
-C1 C5; element (1, 4) must be C1 (a2 C2 + a3 C23 + a4 C234 - d5 S234), its plus signs are lost
and C2 reads C5; and the lengths are millimetres, not centimetres.

References: Y. Nakamura, H. Hanafusa, "Inverse kinematic solutions with singularity robustness",
1986; A. A. Maciejewski, C. A. Klein, "Numerical filtering for the operation of robotic manipulators
through kinematically singular configurations", 1988: damping by singular direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import PoseError
from probe.wrist import Wrist, WristPose, gripper_to_plate, plate_to_sensor

AXES = 5
ROUNDING: Final = 1e-9  #: share of the arm's length by which rounding may displace a pose
LENGTH_MM: Final = 228.6  #: at which a mm/s of the point counts as much as rad/s of turning
LEAST_SINGULAR: Final = 0.02
"""Singular value of the Jacobian, in links and radians, that is damped below."""
GAIN: Final = 2 / 3**0.5  #: joint speed by damping, at most, times the least singular value
_TWISTS: Final = (-math.pi / 2, 0.0, 0.0, -math.pi / 2, 0.0)


@dataclass(frozen=True, slots=True)
class Arm:
    """Link table and joint ranges."""

    d_mm: tuple[float, ...] = (260.4, 0.0, 0.0, 0.0, 75.0)  #: joint distances
    a_mm: tuple[float, ...] = (0.0, 228.6, 228.6, 9.5, 0.0)  #: link lengths
    alpha_rad: tuple[float, ...] = (-math.pi / 2, 0.0, 0.0, -math.pi / 2, 0.0)  #: link twists
    low_rad: tuple[float, ...] = (-math.pi,) * AXES  #: joint ranges; the thesis gives none
    high_rad: tuple[float, ...] = (math.pi,) * AXES

    def inside(self, q: ArrayLike) -> bool:
        """Tell whether all joints are in their ranges, but for rounding."""
        angles = np.asarray(q, np.float64)
        above = angles >= np.asarray(self.low_rad) - 1e-9
        return bool((above & (angles <= np.asarray(self.high_rad) + 1e-9)).all())


def joint_frames(arm: Arm, q: ArrayLike) -> NDArray[np.float64]:
    """Return T_base_link (6, 4, 4) of base and links at joint angles q (5,), rad."""
    angles = np.asarray(q, np.float64)
    if angles.shape != (AXES,) or not np.isfinite(angles).all():
        raise PoseError(f"joint angles {angles.tolist()}", fix=f"give {AXES} angles in rad")
    frames = np.empty((AXES + 1, 4, 4))
    frames[0] = np.eye(4)
    for i in range(AXES):
        frames[i + 1] = frames[i] @ _link(angles[i], arm.d_mm[i], arm.a_mm[i], arm.alpha_rad[i])
    return frames


def forward(arm: Arm, q: ArrayLike) -> NDArray[np.float64]:
    """Return T_base_gripper (4, 4) at joint angles q (5,).

    Examples
    --------
    >>> forward(Arm(), [0, 0, 0, 0, 0])[:3, 3].round(1).tolist()
    [466.7, 0.0, 185.4]
    """
    pose: NDArray[np.float64] = joint_frames(arm, q)[AXES]
    return pose


def _link(theta: float, d: float, a: float, alpha: float) -> NDArray[np.float64]:
    c, s = math.cos(theta), math.sin(theta)
    ca, sa = _exact(math.cos(alpha)), _exact(math.sin(alpha))
    return np.array(
        [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _exact(value: float) -> float:
    """Return 0 for the cosine of a right angle, which floating point makes 6e-17."""
    return 0.0 if abs(value) < 1e-15 else value


def inverse(arm: Arm, pose: ArrayLike) -> list[NDArray[np.float64]]:
    """Return all joint angles (5,), in their ranges, that bring the gripper to T_base_gripper, mm.

    One to four solutions in (-pi, pi]: base forwards before backwards, q3 > 0 before q3 < 0.
    Over the base axis with a vertical approach the first angle is free, and 0 is taken.

    Raises `PoseError` if the pose is no rigid transform, out of reach, off the plane of the arm, or
    only reached beyond the range of a joint.
    """
    given = np.asarray(pose, np.float64)
    _check(arm, given)
    length = sum(arm.a_mm) + sum(map(abs, arm.d_mm))
    plane = _plane_angle(given, length)
    found: list[NDArray[np.float64]] = []
    lack = math.inf
    for q1 in (plane, plane + math.pi):
        here, solutions = _elbow_branches(arm, given, q1, length)
        lack = min(lack, here)
        found += solutions
    if not found:
        raise PoseError(
            f"the wrist's centre would be {lack:.4g} mm out of reach of the two long links, "
            f"{arm.a_mm[1]:g} and {arm.a_mm[2]:g} mm",
            fix="bring the object nearer to the arm, or further from its shoulder",
        )
    inside = [q for q in found if arm.inside(q)]
    if not inside:
        raise PoseError(
            "the pose is reached beyond the range of a joint only, at "
            f"{np.degrees(found[0]).round(1).tolist()} degrees",
            fix="turn the object, or place it elsewhere",
        )
    return inside


def _plane_angle(pose: NDArray[np.float64], length: float) -> float:
    """Return the angle q1 of the vertical plane that holds approach direction and gripper.

    It is the main axis of the horizontal parts of both: one of them may vanish.
    """
    parts = np.array([pose[:2, 3] / length, pose[:2, 2]])
    xx, yy, xy = parts[:, 0] @ parts[:, 0], parts[:, 1] @ parts[:, 1], parts[:, 0] @ parts[:, 1]
    if xx + yy < ROUNDING**2:
        return 0.0
    angle = math.atan2(2 * xy, xx - yy) / 2
    if parts[np.argmax(np.hypot(*parts.T))] @ (math.cos(angle), math.sin(angle)) < 0:
        angle += math.pi
    off = float(np.abs(parts @ (-math.sin(angle), math.cos(angle))).max())
    if off > ROUNDING:
        raise PoseError(
            f"the approach direction is {math.degrees(math.asin(min(1.0, off))):.3g} degrees off "
            "the vertical plane through the arm; five axes cannot reach that",
            fix="approach vertically, or in the plane of the base's axis and the point",
        )
    return angle


def _elbow_branches(
    arm: Arm, pose: NDArray[np.float64], q1: float, length: float
) -> tuple[float, list[NDArray[np.float64]]]:
    """Return by how much the links are too short or too long (mm), and the solutions."""
    c1, s1 = math.cos(q1), math.sin(q1)
    d1, d5 = arm.d_mm[0], arm.d_mm[4]
    _, a2, a3, a4, _ = arm.a_mm
    s234, c234 = -(c1 * pose[0, 2] + s1 * pose[1, 2]), -pose[2, 2]
    q5 = math.atan2(s1 * pose[0, 0] - c1 * pose[1, 0], s1 * pose[0, 1] - c1 * pose[1, 1])
    out = c1 * pose[0, 3] + s1 * pose[1, 3] - a4 * c234 + d5 * s234  # of the wrist's centre
    down = d1 - a4 * s234 - d5 * c234 - pose[2, 3]
    reach = math.hypot(out, down)
    lack = max(reach - (a2 + a3), abs(a2 - a3) - reach)
    if lack > ROUNDING * length:
        return lack, []
    stretch = math.sqrt(max(0.0, (a2 + a3 - reach) * (a2 + a3 + reach)))
    fold = math.sqrt(max(0.0, (reach - abs(a2 - a3)) * (reach + abs(a2 - a3))))
    bend = 2 * math.atan2(stretch, fold)
    solutions = []
    for q3 in (bend, -bend) if bend else (0.0,):
        q2 = math.atan2(down, out) - math.atan2(a3 * math.sin(q3), a2 + a3 * math.cos(q3))
        q4 = math.atan2(s234, c234) - q2 - q3
        solutions.append(np.array([_wrap_angle(q) for q in (q1, q2, q3, q4, q5)]))
    return 0.0, solutions


def _wrap_angle(angle: float) -> float:
    """Return the angle in (-pi, pi]."""
    turned = math.remainder(angle, math.tau)
    return math.pi if turned <= -math.pi else turned


def _check(arm: Arm, pose: NDArray[np.float64]) -> None:
    if not np.allclose(arm.alpha_rad, _TWISTS, rtol=0, atol=1e-12) or any(arm.d_mm[1:4]):
        raise PoseError(
            f"link twists {np.degrees(arm.alpha_rad).tolist()} degrees, joint distances "
            f"{list(arm.d_mm)} mm",
            fix="the closed form holds for twists -90, 0, 0, -90, 0 and d2 = d3 = d4 = 0",
        )
    turn = pose[:3, :3] if pose.shape == (4, 4) else np.zeros((3, 3))
    if not np.isfinite(pose).all() or not np.allclose(turn @ turn.T, np.eye(3), atol=1e-6):
        raise PoseError("the pose is no rigid transform", fix="give T_base_gripper (4, 4), mm")


def jacobian(arm: Arm, q: ArrayLike, point_mm: ArrayLike | None = None) -> NDArray[np.float64]:
    """Return the geometric Jacobian (6, 5): rows v (mm/s per rad/s) and omega, base axes.

    The point that moves (3,) is in the base frame; the gripper's origin if not given.
    """
    frames = joint_frames(arm, q)
    point = frames[AXES, :3, 3] if point_mm is None else np.asarray(point_mm, np.float64)
    axes = frames[:AXES, :3, 2]
    arms = point - frames[:AXES, :3, 3]
    return np.concatenate([np.cross(axes, arms).T, axes.T])


def joint_speeds(arm: Arm, q: ArrayLike, twist: ArrayLike) -> NDArray[np.float64]:
    """Return joint speeds (5,), rad/s, that follow a twist as well as bounded speeds can.

    The twist (6,) is the velocity of the gripper's origin (mm/s) and the angular velocity (rad/s),
    base axes. Least squares by singular directions. One that is weaker than `LEAST_SINGULAR` is
    damped, the more the weaker it is, so that nothing jumps on the way into a singularity, the
    other directions are followed exactly, and no unit of speed (a link's length per second) asks
    for more than GAIN over that value, 58 rad/s.

    Raises `PoseError` for a value that is no number.
    """
    wanted = np.asarray(twist, np.float64)
    if wanted.shape != (6,) or not np.isfinite(wanted).all():
        raise PoseError(f"a twist {wanted.tolist()}", fix="give 3 speeds in mm/s and 3 in rad/s")
    scales = np.repeat([LENGTH_MM, 1.0], 3)
    u, values, v = np.linalg.svd(jacobian(arm, q) / scales[:, None], full_matrices=False)
    weak = np.clip(values / LEAST_SINGULAR, 0.0, 1.0)
    damping = (1 - weak**2) * (LEAST_SINGULAR / 2) ** 2
    safe = np.where(values > 0, values, 1.0)
    gains = np.where(values > 0, values / (safe**2 + damping), 0.0)
    speeds: NDArray[np.float64] = v.T @ (gains * (u.T @ (wanted / scales)))
    return speeds


@dataclass(frozen=True, slots=True)
class SensorPose:
    """Where the sensor is, as far as joints and wrist tell."""

    T_base_sensor: NDArray[np.float64]  #: (4, 4), mm
    covariance: NDArray[np.float64]  #: (6, 6) of (x, y, z, rx, ry, rz), base axes, mm and rad


def sensor_pose(
    arm: Arm, q: ArrayLike, joint_covariance: ArrayLike, wrist: Wrist, hanging: WristPose
) -> SensorPose:
    """Return the pose of the sensor with its covariance.

    `joint_covariance` is (5, 5) of the joints' errors, rad^2; or (5,) standard deviations, rad.

    Raises `PoseError` for joint angles or a covariance that are none.
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
