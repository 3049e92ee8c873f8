"""Poses in a plane, and the sources of the pose of each touch. Thesis 4.3.

A pose is (..., 3): x, y (mm) and the turn theta (rad) of one frame in another. `T_a_b` takes points
of frame b to frame a: p_a = R(theta) p_b + (x, y). Errors of a pose are differences of its three
numbers, so covariances belong to (x, y, theta) in the axes of frame a.

The pose of a touch has one of three sources. The arm believes a pose in the frame of the first
touch, wrong by about a tactel. The reader decodes a pose in the frame of the face, right to
hundredths of a tactel, where the touch shows enough symbols. A probe moved by hand counts the steps
from touch to touch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recognizer.errors import MosaicError
from recognizer.touch.recognition import Recognition
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]

# Standard deviations of x, y (mm) and the turn (rad) where no covariance is given.
FIRST_SD = (0.01, 0.01, 0.001)  #: of the first touch against itself
ARM_SD = (0.4, 0.4, 0.004)  #: of a pose by the arm
#: of a step without any measurement. Wide: a step of 14 mm must not look less likely than one of
#: 2 mm, a pitch away
BY_HAND_SD = (8.0, 8.0, math.radians(2))
LEAST_FACING_COS = 0.5  #: a sensor turned by more than 60 degrees does not face the plane


@dataclass(frozen=True, slots=True, eq=False)
class PlanarBelief:
    """A pose in the plane with its uncertainty."""

    pose: Array  #: (3,) x, y (mm), theta (rad)
    covariance: Array  #: (3, 3) of them


@dataclass(frozen=True, slots=True, eq=False)
class PlacedTouch:
    """The signal of a touch and its pose by at least one source."""

    signal: Signal
    believed: PlanarBelief | None = None  #: by the arm, in the arm's plane
    decoded: PlanarBelief | None = None  #: by the reader, in the frame of the face
    stepped: PlanarBelief | None = None  #: from the previous touch, in its frame (dead reckoning)
    seq: int = 0

    def __post_init__(self) -> None:
        if self.believed is None and self.decoded is None and self.stepped is None:
            raise MosaicError(
                f"touch {self.seq} has no place",
                fix="give the arm's pose, or leave out a touch that was not decoded",
                place=f"touch {self.seq}",
            )


def planar_belief(pose: ArrayLike, covariance: ArrayLike) -> PlanarBelief:
    """Return a checked pose with its covariance.

    `pose` is (3,) x, y (mm) and theta (rad), or T_plane_sensor (4, 4); `covariance` (3, 3) of x, y
    and theta, or (3,) standard deviations.

    Raises
    ------
    MosaicError
        The numbers are no pose, or the covariance is not positive definite.
    """
    at = np.array(pose, np.float64)
    if at.shape == (4, 4):
        at = planar_pose(at)
    spread = np.array(covariance, np.float64)
    if spread.shape == (3,):
        spread = np.diag(spread**2)
    if at.shape != (3,) or not np.isfinite(at).all():
        raise MosaicError(
            f"a place of shape {at.shape} or with values that are no numbers",
            fix="give x, y (mm) and theta (rad), or T_plane_sensor (4, 4)",
        )
    sound = spread.shape == (3, 3) and bool(np.isfinite(spread).all())
    sound = sound and np.allclose(spread, spread.T, rtol=1e-6, atol=0)
    scale = np.sqrt(np.diag(spread)) if sound else np.zeros(3)
    if not (scale > 0).all() or np.linalg.eigvalsh(spread / np.outer(scale, scale))[0] < 1e-12:
        raise MosaicError(
            "a covariance that is not positive definite",
            fix="give (3,) standard deviations above 0, or a covariance (3, 3)",
        )
    at.setflags(write=False)
    spread.setflags(write=False)
    return PlanarBelief(at, spread)


def decoded_place(recognition: Recognition) -> PlanarBelief | None:
    """Return the pose on the face that the reader found; None without an answer."""
    if recognition.T_face_probe is None or recognition.covariance is None:
        return None
    return planar_belief(recognition.T_face_probe, recognition.covariance)


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


def pose_difference(a: Array, b: Array) -> Array:
    """Return a - b (..., 3), the turn from -pi up to pi."""
    away = a - b
    away[..., 2] = wrap_angle(away[..., 2])
    return np.asarray(away)


def rotation(theta: float) -> Array:
    """Return (3, 3) that turns x, y of (x, y, theta) by an angle."""
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def relative_covariance(T_m_a: Array, T_m_b: Array, of_a: Array, of_b: Array) -> Array:
    """Return the covariance (3, 3) of T_a_b from those of T_m_a and T_m_b, errors independent."""
    back = rotation(-float(T_m_a[2]))
    x, y = relative_pose(T_m_a, T_m_b)[:2]
    by_a = back.copy()
    by_a[:2, 2] = -y, x  # a turn of a moves b the other way round
    found = by_a @ of_a @ by_a.T + back @ of_b @ back.T
    return np.asarray((found + found.T) / 2)


def composed_covariance(T_m_a: Array, T_a_b: Array, of_a: Array, of_b: Array) -> Array:
    """Return the covariance (3, 3) of T_m_b from those of T_m_a and T_a_b, errors independent."""
    turned = rotation(float(T_m_a[2]))
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
        It is no pose, or it does not face the plane.
    """
    T = np.asarray(T_plane_sensor, np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise MosaicError(f"a pose of shape {T.shape}", fix="give T_plane_sensor (4, 4), mm")
    if T[2, 2] < LEAST_FACING_COS:
        angle = math.degrees(math.acos(max(-1.0, min(1.0, float(T[2, 2])))))
        raise MosaicError(
            f"the sensor is tilted by {angle:.0f} degrees, it must face the plane within 60",
            fix="scan one face at a time; poses are in its frame, z outward",
        )
    return np.array([T[0, 3], T[1, 3], math.atan2(-T[0, 1], T[1, 1])])


def planar_covariance(covariance: ArrayLike, turn: ArrayLike | None = None) -> Array:
    """Return the covariance (3, 3) of x, y and theta of a spatial covariance.

    `covariance` (6, 6) is of (x, y, z, rx, ry, rz) in the axes of a base frame, as `probe.arm`
    gives it; `turn` (3, 3) is R_plane_base, none if the axes are those of the plane.
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
