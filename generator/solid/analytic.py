"""Cylinder and cone faces as CAD programs know them, in place of a strip of facets.

Lengths in mm, angles in rad, part frame unless said.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BentSymbol:
    """A symbol on a round face, in the frame of the face's axis."""

    name: str  #: "r12c34"
    z_mm: tuple[float, ...]  #: height of each tier
    rings: tuple[tuple[tuple[Points, ...], ...], ...]
    """[tier][ring][edge] (degree, 3): Bezier curve of an edge, without its end."""


@dataclass(frozen=True, slots=True)
class Rim:
    """The arc of a circle that a round face ends in; at the tip of a cone radius 0."""

    vertices: tuple[int, ...]  #: of the part, to the right; the first again where it is closed
    radius_mm: float
    height_mm: float  #: along the axis


@dataclass(frozen=True, slots=True)
class AnalyticFace:
    """A cylinder or cone face of a part, in place of facets."""

    name: str
    facets: tuple[int, ...]  #: of the part, that it stands for
    T_part_axis: Points  #: (4, 4); z along the axis from the lower rim to the upper, line 0 at x
    low: Rim
    high: Rim
    angle_rad: float  #: from the first line to the last, about z
    concave: bool
    symbols: tuple[BentSymbol, ...]

    @property
    def closed(self) -> bool:
        """Whether it goes all around the axis."""
        return self.low.vertices[0] == self.low.vertices[-1]

    @property
    def slope(self) -> float:
        """Radius that it gains for each mm along the axis; 0 for a cylinder."""
        return (self.high.radius_mm - self.low.radius_mm) / (
            self.high.height_mm - self.low.height_mm
        )

    def radius_at(self, height_mm: Points, z_mm: Points) -> Points:
        """Return the radius of the face moved outward by z, at heights along the axis."""
        moved = z_mm * math.hypot(1.0, self.slope) * (-1.0 if self.concave else 1.0)
        radius: Points = self.low.radius_mm + self.slope * (height_mm - self.low.height_mm) + moved
        return radius
