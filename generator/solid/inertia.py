"""Closed meshes -> volume, centre of mass and inertia, in closed form.

Sums over the tetrahedra that the triangles span with the origin; exact but for rounding, also
for several bodies at once.

References
----------
F. Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", 2004.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Inertia:
    """Of a body of density 1, in the axes of its corners."""

    volume: float  #: mm^3
    centre: Floats  #: (3,) mm
    tensor: Floats  #: (3, 3) mm^5, about the centre


def inertia_of(corners: Floats) -> Inertia:
    """Return volume, centre and inertia.

    Parameters
    ----------
    corners
        (n, 3, 3) corners of the triangles of closed meshes, counter-clockwise from outside, mm.
    """
    middle = corners.reshape(-1, 3).mean(axis=0)  # near the origin rounding is least
    a, b, c = np.moveaxis(corners - middle, 1, 0)
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    whole = a + b + c
    volume = float(six.sum()) / 6
    centre = six @ whole / 24 / volume
    second = np.zeros((3, 3))
    for points in (whole, a, b, c):
        second += (points * six[:, None]).T @ points / 120
    second -= volume * np.outer(centre, centre)
    return Inertia(volume, middle + centre, np.trace(second) * np.eye(3) - second)
