"""Pose of the gripper -> joint angles, every branch. Thesis 4.1; closed form.

Five joints reach the poses whose approach direction lies in the vertical plane through the
arm; a pose off it is refused, with how far it is off. Up to four branches: base forwards or
backwards, elbow up or down. The two elbow branches meet where the arm is stretched.
Holds for the link twists of the thesis (alpha = -90, 0, 0, -90, 0 degrees).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.arm.links import Arm
from probe.arm.settings import ARM_MOTION
from probe.errors import PoseError

_TWISTS: Final = (-math.pi / 2, 0.0, 0.0, -math.pi / 2, 0.0)


def inverse(arm: Arm, pose: ArrayLike) -> list[NDArray[np.float64]]:
    """Return all joint angles (5,), in their ranges, that bring the gripper to a pose.

    Parameters
    ----------
    arm
        The arm.
    pose
        (4, 4) T_base_gripper, mm.

    Returns
    -------
    One to four solutions in (-pi, pi]: base forwards before backwards, q3 > 0 before q3 < 0.
    Over the base axis with a vertical approach the first angle is free, and 0 is taken.

    Raises
    ------
    PoseError
        The pose is no rigid transform, out of reach, off the plane of the arm, or only
        reached beyond the range of a joint.
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

    Found from both at once, as the main axis of their horizontal parts: one of them may vanish.
    """
    parts = np.array([pose[:2, 3] / length, pose[:2, 2]])
    xx, yy, xy = parts[:, 0] @ parts[:, 0], parts[:, 1] @ parts[:, 1], parts[:, 0] @ parts[:, 1]
    if xx + yy < ARM_MOTION.rounding**2:
        return 0.0
    angle = math.atan2(2 * xy, xx - yy) / 2
    if parts[np.argmax(np.hypot(*parts.T))] @ (math.cos(angle), math.sin(angle)) < 0:
        angle += math.pi
    off = float(np.abs(parts @ (-math.sin(angle), math.cos(angle))).max())
    if off > ARM_MOTION.rounding:
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
    if lack > ARM_MOTION.rounding * length:
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
