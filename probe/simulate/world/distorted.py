"""A surface as a printer leaves it: strokes too wide, and everything scaled."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.surface.body import body_of
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class DistortedSurface:
    """A surface as a printer leaves it: everything wider by a stroke's excess, and scaled."""

    surface: HeightMap
    wider_mm: float
    scale: float
    about_mm: tuple[float, float]  #: point that the scale leaves where it is

    @property
    def top_mm(self) -> float:
        """Height of the highest point."""
        return self.surface.top_mm

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the highest place within half the excess of each point."""
        centre = np.array(self.about_mm)
        at = (points_mm - centre) / (1 + self.scale) + centre
        highest = self.surface.heights_mm(at)
        if self.wider_mm > 0:
            for turn in range(4):
                angle = turn * math.pi / 2
                by = self.wider_mm / 2 * np.array([math.cos(angle), math.sin(angle)])
                highest = np.maximum(highest, self.surface.heights_mm(at + by))
        return highest

    @property
    def solid_mm(self) -> Array | None:
        """Return the body (n, 3, 3), scaled; its strokes are as wide as drawn."""
        body = body_of(self.surface)
        if body is None:
            return None
        centre = np.array([*self.about_mm, 0.0])
        scales = np.array([1 + self.scale, 1 + self.scale, 1.0])
        scaled: Array = (body - centre) * scales + centre
        return scaled
