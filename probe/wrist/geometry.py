"""The wrist's plates, corners, end stops and frames. Thesis 4.1.

Wrist frame: origin O, the centre of ABCD in the upper plate, x along AD, z from the upper
plate towards the object; B to A makes the angle gamma with x. Seen along z, from the robot, A is
bottom left and D bottom right. The gripper's x is parallel to BA. Lower plate:
`T_gripper_plate = Rz(-gamma) Ry(theta_y) Rx(theta_x)`, and its centre O' at D_z. The sensor
frame has the plate's x, and z the other way. mm, rad, N.

Where the thesis is wrong as printed: the element (2, 1) of the matrix must be
-C2 sin(gamma), or the matrix is no rotation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from probe.errors import PoseError
from probe.wrist.settings import WRIST_READING

FREEDOMS: Final = ("z", "theta_x", "theta_y")


@dataclass(frozen=True, slots=True)
class Wrist:
    """Geometry, transducers and springs of the wrist."""

    ab_mm: float = 60.0
    ad_mm: float = 60.0
    gamma_rad: float = math.pi / 2  #: between AD and BA
    travel_mm: tuple[float, float] = (0.0, 10.0)  #: end stops of D_z
    tilt_rad: float = math.radians(10.0)  #: end stops of both turns, both ways
    spring_n_mm: float = 5 / 6  #: of each corner
    axial_n_mm: float = 14 / 3  #: of the spring in the middle: 80 N in all at full travel
    reading_mm: float = 0.01  #: standard deviation of a distance
    mm_per_count: float = 25.0 / 1023  #: transducers of 25 mm, 10 bits
    zero_mm: float = -7.5  #: distance at 0 counts
    tips_mm: float = 12.0  #: from O' to the plane of the overlay's tips

    def __post_init__(self) -> None:
        if not (self.ab_mm > 0 and self.ad_mm > 0 and math.isfinite(self.ab_mm * self.ad_mm)):
            raise PoseError(
                f"the transducers stand {self.ab_mm:g} and {self.ad_mm:g} mm apart",
                fix="give distances above 0 mm",
            )
        if not abs(math.sin(self.gamma_rad)) >= WRIST_READING.least_sin_gamma:
            error = math.degrees(tilt_error_rad(0.01, self.ab_mm, self.gamma_rad))
            raise PoseError(
                f"gamma is {math.degrees(self.gamma_rad):g} degrees: the transducers stand almost "
                f"in a line, and 0.01 mm would be {error:.3g} degrees of tilt",
                fix="place them at the corners of a rectangle; sin(gamma) must be 0.02 or more",
            )

    def corners_mm(self) -> NDArray[np.float64]:
        """Return A, B, C, D, (4, 2), wrist frame."""
        side = self.ab_mm / 2 * np.array([math.cos(self.gamma_rad), math.sin(self.gamma_rad)])
        across = np.array([self.ad_mm / 2, 0.0])
        return np.array([side - across, -side - across, across - side, across + side])

    def ranges(self) -> tuple[tuple[float, float], ...]:
        """Return the end stops of z (mm), theta_x and theta_y (rad)."""
        tilt = (-self.tilt_rad, self.tilt_rad)
        return (self.travel_mm, tilt, tilt)


@dataclass(frozen=True, slots=True)
class WristPose:
    """Where the lower plate hangs."""

    z_mm: float  #: D_z
    theta_x_rad: float
    theta_y_rad: float
    covariance: NDArray[np.float64]  #: (3, 3) of (z, theta_x, theta_y), mm and rad
    twist_mm: float = (
        0.0  #: (AA' - BB' + CC' - DD') / 4, 0 but for errors: four readings, three freedoms
    )
    stops: tuple[str, ...] = ()  #: which end stops are reached: "z", "theta_x", "theta_y"


def tilt_error_rad(error_mm: float, ab_mm: float, gamma_rad: float) -> float:
    """Return what an error of all distances makes of theta_x by the thesis's equation.

    Standard deviations; for 0.01 mm and 60 mm it is 0.0095 degrees at gamma = 90 degrees, 0.55
    at 1 and 44 at 0.01 degrees.
    """
    return math.atan2(error_mm, ab_mm * abs(math.sin(gamma_rad)))


def gripper_to_plate(wrist: Wrist, pose: WristPose) -> NDArray[np.float64]:
    """Return T_gripper_plate (4, 4), mm."""
    c1, s1 = math.cos(pose.theta_x_rad), math.sin(pose.theta_x_rad)
    c2, s2 = math.cos(pose.theta_y_rad), math.sin(pose.theta_y_rad)
    c, s = math.cos(wrist.gamma_rad), math.sin(wrist.gamma_rad)
    return np.array(
        [
            [c2 * c, s1 * s2 * c + c1 * s, c1 * s2 * c - s1 * s, 0.0],
            [-c2 * s, -s1 * s2 * s + c1 * c, -c1 * s2 * s - s1 * c, 0.0],
            [-s2, s1 * c2, c1 * c2, pose.z_mm],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def plate_to_sensor(wrist: Wrist) -> NDArray[np.float64]:
    """Return T_plate_sensor (4, 4), mm: x is the same, the sensor's z points to the robot.

    So theta_x is the sensor's tilt about its x, and theta_y the opposite of that about its y.
    """
    transform = np.diag([1.0, -1.0, -1.0, 1.0])
    transform[2, 3] = wrist.tips_mm
    return transform
