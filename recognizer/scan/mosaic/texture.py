"""Which motions of an image would be seen, and which leave it as it is. Thesis 4.3.

Shifted along a ridge, a ridge looks the same; turned about its middle, so does a dome. The
mean squared change by x, y and the turn (Harris and Stephens' tensor, with the turn in it)
tells such motions by its small eigenvalues. It is taken from an image that is smoothed over
the gaps between tabs: they change with every shift and would say that all motions are seen
(measured: a ridge's eigenvalue is up to .16 of the largest without the smoothing, .03 with it;
that of symbols at least .5 either way).

Lengths are in tactels, turns in tactels at the middle of the matrix's sides.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.scan.mosaic.patch import TouchPatch
from recognizer.scan.mosaic.settings import TEXTURE

Array = NDArray[np.float64]


def scales(sensor: SensorType) -> Array:
    """Return (3,) what one tactel is in x, y (mm) and theta (rad)."""
    return np.array([1.0, 1.0, 1 / min(sensor.half_mm)]) * sensor.pitch_mm


def seen_motions(a: TouchPatch, over: NDArray[np.bool_], pose: Array) -> Array:
    """Return the motions (3, k), orthonormal in tactels, that change an image.

    Parameters
    ----------
    a
        The image.
    over
        (rows * columns,) tactels that count.
    pose
        (3,) T_a_b: x, y and theta of what lies on the image, mm and rad.
    """
    by_x, by_y = a.slopes
    x, y = ((a.points_mm - pose[:2]) / min(a.sensor.half_mm)).T
    slopes = np.stack([by_x, by_y, by_y * x - by_x * y], axis=-1)[over]
    variance = float(a.smooth[over].var())
    if variance < TEXTURE.least_change:
        return np.zeros((3, 0))
    values, motions = np.linalg.eigh(slopes.T @ slopes / (len(slopes) * variance))
    return np.asarray(motions[:, values > TEXTURE.least], np.float64)


def restrict_information(
    information: Array, motions: Array, sensor: SensorType, believed: Array
) -> Array:
    """Return what an information says of some motions, all others being unknown.

    Parameters
    ----------
    information
        (3, 3) inverse covariance of x, y and theta, regular.
    motions
        (3, k) of `seen_motions`.
    believed
        (3, 3) covariance of what is known without the image. It decides how much an error of
        the motions' direction costs: along a ridge that is taken askew, an error of the belief
        looks like one across.
    """
    if motions.shape[1] == 3:
        return information
    if motions.shape[1] == 0:
        return np.zeros((3, 3))
    unit = np.outer(scales(sensor), scales(sensor))
    covariance, belief = np.linalg.inv(information * unit), believed / unit
    open_ = float(np.trace(belief) - np.trace(motions.T @ belief @ motions))
    askew = TEXTURE.askew_rad**2 * open_ * np.eye(motions.shape[1])
    spread = motions.T @ covariance @ motions + askew
    found = motions @ np.linalg.inv(spread) @ motions.T / unit
    return np.asarray((found + found.T) / 2)


def holding_information(motions: Array, sensor: SensorType) -> Array:
    """Return an information (3, 3) that holds a pose in all motions but these."""
    unit = np.outer(scales(sensor), scales(sensor))
    return np.asarray(TEXTURE.stiff * (np.eye(3) - motions @ motions.T) / unit)


def far_apart(a: Array, b: Array, sensor: SensorType) -> float:
    """Return how far two poses (3,) are from each other, tactels, turns among it."""
    away = (a - b) / scales(sensor)
    away[2] = ((a[2] - b[2] + math.pi) % (2 * math.pi) - math.pi) / scales(sensor)[2]
    return float(np.linalg.norm(away))
