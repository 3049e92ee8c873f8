"""Place on the lattice -> pose on the face and on the object, with its covariance.

A symbol of the face stands in the lattice frame at the centre of its cell, and in the face frame
where the layout put it; the frames differ by the placement's turn. Thesis 6.3.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.as_built import TouchScale
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.lab import EmbossedArray, EncodedFace
from recognizer.touch.symbols.fit import Fit

Array = NDArray[np.float64]


def face_pose(
    embossed: EmbossedArray, face: EncodedFace, hypothesis: Hypothesis, fit: Fit
) -> Array:
    """Return T_face_probe (4, 4), mm: the sensor's tips in the plane of the symbols' tops."""
    array, pitch = embossed.array, embossed.style.pitch_mm
    # the symbol nearest to the sensor's centre ties the two frames together: on a face longer than
    # half of the array another one may be nearer the other way round
    along = fit.x_mm / pitch - 0.5 - (face.columns - hypothesis.column)
    up = fit.y_mm / pitch - 0.5 - (hypothesis.row - face.rows)
    along -= np.round(along / array.columns) * array.columns
    up -= np.round(up / array.rows) * array.rows
    near = int(np.argmin(along**2 + up**2))
    away = pitch * np.array([along[near], up[near]])
    c, s = math.cos(face.rotation_rad), math.sin(face.rotation_rad)
    turned = np.array([c * away[0] + s * away[1], c * away[1] - s * away[0]])
    centre = face.centres_mm[near] + turned
    turn = fit.theta_rad - face.rotation_rad
    pose = np.eye(4)
    pose[:2, :2] = [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
    pose[:3, 3] = centre[0], centre[1], embossed.style.height_mm
    return pose


def pose_on_object(face: EncodedFace, T_face_probe: Array) -> Array:
    """Return T_object_probe (4, 4), mm: on a round face the sensor stands in the tangent plane."""
    if face.round is None:
        return face.T_object_face @ T_face_probe
    x, y = float(T_face_probe[0, 3]), float(T_face_probe[1, 3])
    return face.round.tangent(x, y) @ T_face_probe


def face_covariance(face: EncodedFace, covariance: Array) -> Array:
    """Turn a covariance (3, 3) of x, y (mm) and theta (rad) from the lattice to the face frame."""
    c, s = math.cos(face.rotation_rad), math.sin(face.rotation_rad)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return np.asarray(turn @ covariance @ turn.T)


def felt_scale(face: EncodedFace, fit: Fit, expected: float) -> TouchScale | None:
    """Return the scale of a print by a fit, in the face frame; None if it fits none.

    `expected` is the standard deviation within which the fit took it to be 1.
    """
    if fit.with_scale is None:
        return None
    x, y, turn, variance = fit.with_scale.tolist()
    c, s = math.cos(face.rotation_rad), math.sin(face.rotation_rad)
    covariance = np.array([c * x + s * y, c * y - s * x, turn, variance])
    return TouchScale(float(fit.nuisance[3]), covariance, expected)


def inside_mm(face: EncodedFace, x: float, y: float) -> float:
    """Return how far a point lies inside the face's outline; negative outside. Holes count."""
    distance, crossings = math.inf, 0
    for loop in face.polygon_mm:
        ends = np.roll(loop, -1, axis=0)
        for (x0, y0), (x1, y1) in zip(loop.tolist(), ends.tolist(), strict=True):
            dx, dy = x1 - x0, y1 - y0
            t = min(1.0, max(0.0, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy)))
            distance = min(distance, math.hypot(x - x0 - t * dx, y - y0 - t * dy))
            if (y0 > y) != (y1 > y):  # the side is taken from the lower end, so edges agree
                low, high = ((x0, y0), (x1, y1)) if y0 < y1 else ((x1, y1), (x0, y0))
                side = (high[0] - low[0]) * (y - low[1]) - (x - low[0]) * (high[1] - low[1])
                crossings += side > 0
    return distance if crossings % 2 else -distance
