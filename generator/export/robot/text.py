"""Numbers, rotations and colours as robot and simulator files write them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from generator.export.colours import RGB

Floats = NDArray[np.float64]
ZERO = 1e-16  #: nothing in a file is smaller: rotations, metres, kilograms
GIMBAL = 1e-12  #: a cosine of the pitch below it leaves roll and yaw one freedom


def numbers(values: Iterable[float]) -> str:
    """Return numbers with spaces between, to 15 digits; what is rounding about zero is zero."""
    return " ".join(f"{value if abs(value) > ZERO else 0.0:.15g}" for value in values)


def rgba(colour: RGB) -> str:
    """Return a colour of 0 to 255 as four numbers of 0 to 1."""
    return numbers([*(round(value / 255, 4) for value in colour), 1])


def quaternion(R: Floats) -> Floats:
    """Return (w, x, y, z) of a rotation (3, 3), w not below 0; by the largest of the four."""
    square = np.array(
        [
            1 + R[0, 0] + R[1, 1] + R[2, 2],
            1 + R[0, 0] - R[1, 1] - R[2, 2],
            1 - R[0, 0] + R[1, 1] - R[2, 2],
            1 - R[0, 0] - R[1, 1] + R[2, 2],
        ]
    )
    largest = int(np.argmax(square))
    products = np.array(
        [
            [square[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
            [R[2, 1] - R[1, 2], square[1], R[1, 0] + R[0, 1], R[0, 2] + R[2, 0]],
            [R[0, 2] - R[2, 0], R[1, 0] + R[0, 1], square[2], R[2, 1] + R[1, 2]],
            [R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2], square[3]],
        ]
    )
    found: Floats = products[largest] / np.linalg.norm(products[largest])
    return -found if found[0] < 0 else found


def roll_pitch_yaw(R: Floats) -> tuple[float, float, float]:
    """Return the angles with R = Rz(yaw) Ry(pitch) Rx(roll), rad; yaw is 0 where it is free."""
    cosine = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], cosine)
    if cosine < GIMBAL:
        return math.atan2(-R[1, 2], R[1, 1]), pitch, 0.0
    return math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])


def pose(T: Floats) -> str:
    """Return x y z roll pitch yaw of a pose (4, 4)."""
    return numbers([*T[:3, 3], *roll_pitch_yaw(T[:3, :3])])


def document(root: ElementTree.Element) -> bytes:
    """Return an XML file, indented."""
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()
