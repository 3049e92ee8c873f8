"""Poses in a plane: x, y (mm) and the turn theta (rad) of one frame in another. Thesis 4.3.

A pose is (..., 3); `T_a_b` takes points of frame b to frame a:
p_a = R(theta) p_b + (x, y). Errors of a pose are differences of its three numbers, so that
covariances belong to (x, y, theta) in the axes of frame a.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recognizer.scan.mosaic.errors import MosaicError
from recognizer.scan.mosaic.settings import PLANAR

Array = NDArray[np.float64]


def compose_poses(T_a_b: Array, T_b_c: Array) -> Array:
    """Return T_a_c."""
    at = transform_points(T_a_b, T_b_c[..., :2])
    turn = wrap_angle(T_a_b[..., 2] + T_b_c[..., 2])
    return np.concatenate([at, turn[..., None]], axis=-1)


def inverse(T_a_b: Array) -> Array:
    """Return T_b_a."""
    c, s = np.cos(T_a_b[..., 2]), np.sin(T_a_b[..., 2])
    x, y = T_a_b[..., 0], T_a_b[..., 1]
    return np.stack([-c * x - s * y, s * x - c * y, wrap_angle(-T_a_b[..., 2])], axis=-1)


def relative_pose(T_m_a: Array, T_m_b: Array) -> Array:
    """Return T_a_b of two poses in one frame m."""
    return compose_poses(inverse(T_m_a), T_m_b)


def transform_points(T_a_b: Array, points_mm: Array) -> Array:
    """Take points (..., 2) of frame b to frame a."""
    c, s = np.cos(T_a_b[..., 2]), np.sin(T_a_b[..., 2])
    x, y = points_mm[..., 0], points_mm[..., 1]
    return np.stack([T_a_b[..., 0] + c * x - s * y, T_a_b[..., 1] + s * x + c * y], axis=-1)


def wrap_angle(angle: Array) -> Array:
    """Return angles from -pi up to pi."""
    return np.asarray((angle + math.pi) % (2 * math.pi) - math.pi)


def relative_covariance(T_m_a: Array, T_m_b: Array, of_a: Array, of_b: Array) -> Array:
    """Return the covariance (3, 3) of T_a_b from those of T_m_a and T_m_b, errors independent."""
    c, s = math.cos(T_m_a[2]), math.sin(T_m_a[2])
    back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    x, y = relative_pose(T_m_a, T_m_b)[:2]
    by_a = back.copy()
    by_a[:2, 2] = -y, x  # a turn of a moves b the other way round
    found = by_a @ of_a @ by_a.T + back @ of_b @ back.T
    return np.asarray((found + found.T) / 2)


def composed_covariance(T_m_a: Array, T_a_b: Array, of_a: Array, of_b: Array) -> Array:
    """Return the covariance (3, 3) of T_m_b from those of T_m_a and T_a_b, errors independent."""
    c, s = math.cos(T_m_a[2]), math.sin(T_m_a[2])
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    x, y = turned[:2, :2] @ T_a_b[:2]
    by_a = np.eye(3)
    by_a[:2, 2] = -y, x
    found = by_a @ of_a @ by_a.T + turned @ of_b @ turned.T
    return np.asarray((found + found.T) / 2)


def planar_pose(T_plane_sensor: ArrayLike) -> Array:
    """Return (3,) of a pose (4, 4) that faces the plane z = 0.

    Raises
    ------
    MosaicError
        No pose, or one that does not face the plane.
    """
    T = np.asarray(T_plane_sensor, np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise MosaicError(f"a pose of shape {T.shape}", fix="give T_plane_sensor (4, 4), mm")
    if T[2, 2] < PLANAR.steepest_cos:
        angle = math.degrees(math.acos(max(-1.0, min(1.0, float(T[2, 2])))))
        raise MosaicError(
            f"the sensor is tilted by {angle:.0f} degrees, it must face the plane within 60",
            fix="scan one face at a time; poses are in its frame, z outward",
        )
    return np.array([T[0, 3], T[1, 3], math.atan2(-T[0, 1], T[1, 1])])


def planar_covariance(covariance: ArrayLike, turn: ArrayLike | None = None) -> Array:
    """Return the (3, 3) of x, y and theta that a spatial covariance leaves in the plane.

    Parameters
    ----------
    covariance
        (6, 6) of (x, y, z, rx, ry, rz) in the axes of a base frame, as `probe.arm` gives it.
    turn
        (3, 3) rotation R_plane_base; none if the axes are those of the plane.
    """
    given = np.asarray(covariance, np.float64)
    R = np.eye(3) if turn is None else np.asarray(turn, np.float64)
    if given.shape != (6, 6) or R.shape != (3, 3):
        raise MosaicError(
            f"a covariance of shape {given.shape}", fix="give (6, 6) of (x, y, z, rx, ry, rz)"
        )
    chosen = np.zeros((3, 6))
    chosen[0, :3], chosen[1, :3], chosen[2, 3:] = R[0], R[1], R[2]
    found = chosen @ given @ chosen.T
    return np.asarray((found + found.T) / 2)
