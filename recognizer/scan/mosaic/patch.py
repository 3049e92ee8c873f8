"""The image of a touch as a function of the place, with slopes and visible motions. Thesis 4.3.

Signal -> TouchPatch. Bad tactels are filled from their neighbours and marked. A light smoothing
removes what the matrix cannot resolve (tabs leave gaps, so edges alias); a cubic spline
interpolates the rest. Values are shares of the upper level of the image, so that touches of
different force look alike. mm, sensor frame.

Motions: a ridge shifted along itself looks the same, and so does a dome turned about its middle.
The eigenvalues of the mean squared change by x, y and the turn (Harris and Stephens' tensor
extended by the turn) separate visible motions from invisible ones. The tensor comes from an image
smoothed over the gaps between tabs, which change with every shift and would make all motions
visible (measured: a ridge's eigenvalue is up to .16 of the largest without the smoothing, .03 with
it; that of symbols at least .5 either way). There, lengths are in tactels, turns in tactels at the
middle of the matrix's sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.scan.mosaic.planar import pose_difference
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]

RIM = 2  #: spline coefficients beyond the matrix, mirrored
SMOOTHING = 0.4  #: tactels; 0 to .4 register equally well, .5 and more worse
SMOOTHING_OVER_GAPS = 0.8  #: tactels; hides the gaps between tabs
LEAST_TRUST = 0.5  #: of a good tactel
LEAST_VISIBLE = 0.05  #: of the image's variance, by one tactel; ridges <= .02, symbols >= .12
DIRECTION_RAD = 0.1  #: error of the motions' directions; measured: .07
STIFFNESS = 1e6  #: 1/tactel^2, of motions that are held
LEAST_VARIANCE = 1e-9  #: of an image that shows any motion, in a patch's unit


@dataclass(frozen=True, slots=True, eq=False)
class TouchPatch:
    """One image."""

    sensor: SensorType
    scale: float  #: reading that counts as 1; 0 without any force
    raw: Array  #: (rows, columns) readings over the scale, bad ones filled
    values: Array  #: (rows, columns) `raw`, smoothed
    good: NDArray[np.bool_]  #: (rows, columns)
    coefficients: Array  #: (rows + 4, columns + 4) of the cubic spline through `values`
    points_mm: Array  #: (rows * columns, 2)
    smooth: Array  #: (rows * columns,) `raw`, smoothed over the gaps between tabs
    slopes: Array  #: (2, rows * columns) of `smooth` by x and y, 1/tactel


def patch_of(sensor: SensorType, signal: Signal) -> TouchPatch:
    """Return the patch of a signal."""
    from scipy.ndimage import gaussian_filter, spline_filter

    good = signal.trust >= LEAST_TRUST
    filled = _fill_bad_tactels(signal.forces, good)
    scale = float(np.quantile(filled, 0.95))
    if scale <= 0:
        scale = float(filled.max())
    raw = filled / scale if scale > 0 else filled
    values = gaussian_filter(raw, SMOOTHING, mode="nearest")
    coefficients = np.pad(spline_filter(values, 3, mode="mirror"), RIM, mode="reflect")
    points = sensor.centres_mm().reshape(-1, 2)
    smooth = gaussian_filter(raw, SMOOTHING_OVER_GAPS, mode="nearest")
    down, right = np.gradient(smooth)
    slopes = np.stack([right.reshape(-1), -down.reshape(-1)])
    for array in (raw, values, good, coefficients, points, smooth, slopes):
        array.setflags(write=False)
    return TouchPatch(
        sensor, scale, raw, values, good, coefficients, points, smooth.reshape(-1), slopes
    )


def interpolate_patch(patch: TouchPatch, points_mm: Array) -> tuple[Array, Array, Array]:
    """Return values and slopes by x and y (1/mm) at points (n, 2) inside `covers_points`."""
    sensor, pitch = patch.sensor, patch.sensor.pitch_mm
    column = points_mm[:, 0] / pitch + ((sensor.columns - 1) / 2 + RIM)
    row = (sensor.rows - 1) / 2 + RIM - points_mm[:, 1] / pitch
    i, j = np.floor(row).astype(np.intp), np.floor(column).astype(np.intp)
    along_y, change_y = basis(row - i)
    along_x, change_x = basis(column - j)
    width = sensor.columns + 2 * RIM
    first = (i - 1) * width + (j - 1)
    stencil = (np.arange(4)[:, None] * width + np.arange(4)).reshape(-1)
    near = patch.coefficients.reshape(-1)[first[:, None] + stencil].reshape(-1, 4, 4)
    by_x = (near @ np.stack([along_x, change_x], axis=-1)).swapaxes(1, 2)  # (n, 2, 4)
    value = (by_x[:, 0] * along_y).sum(axis=1)
    slope_x = (by_x[:, 1] * along_y).sum(axis=1) / pitch
    slope_y = -(by_x[:, 0] * change_y).sum(axis=1) / pitch
    return value, slope_x, slope_y


def covers_points(sensor: SensorType, points_mm: Array, beyond: float = 0.0) -> NDArray[np.bool_]:
    """Whether points lie between tactels' centres, or up to `beyond` tactels outside."""
    half = (np.array([sensor.columns, sensor.rows]) - 1) / 2 + beyond
    return np.asarray((np.abs(points_mm) <= half * sensor.pitch_mm + 1e-9).all(axis=-1))


