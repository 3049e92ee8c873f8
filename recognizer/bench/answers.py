"""Recognition + Lab -> JSON for the page.

It holds the plain values of `Recognition.as_json`, the symbols of the face that lie under the
sensor (sensor frame), and the sensor's outline on the array.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.lab import EmbossedArray, EncodedFace, Lab, find_face
from recognizer.touch.recognition import Recognition

Array = NDArray[np.float64]

#: what the operator can do about a touch that is not answered
ADVICE = {
    "no contact": "nothing is touched",
    "too few symbols": "press harder, or move further onto the face",
    "ambiguous": "two places look alike here; touch a little beside it",
    "ambiguous by chance": "these few symbols could be anyone's; touch a little beside it",
    "not an encoded surface": "no registered symbols are felt; is the object in this database?",
    "outside every face": "the sensor's centre lies beyond the face; move inwards",
}


def answer_json(recognition: Recognition, lab: Lab, sensor: SensorType) -> dict[str, Any]:
    """Return an answer for the page."""
    answer = recognition.as_json()
    margin = recognition.margin
    answer["margin"] = None if margin is None or math.isinf(margin) else round(margin, 2)
    answer["alone"] = margin is not None and math.isinf(margin)
    cause = recognition.cause
    short, colon, rest = ("" if cause is None else str(cause)).partition(": ")
    answer["because"] = short if colon else recognition.reason
    answer["advice"] = ADVICE.get(recognition.reason, "")
    if cause is not None:
        answer["advice"] = f"{rest or short}; {recognition.way_out}"
    answer["noise"] = None if recognition.noise is None else round(recognition.noise, 3)
    pose = recognition.T_face_probe
    found = find_face(lab, recognition.object or "", recognition.face or "")
    if pose is None or found is None or recognition.covariance is None:
        return answer | {"place": None, "symbols": [], "window": None}
    encoding = lab.arrays[found[0]]
    face = encoding.face(found[1])
    (x, y), theta = pose[:2, 3].tolist(), math.atan2(pose[1, 0], pose[0, 0])
    spread = np.sqrt(np.diag(recognition.covariance))
    return answer | {
        "place": {
            "x_mm": round(x, 3), "y_mm": round(y, 3), "theta_deg": round(math.degrees(theta), 2),
            "sigma_mm": round(float(spread[:2].max()), 3),
            "sigma_deg": round(math.degrees(float(spread[2])), 3),
        },
        "symbols": _symbols_in_view(encoding, face, sensor, pose),
        "turn": round(-face.rotation_rad - theta, 5),
        "window": {"encoding": found[0], "corners": _corners(encoding, face, sensor, pose)},
    }  # fmt: skip


def _symbols_in_view(
    encoding: EmbossedArray, face: EncodedFace, sensor: SensorType, pose: Array
) -> list[list[float]]:
    """Return row, column, label, x and y (sensor frame, mm) of the symbols in view."""
    at = (face.centres_mm - pose[:2, 3]) @ pose[:2, :2]
    half = np.array(sensor.half_mm) + encoding.style.pitch_mm / 2
    near = np.flatnonzero((np.abs(at) < half).all(axis=1))
    return [
        [int(face.rows[k]), int(face.columns[k]), int(face.labels[k]),
         round(float(at[k, 0]), 3), round(float(at[k, 1]), 3)]
        for k in near.tolist()
    ]  # fmt: skip


def _corners(
    encoding: EmbossedArray, face: EncodedFace, sensor: SensorType, pose: Array
) -> list[list[float]]:
    """Return the sensor's corners on the array, as rows and columns (not wrapped)."""
    w, h = sensor.half_mm
    corners = np.array([(-w, h), (w, h), (w, -h), (-w, -h)]) @ pose[:2, :2].T + pose[:2, 3]
    away = (corners - face.centres_mm[0]) / encoding.style.pitch_mm
    c, s = math.cos(face.rotation_rad), math.sin(face.rotation_rad)
    u, v = c * away[:, 0] - s * away[:, 1], s * away[:, 0] + c * away[:, 1]
    at = np.stack([face.rows[0] + 0.5 - v, face.columns[0] + 0.5 + u], axis=1)
    return [[round(value, 3) for value in corner] for corner in at.tolist()]
