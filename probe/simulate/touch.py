"""Touches at random, and where a touched sensor stands. Thesis 4.2.

A `Touch` is its own truth: where the sensor stands, how it is turned and pressed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Contact, Touch, WristStiffness
from probe.errors import SurfaceError
from probe.surface.polygon import FaceRegion

TRIES = 16_000  #: draws for one touch: a region that fills 0.1 % of its box is still found
AT_ONCE = 16  #: draws


@dataclass(frozen=True, slots=True)
class TouchRanges:
    """Ranges of random touches; any rotation."""

    force_n: tuple[float, float] = (20.0, 120.0)
    tilt_rad: float = math.radians(2.0)  #: largest tilt of the unloaded wrist, in any direction
    margin_mm: float = 0.0  #: least distance of the sensor's centre from the region's edges
    wrist: WristStiffness = field(default_factory=WristStiffness)


def random_touches(
    region: FaceRegion, rng: np.random.Generator, ranges: TouchRanges | None = None
) -> Iterator[Touch]:
    """Yield touches without end, their centres uniform over a region (surface frame).

    Raises
    ------
    SurfaceError
        When the region has no place so far from its edges, or a range is no range.
    """
    given = ranges or TouchRanges()
    low_n, high_n = given.force_n
    if not (0 <= low_n <= high_n < math.inf and given.tilt_rad >= 0 and given.margin_mm >= 0):
        raise SurfaceError(
            f"forces {low_n:g} ... {high_n:g} N, tilt {math.degrees(given.tilt_rad):g} degrees, "
            f"margin {given.margin_mm:g} mm",
            fix="give rising forces, tilt and margin of 0 or more",
        )
    while True:
        x, y = _place(region, rng, given.margin_mm)
        theta, towards = rng.uniform(-math.pi, math.pi, 2)
        tilt = given.tilt_rad * math.sqrt(rng.random())
        yield Touch(
            x_mm=x,
            y_mm=y,
            theta_rad=float(theta),
            force_n=float(rng.uniform(low_n, high_n)),
            tilt_x_rad=tilt * math.cos(towards),
            tilt_y_rad=tilt * math.sin(towards),
            wrist=given.wrist,
        )


def pose_of(touch: Touch, contact: Contact) -> NDArray[np.float64]:
    """Return T_surface_sensor (4, 4) of the plate at rest, mm.

    The plate is turned by theta about z, then by its tilts about its own x and y.
    """
    c, s = math.cos(touch.theta_rad), math.sin(touch.theta_rad)
    a, b = contact.tilt_x_rad, contact.tilt_y_rad
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
    about_y = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
    T_surface_sensor = np.eye(4)
    T_surface_sensor[:3, :3] = about_z @ about_x @ about_y
    T_surface_sensor[:3, 3] = touch.x_mm, touch.y_mm, contact.z_mm
    return T_surface_sensor


def _place(region: FaceRegion, rng: np.random.Generator, margin_mm: float) -> tuple[float, float]:
    """Draw a point of a region, uniform in the part that lies a margin inside its edges."""
    low, high = region.box_mm
    for _ in range(TRIES // AT_ONCE):
        points = low + (high - low) * rng.random((AT_ONCE, 2))
        points = points[region.contains(points)]
        if margin_mm > 0:
            points = points[region.distance_mm(points) >= margin_mm]
        if len(points):
            return float(points[0, 0]), float(points[0, 1])
    raise SurfaceError(
        f"no place lies {margin_mm:g} mm inside the edges of a face of "
        f"{high[0] - low[0]:.3g} x {high[1] - low[1]:.3g} mm",
        fix="take a smaller margin, or a larger face",
    )