def nearest_tactel(sensor: SensorType, points_mm: Array) -> NDArray[np.intp]:
    """Return the number of the tactel whose centre is nearest to each point inside the matrix."""
    column = np.rint(points_mm[..., 0] / sensor.pitch_mm + (sensor.columns - 1) / 2)
    row = np.rint((sensor.rows - 1) / 2 - points_mm[..., 1] / sensor.pitch_mm)
    column = np.clip(column, 0, sensor.columns - 1).astype(np.intp)
    row = np.clip(row, 0, sensor.rows - 1).astype(np.intp)
    return np.asarray(row * sensor.columns + column)


def basis(t: Array) -> tuple[Array, Array]:
    """Return the four cubic B-splines (n, 4) at t = 0 ... 1, and their slopes."""
    u = 1.0 - t
    values = np.stack(
        [u**3 / 6, 2 / 3 - t * t + t**3 / 2, 2 / 3 - u * u + u**3 / 2, t**3 / 6], axis=-1
    )
    slopes = np.stack([-u * u / 2, -2 * t + 1.5 * t * t, 2 * u - 1.5 * u * u, t * t / 2], axis=-1)
    return values, slopes


def scales(sensor: SensorType) -> Array:
    """Return (3,) one tactel as x, y (mm) and theta (rad)."""
    return np.array([1.0, 1.0, 1 / min(sensor.half_mm)]) * sensor.pitch_mm


def seen_motions(a: TouchPatch, over: NDArray[np.bool_], pose: Array) -> Array:
    """Return the motions (3, k), orthonormal in tactels, that change an image.

    `over` (rows * columns,) are the tactels that count, `pose` (3,) T_a_b.
    """
    by_x, by_y = a.slopes
    x, y = ((a.points_mm - pose[:2]) / min(a.sensor.half_mm)).T
    slopes = np.stack([by_x, by_y, by_y * x - by_x * y], axis=-1)[over]
    variance = float(a.smooth[over].var())
    if variance < LEAST_VARIANCE:
        return np.zeros((3, 0))
    values, motions = np.linalg.eigh(slopes.T @ slopes / (len(slopes) * variance))
    return np.asarray(motions[:, values > LEAST_VISIBLE], np.float64)


def restrict_information(
    information: Array, motions: Array, sensor: SensorType, believed: Array
) -> Array:
    """Return the part of an information that concerns some motions, all others being unknown.

    `information` (3, 3) inverse covariance of x, y and theta, regular; `motions` (3, k) of
    `seen_motions`; `believed` (3, 3) covariance without the image, which decides how much an error
    of the motions' direction costs: with a wrong direction of a ridge, an error along it looks like
    an error across it.
    """
    if motions.shape[1] == 3:
        return information
    if motions.shape[1] == 0:
        return np.zeros((3, 3))
    unit = np.outer(scales(sensor), scales(sensor))
    covariance, belief = np.linalg.inv(information * unit), believed / unit
    open_ = float(np.trace(belief) - np.trace(motions.T @ belief @ motions))
    askew = DIRECTION_RAD**2 * open_ * np.eye(motions.shape[1])
    spread = motions.T @ covariance @ motions + askew
    found = motions @ np.linalg.inv(spread) @ motions.T / unit
    return np.asarray((found + found.T) / 2)


def holding_information(motions: Array, sensor: SensorType) -> Array:
    """Return an information (3, 3) that holds a pose in all motions but these."""
    unit = np.outer(scales(sensor), scales(sensor))
    return np.asarray(STIFFNESS * (np.eye(3) - motions @ motions.T) / unit)


def far_apart(a: Array, b: Array, sensor: SensorType) -> float:
    """Return the distance of two poses (3,), tactels, turns included."""
    return float(np.linalg.norm(pose_difference(a, b) / scales(sensor)))


def _fill_bad_tactels(forces: Array, good: NDArray[np.bool_]) -> Array:
    """Return forces with bad tactels taken from good ones around, weighted by nearness."""
    if good.all():
        return forces.astype(np.float64)
    if not good.any():
        return np.zeros(forces.shape)
    from scipy.ndimage import gaussian_filter

    known = np.where(good, forces, 0.0)
    filled = known.copy()
    open_ = np.logical_not(good)
    for width in (0.7, 2.0, 8.0):  # dead rows are wider than the nearest neighbours
        weight = gaussian_filter(good.astype(np.float64), width, mode="constant")
        some = open_ & (weight > 1e-3)
        filled[some] = gaussian_filter(known, width, mode="constant")[some] / weight[some]
        open_ = open_ & np.logical_not(some)
    return filled
