"""The geometry of the sensor and of the elastic overlay on it. Thesis 3.3, 4.2.

Sensor frame: seen through its back, from outside the object; origin at the centre of
the matrix in the plane of the undeformed overlay's tips; x right along columns, y up
against rows, z away from the object; tactel (0, 0) top left. mm, N, MPa.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Overlay:
    """What stands between the force sensor and the object: separate tabs, or one pad.

    Young's modulus and Poisson's ratio are those of the elastomer at small strain. A tab is
    a round column bonded to the sensor; a pad is one layer bonded to it.
    """

    kind: Literal["tab", "pad"] = "tab"
    height_mm: float = 2.0  #: of a tab, or thickness of the pad
    tab_diameter_mm: float = 1.2666  #: half of a cell's area; no meaning for a pad
    young_mpa: float = 1.0
    poisson: float = 0.4999


@dataclass(frozen=True, slots=True)
class SensorType:
    """A matrix of tactels and its overlay; the default is `fsr-16`, the thesis's own.

    Examples
    --------
    >>> sensor = SensorType()
    >>> sensor.name, sensor.rows, sensor.columns, sensor.pitch_mm
    ('fsr-16', 16, 16, 1.5875)
    >>> sensor.half_mm
    (12.7, 12.7)
    """

    rows: int = 16
    columns: int = 16
    pitch_mm: float = 1.5875  #: from tactel to tactel, both ways
    overlay: Overlay = field(default_factory=Overlay)
    name: str = "fsr-16"

    @property
    def half_mm(self) -> tuple[float, float]:
        """Half the width (x) and half the height (y) of the matrix, mm."""
        return self.columns * self.pitch_mm / 2, self.rows * self.pitch_mm / 2

    @property
    def reach_mm(self) -> float:
        """Radius of the circle about the centre that holds the whole matrix, mm."""
        return math.hypot(*self.half_mm)

    def centres_mm(self) -> NDArray[np.float64]:
        """Return the tactels' centres, (rows, columns, 2), sensor frame."""
        x = (np.arange(self.columns) - (self.columns - 1) / 2) * self.pitch_mm
        y = ((self.rows - 1) / 2 - np.arange(self.rows)) * self.pitch_mm
        centres = np.empty((self.rows, self.columns, 2))
        centres[..., 0] = x
        centres[..., 1] = y[:, None]
        return centres
