"""Four distances between the plates -> pose of the lower plate, with its covariance. Thesis 4.1.

Transducers stand on the upper plate, so distances are along z, and the lower plate is the
plane z = D_z + g_x x + g_y y with

    g_x           = -(AA' + BB' - CC' - DD') / (2 AD)              = -tan(theta_y)
    g_y sin gamma =  (AA' - BB' - CC' + DD') / (2 AB) - g_x cos gamma,
    g_y           =  tan(theta_x) / cos(theta_y).

Four readings, three freedoms: this is least squares, and what is left over is a check.
The thesis prints tan(theta_x) = g_y and leaves out the term with cos(gamma): that holds for
small tilts and gamma = 90 degrees only. At 10 degrees both ways the factor cos(theta_y) alone
is 0.15 degrees.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import PoseError
from probe.wrist.geometry import FREEDOMS, Wrist, WristPose
from probe.wrist.settings import WRIST_READING

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
    """Tell from four distances where the lower plate hangs.

    Parameters
    ----------
    wrist
        The wrist.
    distances
        (4,) AA', BB', CC', DD', mm.

    Raises
    ------
    PoseError
        A distance is no number, the four contradict each other, or the plate would hang beyond
        an end stop, each by more than six standard deviations: a transducer fails.
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
    if abs(twist) > WRIST_READING.many * wrist.reading_mm / 2:
        raise PoseError(
            f"the four distances {np.round(d, 3).tolist()} mm lie {abs(twist):.3g} mm off a plane",
            fix="check the transducers: two opposite ones must have the sum of the other two",
        )
    stops = []
    for name, value, (low, high), error in zip(
        FREEDOMS, (z, theta_x, theta_y), wrist.ranges(), sd, strict=True
    ):
        if not low - WRIST_READING.many * error <= value <= high + WRIST_READING.many * error:
            raise PoseError(
                f"{name} is {value:.4g}, the end stops are at {low:.4g} and {high:.4g}",
                fix="check the transducers and their zero",
            )
        if not low + error < value < high - error:
            stops.append(name)
    return WristPose(z, theta_x, theta_y, covariance, twist, tuple(stops))


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
