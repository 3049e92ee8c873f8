"""Pose of the sensor over a surface <-> touch of the contact models. Thesis 4.3.

`T_surface_sensor = [Rz(theta) Rx(tilt_x) Ry(tilt_y) | x, y, z]`: the tips' plane then stands at
z + tilt_x y - tilt_y x over the sensor's point (x, y), as the contact models have it for small
tilts. mm, rad.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.contact.contract import Touch, WristStiffness
from probe.errors import PoseError


def surface_to_sensor(
    x_mm: float, y_mm: float, theta_rad: float, z_mm: float = 0.0
) -> NDArray[np.float64]:
    """Return T_surface_sensor (4, 4) of a level sensor."""
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    return np.array(
        [[c, -s, 0.0, x_mm], [s, c, 0.0, y_mm], [0.0, 0.0, 1.0, z_mm], [0.0, 0.0, 0.0, 1.0]]
    )


def touch_at(
    T_surface_sensor: ArrayLike, force_n: float, wrist: WristStiffness | None = None
) -> Touch:
    """Return the touch of a sensor that stands there, its tilts being those of the arm.

    Raises `PoseError` for no pose, or a sensor that does not face the surface.
    """
    T = np.asarray(T_surface_sensor, np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise PoseError(f"a pose of shape {T.shape}", fix="give T_surface_sensor (4, 4), mm")
    if T[2, 2] < 0.5:
        angle = math.degrees(math.acos(max(-1.0, min(1.0, T[2, 2]))))
        raise PoseError(
            f"the sensor is tilted by {angle:.0f} degrees, it must face the surface within 60",
            fix="take the surface frame of the face that is touched, z outward",
        )
    return Touch(
        x_mm=float(T[0, 3]),
        y_mm=float(T[1, 3]),
        theta_rad=math.atan2(-T[0, 1], T[1, 1]),
        force_n=force_n,
        tilt_x_rad=math.asin(max(-1.0, min(1.0, T[2, 1]))),
        tilt_y_rad=math.atan2(-T[2, 0], T[2, 2]),
        wrist=wrist or WristStiffness(),
    )
