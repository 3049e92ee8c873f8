"""The instrumented passive compliant wrist: four distances -> where the probe hangs. Thesis 4.1.

Two plates; the upper one is fixed to the gripper, the lower one carries the probe. Springs (one at
each corner, one in the middle, linear) give the lower plate three freedoms, a displacement along z
and two turns; transducers on the upper plate measure the distances AA', BB', CC', DD' along z at
the corners of a parallelogram. mm, rad, N.

Wrist frame: origin O, the centre of ABCD in the upper plate, x along AD, z from the upper plate
towards the object; B to A makes the angle gamma with x. Seen along z, from the robot, A is bottom
left and D bottom right. The gripper's x is parallel to BA. Lower plate:
`T_gripper_plate = Rz(-gamma) Ry(theta_y) Rx(theta_x)`, and its centre O' at D_z. The sensor frame
has the plate's x, and z the other way. The lower plate is the plane z = D_z + g_x x + g_y y with

    g_x           = -(AA' + BB' - CC' - DD') / (2 AD)              = -tan(theta_y)
    g_y sin gamma =  (AA' - BB' - CC' + DD') / (2 AB) - g_x cos gamma,
    g_y           =  tan(theta_x) / cos(theta_y).

Four readings, three freedoms: this is least squares, and what is left over is a check.

Where the thesis is wrong as printed: the element (2, 1) of the matrix must be -C2 sin(gamma), or
the matrix is no rotation; and tan(theta_x) = g_y without the term with cos(gamma) holds for small
tilts and gamma = 90 degrees only. At 10 degrees both ways the factor cos(theta_y) alone is 0.15
degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.contact.contract import WristStiffness
from probe.errors import PoseError

_MANY: Final = 6.0  # standard deviations that do not happen
_LEAST_SIN_GAMMA: Final = 0.02  # below, 0.01 mm of error is more than half a degree


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
        if not abs(math.sin(self.gamma_rad)) >= _LEAST_SIN_GAMMA:
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


@dataclass(frozen=True, slots=True)
class WristPose:
    """Where the lower plate hangs."""

    z_mm: float  #: D_z
    theta_x_rad: float
    theta_y_rad: float
    covariance: NDArray[np.float64]  #: (3, 3) of (z, theta_x, theta_y), mm and rad


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


#: mean, half the mean slopes along AD and BA times their lengths, and twist, of A, B, C, D
_CONTRASTS: Final = np.array([[1, 1, 1, 1], [-1, -1, 1, 1], [1, -1, -1, 1], [1, -1, 1, -1]]) / 4


def distances_mm(wrist: Wrist, counts: ArrayLike) -> NDArray[np.float64]:
    """Return AA', BB', CC', DD' (mm) of the four readings of a frame."""
    return wrist.zero_mm + wrist.mm_per_count * np.asarray(counts, np.float64)


def counts_of(wrist: Wrist, distances: ArrayLike) -> NDArray[np.uint16]:
    """Return the readings of four distances (mm), within the range of the transducers."""
    counts = np.rint((np.asarray(distances, np.float64) - wrist.zero_mm) / wrist.mm_per_count)
    return counts.clip(0, 1023).astype(np.uint16)


def wrist_pose(wrist: Wrist, distances: ArrayLike) -> WristPose:
    """Return where the lower plate hangs by four distances AA', BB', CC', DD' (mm).

    Raises `PoseError` if a distance is no number, the four contradict each other, or the plate
    would hang beyond an end stop, each by more than six standard deviations: a transducer fails.
    """
    d = np.asarray(distances, np.float64)
    if d.shape != (4,) or not np.isfinite(d).all():
        raise PoseError(
            f"the wrist's distances are {d.tolist()}", fix="give AA', BB', CC', DD' in mm"
        )
    z, g_x, g_y, twist = _CONTRASTS @ d
    g_x, g_y = _slopes(wrist, g_x, g_y)
    theta_y = math.atan(-g_x)
    theta_x = math.atan(g_y * math.cos(theta_y))
    covariance = _covariance(wrist, theta_x, theta_y)
    sd = np.sqrt(covariance.diagonal())
    if abs(twist) > _MANY * wrist.reading_mm / 2:
        raise PoseError(
            f"the four distances {np.round(d, 3).tolist()} mm lie {abs(twist):.3g} mm off a plane",
            fix="check the transducers: two opposite ones must have the sum of the other two",
        )
    tilts = (-wrist.tilt_rad, wrist.tilt_rad)
    turn = (math.degrees(1.0), "degrees")
    freedoms = (
        ("z", z, wrist.travel_mm, (1.0, "mm")),
        ("theta_x", theta_x, tilts, turn),
        ("theta_y", theta_y, tilts, turn),
    )
    for (name, value, (low, high), (scale, unit)), error in zip(freedoms, sd, strict=True):
        if not low - _MANY * error <= value <= high + _MANY * error:
            raise PoseError(
                f"{name} of the wrist is {scale * value:.4g} {unit}, the end stops are at "
                f"{scale * low:.4g} and {scale * high:.4g}",
                fix="check the transducers and their zero",
            )
    return WristPose(z, theta_x, theta_y, covariance)


def distances_at(
    wrist: Wrist, z_mm: float, theta_x_rad: float, theta_y_rad: float
) -> NDArray[np.float64]:
    """Return AA', BB', CC', DD' (mm) when the lower plate hangs there."""
    x, y = wrist.corners_mm().T
    g_y = math.tan(theta_x_rad) / math.cos(theta_y_rad)
    distances: NDArray[np.float64] = z_mm - math.tan(theta_y_rad) * x + g_y * y
    return distances


def _slopes(wrist: Wrist, along_ad: float, along_ba: float) -> tuple[float, float]:
    """Return the slopes along x and y of the contrasts along AD and BA."""
    g_x = 2 * along_ad / wrist.ad_mm
    g_ba = 2 * along_ba / wrist.ab_mm
    return g_x, (g_ba - g_x * math.cos(wrist.gamma_rad)) / math.sin(wrist.gamma_rad)


def _covariance(wrist: Wrist, theta_x: float, theta_y: float) -> NDArray[np.float64]:
    """Propagate independent errors of the four distances to (z, theta_x, theta_y)."""
    g_y = math.tan(theta_x) / math.cos(theta_y)
    slopes = np.array([_slopes(wrist, *row) for row in _CONTRASTS[1:3].T]).T  # (2, 4)
    # theta_y = -atan g_x; tan theta_x = g_y cos theta_y
    d_theta_y = -(math.cos(theta_y) ** 2) * slopes[0]
    d_tangent = math.cos(theta_y) * slopes[1] - g_y * math.sin(theta_y) * d_theta_y
    jacobian = np.stack([_CONTRASTS[0], math.cos(theta_x) ** 2 * d_tangent, d_theta_y])
    covariance: NDArray[np.float64] = wrist.reading_mm**2 * jacobian @ jacobian.T
    return covariance


def travel_under_load(wrist: Wrist, force_n: float) -> float:
    """Return D_z (mm) under a force (N) along -z; unloaded, the lower end stop holds the plate."""
    low, high = wrist.travel_mm
    z = high - force_n / (4 * wrist.spring_n_mm + wrist.axial_n_mm)
    return min(max(z, low), high)


def stiffness(wrist: Wrist) -> WristStiffness:
    """Return how the springs hold the plate, for the contact models.

    Raises `PoseError` if the springs couple the two turns, which the contact models cannot say.
    """
    springs = _tilt_springs(wrist)
    if abs(springs[0, 1]) > 0.01 * math.sqrt(springs[0, 0] * springs[1, 1]):
        raise PoseError(
            f"at gamma = {math.degrees(wrist.gamma_rad):g} degrees a turn about x makes a moment "
            "about y",
            fix="take gamma = 90 degrees, or no springs at the corners",
        )
    return WristStiffness(float(springs[0, 0]), float(springs[1, 1]))


def _tilt_springs(wrist: Wrist) -> NDArray[np.float64]:
    """Return moments about (x, y) per turn about (x, y), N mm / rad, at small tilts."""
    x, y = wrist.corners_mm().T
    k = wrist.spring_n_mm
    return np.array([[k * (y @ y), -k * (x @ y)], [-k * (x @ y), k * (x @ x)]])
