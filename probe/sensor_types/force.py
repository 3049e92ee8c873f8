"""How hard a sensor type is pressed, beside the usual one: as hard for its area, a gel as deep.

A gel is far softer than tabs: the forces of `fsr-16` on its area press `gel-24x32` through, or bare
face and symbols alike into it. What counts is how deep it is imprinted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from probe.sensor import SensorType


@dataclass(frozen=True, slots=True)
class TouchForceSettings:
    """A force on `fsr-16`, and what does the same to a gel."""

    force_n: float = 80.0  #: as the thesis pressed its washer
    imprint_mm: float = 0.3
    """Mean imprint of a gel. Of 300 touches of all kinds 206 are answered at .2 and at .3 mm, 189
    at 1.2 mm, where the share of the area leads; at edges 35, 32 and 17 of 40, of mismatched gels
    amid faces 35, 38 and 42 of 42: noise hides what is weak. Of 100 at edges and corners that
    follow `next` 93 are answered by the second at .2 mm, 84 at .3 mm."""


TOUCH_FORCE = TouchForceSettings()


def force_share(sensor: SensorType, settings: TouchForceSettings = TOUCH_FORCE) -> float:
    """Return the share of forces on `fsr-16` that a type is pressed with.

    Examples
    --------
    >>> force_share(SensorType())
    1.0
    """
    area_mm2 = 4 * math.prod(sensor.half_mm)
    if sensor.overlay.kind == "gel":
        bed_n_mm3 = sensor.overlay.young_mpa / sensor.overlay.height_mm
        return settings.imprint_mm * bed_n_mm3 * area_mm2 / settings.force_n
    return area_mm2 / (4 * math.prod(SensorType().half_mm))


def usual_force_n(sensor: SensorType) -> float:
    """Return what a type is pressed with where nothing else is said, N.

    Examples
    --------
    >>> usual_force_n(SensorType())
    80.0
    """
    return TOUCH_FORCE.force_n * force_share(sensor)
