"""The kind of a face's outline: FACES.face_type of thesis figure 6.16."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_EQUAL = 1e-6  #: lengths that differ by less than this share are equal; angles, rad


def face_type(polygon: Sequence[NDArray[np.float64]]) -> str:
    """Return triangle, square, rectangle, quadrilateral or polygon.

    Parameters
    ----------
    polygon
        Loops (k, 2), mm, the outer one first; a face with holes is a polygon.

    Examples
    --------
    >>> face_type([np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])])
    'rectangle'
    """
    outer = polygon[0]
    if len(polygon) > 1 or len(outer) > 4:
        return "polygon"
    if len(outer) == 3:
        return "triangle"
    sides = np.roll(outer, -1, axis=0) - outer
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    following = np.roll(sides, -1, axis=0)
    cosines = np.sum(sides * following, axis=1) / (lengths * np.roll(lengths, -1))
    if np.abs(cosines).max() > _EQUAL:
        return "quadrilateral"
    return "square" if np.ptp(lengths) <= _EQUAL * lengths.max() else "rectangle"
