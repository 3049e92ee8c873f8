"""What a sensor is: its matrix, the overlay on it, and what its values mean. Thesis 3.3, 4.2.

Sensor frame: seen through its back, from outside the object; origin at the centre of
the matrix in the plane of the undeformed overlay's tips; x right along columns, y up
against rows, z away from the object; tactel (0, 0) top left. mm, N, MPa.

Types are shipped and read from YAML by `probe.sensor_types`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from probe.errors import ContactError

OverlayKind = Literal["tab", "pad", "gel"]
Value = Literal["counts", "conductance", "force", "depth"]
Wiring = Literal["grounded", "floating", "virtual"]


@dataclass(frozen=True, slots=True)
class Overlay:
    """What stands between the sensor and the object: separate tabs, one pad, or a gel.

    Young's modulus and Poisson's ratio are those of the elastomer at small strain. A tab is
    a round column bonded to the sensor; a pad is one layer bonded to it; a gel is a soft layer
    behind a membrane, whose height is seen, not its force.
    """

    kind: OverlayKind = "tab"
    height_mm: float = 2.0  #: of a tab, or thickness of pad or gel
    tab_diameter_mm: float = 1.2666  #: half of a cell's area; no meaning for pad and gel
    young_mpa: float = 1.0
    poisson: float = 0.4999
    membrane_mm: float = 0.0  #: of a gel: way over which its membrane bridges beside a stroke
    blur_mm: float = 0.0  #: of a gel: standard deviation of what optics and matching blur


@dataclass(frozen=True, slots=True)
class SensorType:
    """A matrix of tactels, its overlay and its readings; the default is `fsr-16`, the thesis's own.

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
    pitch_mm: float = 1.5875  #: from column to column, and from row to row
    overlay: Overlay = field(default_factory=Overlay)
    name: str = "fsr-16"
    value: Value = "counts"  #: what a reading is
    unit: float = 1.0  #: of one count: S of conductance, N of force, mm of depth
    bits: int = 10  #: of a reading
    exponent: float = 1.0  #: law: a reading grows with force (depth) to this power
    wiring: Wiring = "grounded"  #: of the rows that are not read
    noise: float = 0.3  #: counts, standard deviation of a tactel at rest
    missing: tuple[tuple[int, int], ...] = ()  #: (row, column) of places without a tactel
    row_pitch_mm: float = 0.0  #: from row to row where it is another; 0: the same

    def __post_init__(self) -> None:
        """See to it that rows as far apart as columns stand under a pad or a gel."""
        if self.row_pitch_mm and self.overlay.kind != "tab":
            raise ContactError(
                f"rows {self.row_pitch_mm:g} mm and columns {self.pitch_mm:g} mm apart under a "
                f"{self.overlay.kind}",
                fix="take tabs, or one pitch for both",
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rows, self.columns

    @property
    def full(self) -> int:
        """Highest reading, counts."""
        return (1 << self.bits) - 1

    @property
    def step_mm(self) -> tuple[float, float]:
        """From column to column (x) and from row to row (y), mm."""
        return self.pitch_mm, self.row_pitch_mm or self.pitch_mm

    @property
    def half_mm(self) -> tuple[float, float]:
        """Half the width (x) and half the height (y) of the matrix, mm."""
        return self.columns * self.step_mm[0] / 2, self.rows * self.step_mm[1] / 2

    @property
    def reach_mm(self) -> float:
        """Radius of the circle about the centre that holds the whole matrix, mm."""
        return math.hypot(*self.half_mm)

    def centres_mm(self) -> NDArray[np.float64]:
        """Return the tactels' centres, (rows, columns, 2), sensor frame."""
        x = (np.arange(self.columns) - (self.columns - 1) / 2) * self.step_mm[0]
        y = ((self.rows - 1) / 2 - np.arange(self.rows)) * self.step_mm[1]
        centres = np.empty((self.rows, self.columns, 2))
        centres[..., 0] = x
        centres[..., 1] = y[:, None]
        return centres

    def with_overlay(self, kind: str) -> SensorType:
        """Return the sensor under tabs or a pad as they usually are; as it is if it has such."""
        if kind in ("", self.overlay.kind):
            return self
        if kind == "tab":
            usual = Overlay()
            share = self.pitch_mm / SensorType().pitch_mm
            overlay = replace(usual, tab_diameter_mm=usual.tab_diameter_mm * share)
            return replace(self, overlay=overlay)
        return replace(self, overlay=Overlay(kind="pad")) if kind == "pad" else self

    def present(self) -> NDArray[np.bool_]:
        """Return where there are tactels, (rows, columns)."""
        there = np.ones(self.shape, np.bool_)
        for row, column in self.missing:
            there[row, column] = False
        return there
