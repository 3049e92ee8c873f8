"""The link table of the manipulator -> pose of its gripper. Thesis 4.1, figure 4.2.

Denavit and Hartenberg's parameters (theta_i = q_i, d_i, a_i, alpha_i); joint i turns about
z_{i-1}. The gripper's z is its approach direction. All-zero angles: the arm stretched out
horizontally along the base's x, the gripper pointing down.

Where the thesis is wrong as printed: element (2, 1) of the arm matrix must end in -C1 S5, not
-C1 C5; element (1, 4) must be C1 (a2 C2 + a3 C23 + a4 C234 - d5 S234), its plus signs are lost
and C2 reads C5; and the lengths are millimetres, not centimetres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import PoseError

AXES = 5


@dataclass(frozen=True, slots=True)
class Arm:
    """Link table and joint ranges."""

    d_mm: tuple[float, ...] = (260.4, 0.0, 0.0, 0.0, 75.0)  #: joint distances
    a_mm: tuple[float, ...] = (0.0, 228.6, 228.6, 9.5, 0.0)  #: link lengths
    alpha_rad: tuple[float, ...] = (-math.pi / 2, 0.0, 0.0, -math.pi / 2, 0.0)  #: link twists
    low_rad: tuple[float, ...] = (-math.pi,) * AXES  #: joint ranges; the thesis gives none
    high_rad: tuple[float, ...] = (math.pi,) * AXES

    def inside(self, q: ArrayLike, slack: float = 1e-9) -> bool:
        """Tell whether all joints are in their ranges."""
        angles = np.asarray(q, np.float64)
        above = angles >= np.asarray(self.low_rad) - slack
        return bool((above & (angles <= np.asarray(self.high_rad) + slack)).all())


def joint_frames(arm: Arm, q: ArrayLike) -> NDArray[np.float64]:
    """Return the frames of base and links, (6, 4, 4), T_base_link.

    Parameters
    ----------
    arm
        The arm.
    q
        (5,) joint angles, rad.

    Raises
    ------
    PoseError
        Not five finite angles.
    """
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
