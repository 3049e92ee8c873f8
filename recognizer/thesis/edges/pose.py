"""Corner in view + outline of a face -> where the probe stands on it. Appendix 3, thesis 6.3.

The model is laid on what is seen: turned until its edges run alike, then moved until corner lies
on corner. Without symbols nothing says which corner it is: every corner of the outline with the
same opening is a place, and a face with equal corners leaves as many of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recognizer.thesis.edges.line import Corner

Array = NDArray[np.float64]

ALIKE_RAD = math.radians(8)  #: by which openings may differ


@dataclass(frozen=True, slots=True, eq=False)
class CornerPose:
    """The probe on a face, by one corner."""

    loop: int  #: of the outline
    vertex: int  #: of that loop
    T_face_probe: Array  #: (4, 4)
    covariance: Array  #: (3, 3) of x, y (mm) and the turn about z (rad), face frame
    off_rad: float  #: how far the opening is from the model's


def corner_poses(corner: Corner, polygon_mm: Sequence[ArrayLike]) -> tuple[CornerPose, ...]:
    """Return where the probe can stand if the corner that it feels is one of a face.

    Parameters
    ----------
    corner
        In the sensor frame.
    polygon_mm
        (k, 2) loops of the face, its outer one counter-clockwise, holes clockwise.

    Returns
    -------
    One pose for each vertex that opens alike, the most alike first.
    """
    back = np.linalg.inv(corner.T_image_corner)
    seen = _of_inverse(corner)
    found = []
    for number, loop in enumerate(polygon_mm):
        corners = np.asarray(loop, np.float64)
        ways = np.roll(corners, -1, axis=0) - corners
        angles = np.arctan2(ways[:, 1], ways[:, 0])
        for k, (x, y) in enumerate(corners.tolist()):
            turn = math.remainder(float(angles[k] - angles[k - 1]), math.tau)
            off = abs(math.pi - turn - corner.opening_rad)
            if off > ALIKE_RAD:
                continue
            c, s = math.cos(angles[k]), math.sin(angles[k])
            T_face_corner = np.array(
                [[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]], np.float64
            )
            R = T_face_corner[:3, :3]
            found.append(CornerPose(number, k, T_face_corner @ back, R @ seen @ R.T, off))
    return tuple(sorted(found, key=lambda pose: pose.off_rad))


def _of_inverse(corner: Corner) -> Array:
    """Return the covariance of x, y, theta of the probe in the corner's frame."""
    T = corner.T_image_corner
    c, s, (x, y) = T[0, 0], T[1, 0], T[:2, 3].tolist()
    jacobian = np.array([[-c, -s, s * x - c * y], [s, -c, c * x + s * y], [0.0, 0.0, -1.0]])
    return np.asarray(jacobian @ corner.covariance @ jacobian.T)
