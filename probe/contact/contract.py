"""Contact models: what they take and give. Thesis 4.2.

The plate that carries the sensor is rigid. Over the surface the plane of its tips stands at

    zeta(x, y) = z + tilt_x * y - tilt_y * x        (x, y in the sensor frame, small tilts)

and presses the overlay by h(x, y) - zeta(x, y) where that is positive; h is the height of
the surface under the sensor's point: finite, or -inf where there is no matter. mm, N, rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]

STEEPEST_RAD = 0.35  #: largest tilt of the plate; beyond, tilts are not small


@dataclass(frozen=True, slots=True)
class WristStiffness:
    """Stiffness of the wrist. Zero leaves the plate free to turn."""

    tilt_x_nmm_rad: float = 3000.0  #: moment about x per turn about x, N mm / rad
    tilt_y_nmm_rad: float = 3000.0


@dataclass(frozen=True, slots=True)
class Touch:
    """Pose, force and wrist of the sensor over a surface.

    A point (x, y) of the sensor lies over the surface's point (x_mm + x cos theta - y sin theta,
    y_mm + x sin theta + y cos theta). `tilt_*_rad` is how the unloaded wrist stands against the
    surface, turns about the sensor's x and y.
    """

    x_mm: float
    y_mm: float
    theta_rad: float
    force_n: float
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0
    wrist: WristStiffness = field(default_factory=WristStiffness)

    def on_surface(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Take points (..., 2) of the sensor frame to the surface frame."""
        c, s = math.cos(self.theta_rad), math.sin(self.theta_rad)
        x, y = points_mm[..., 0], points_mm[..., 1]
        return np.stack([self.x_mm + c * x - s * y, self.y_mm + s * x + c * y], axis=-1)

    def on_sensor(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Take points (..., 2) of the surface frame to the sensor frame."""
        c, s = math.cos(self.theta_rad), math.sin(self.theta_rad)
        return np.asarray((points_mm - (self.x_mm, self.y_mm)) @ np.array([[c, -s], [s, c]]))


@dataclass(frozen=True, slots=True)
class Contact:
    """Forces on the tactels, and the plate at rest."""

    forces_n: NDArray[np.float64]  #: (rows, columns) on each tactel
    z_mm: float  #: height of the centre of the tips' plane over the surface frame; inf: no contact
    tilt_x_rad: float
    tilt_y_rad: float
    level: str  #: footprint, tabs, layer, gel
    iterations: int


def no_contact(sensor: SensorType, touch: Touch, level: str) -> Contact:
    """Return the contact of a touch without a force: zeros."""
    zeros = np.zeros(sensor.shape)
    return Contact(zeros, math.inf, touch.tilt_x_rad, touch.tilt_y_rad, level, iterations=0)


def refuse_steep(tilt_x_rad: float, tilt_y_rad: float, steepest_rad: float = STEEPEST_RAD) -> None:
    """Refuse a plate that comes to rest at tilts that are not small."""
    tilt = max(abs(tilt_x_rad), abs(tilt_y_rad))
    if tilt > steepest_rad:
        raise ContactError(
            f"the plate tips: it comes to rest at a tilt of {math.degrees(tilt):.3g} degrees, "
            f"beyond {math.degrees(STEEPEST_RAD):.3g}",
            fix="move the sensor, press with less force, or take a stiffer wrist",
        )


def heights_at(surface: HeightMap, touch: Touch, points_mm: Array) -> Array:
    """Return heights (...), mm, at points (..., 2) of the sensor frame.

    Raises `ContactError` for heights that are no numbers, or +inf.
    """
    points = touch.on_surface(points_mm.reshape(-1, 2))
    heights = np.asarray(surface.heights_mm(points), np.float64)
    if heights.shape != (len(points),) or not heights.max(initial=-np.inf) < np.inf:  # NaN, too
        raise ContactError(
            "the surface gives heights that are no numbers",
            fix="give a finite height at each point, or -inf where there is no matter",
        )
    return heights.reshape(points_mm.shape[:-1])


def nothing_under(touch: Touch) -> ContactError:
    """Return the refusal of a touch under which there is no matter."""
    return ContactError(
        f"there is nothing under the sensor to bear {touch.force_n:g} N",
        fix="move the sensor over the object",
    )


def heights_under(surface: HeightMap, touch: Touch, points_mm: Array) -> Array:
    """Return the heights under points (..., 2) of the sensor; refuse to press on nothing."""
    heights = heights_at(surface, touch, points_mm)
    if heights.max(initial=-math.inf) == -math.inf:
        raise nothing_under(touch)
    return heights
