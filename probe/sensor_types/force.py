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

    force_n: float = 80.0
    imprint_mm: float = 0.2
    """Mean imprint of a gel. Of 100 touches at edges and corners that follow `next` 90 are answered
    by the second at .2 mm, 79 at .5 mm, 55 at 1.2 mm, where the share of the area leads; a face of
    9 x 9 mm is named by 43 of 50 touches at 1 to 4 N, by 11 at 4 to 12 N."""


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
