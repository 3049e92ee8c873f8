"""Level "footprint": the force is shared by cover alone. Thesis 4.2.

Surface + sensor + touch -> force on each tactel = F times the share of its tip under which
the surface reaches to within a depth of its highest place, over the sum of all shares. No
elasticity, no equilibrium: the plate keeps the wrist's tilt and stands at first touch.
"""

from __future__ import annotations

import math

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Contact, Touch
from probe.contact.plate import PlatePose, checked_load, load_of
from probe.contact.settings import FOOTPRINT
from probe.contact.tabs import heights_under
from probe.contact.tips import Tips, tip_points
from probe.errors import ContactError
from probe.surface.contract import HeightMap


def footprint(
    surface: HeightMap,
    sensor: SensorType,
    touch: Touch,
    tips: Tips | None = None,
    *,
    depth_mm: float | None = None,
) -> Contact:
    """Share the force by cover.

    Parameters
    ----------
    surface
        Heights in the surface frame.
    sensor
        With tabs the round tips are asked, with a pad the whole squares of the tactels.
    touch
        Pose and force; the wrist is not asked.
    tips
        How finely the tips are asked; 19 points each without it (a pad: 16).
    depth_mm
        How far below the highest place, against the wrist's tilt, the surface counts; a
        quarter of the overlay's height without it.

    Returns
    -------
    Contact
        Forces (rows, columns), N; the plate at first touch.

    Raises
    ------
    ContactError
        When nothing lies under the sensor, or a force or a height is no number.
    """
    load = load_of(touch)
    checked_load(load)
    shape = (sensor.rows, sensor.columns)
    if touch.force_n == 0:
        return Contact(
            np.zeros(shape), math.inf, touch.tilt_x_rad, touch.tilt_y_rad, "footprint", iterations=0
        )
    depth = FOOTPRINT.depth * sensor.overlay.height_mm if depth_mm is None else depth_mm
    if not 0 <= depth < math.inf:
        raise ContactError(f"a depth of {depth:g} mm", fix="give a finite depth >= 0")
    points, drop = tip_points(sensor, tips or _PLAIN)
    unloaded = PlatePose(0.0, touch.tilt_x_rad, touch.tilt_y_rad)
    level = heights_under(surface, touch, points) - drop - unloaded.heights_mm(points)
    highest = float(level.max())
    cover = (level >= highest - depth).mean(axis=1)
    forces = touch.force_n * (cover / cover.sum()).reshape(shape)
    return Contact(forces, highest, touch.tilt_x_rad, touch.tilt_y_rad, "footprint", iterations=0)


_PLAIN = Tips()
