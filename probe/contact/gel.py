"""Level "gel": a soft layer behind a membrane, pressed by a rigid plate on the wrist.

Surface + sensor + touch -> force of the gel at each pixel: depth of the imprint times E / height
times pixel^2. The gel is a bed of springs, E / height, on which the plate comes to rest (`plate`).
A membrane bridges around what is pressed in: the imprint is the least w >= d, d the depth of the
surface under the plate, with w - l^2 laplace(w) = 0 where w > d, an obstacle problem (l the
membrane's way), solved by projection on a grid finer than the pixels. Optics and matching blur it;
a pixel sees its mean. What the membrane carries is left out of the rest. mm, N.

References: R. Glowinski, "Numerical methods for nonlinear variational problems", 1984, ch. II.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType, usual_force_n
from probe.contact.contract import STEEPEST_RAD, Contact, Touch, heights_under, no_contact
from probe.contact.layer_patch import centres_mm
from probe.contact.neo_hooke import Linear
from probe.contact.plate import check_load, rest
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]

FINE = 4  # places along a pixel at which the surface is sampled
TOLERANCE = 1e-4  # of the deepest place: by which the membrane may still move
MOST_STEPS = 2000  # of the membrane; each takes off 1 / (1 + 4 way^2) of its error


def gel(surface: HeightMap, sensor: SensorType, touch: Touch) -> Contact:
    """Press a gel on a surface. No force gives an exactly zero image.

    Raises `ContactError` for another overlay, nothing under the sensor, a plate that tips, a gel
    pressed through.
    """
    if sensor.overlay.kind != "gel":
        raise ContactError(
            f"a {sensor.overlay.kind} overlay is no gel", fix="take the levels of that overlay"
        )
    check_load(touch)
    if touch.force_n == 0:
        return no_contact(sensor, touch, "gel")
    step = sensor.pitch_mm / FINE
    fine = sensor.rows * FINE, sensor.columns * FINE
    points = centres_mm(*fine, step).reshape(*fine, 2)
    heights = heights_under(surface, touch, points)
    law = Linear(_bed_n_mm3(sensor) * step**2)
    found = rest(points.reshape(-1, 2), heights.ravel(), law, touch)
    tilt = max(abs(found.pose.tilt_x_rad), abs(found.pose.tilt_y_rad))
    depth = heights - found.pose.heights_mm(points)
    if tilt > STEEPEST_RAD or depth.max() > sensor.overlay.height_mm:
        raise ContactError(
            f"the plate tips or presses the gel through: {math.degrees(tilt):.3g} degrees, "
            f"{depth.max():.3g} mm of {sensor.overlay.height_mm:g} mm",
            fix=f"press with {usual_force_n(sensor):.2g} N or less, or nearer to the face's middle",
        )
    imprint, iterations = bridge(np.maximum(depth, 0.0), sensor.overlay.membrane_mm / step)
    pixels = blur(imprint, sensor.overlay.blur_mm / step)
    pixels = pixels.reshape(sensor.rows, FINE, sensor.columns, FINE).mean(axis=(1, 3))
    return Contact(
        pixels * (_bed_n_mm3(sensor) * sensor.pitch_mm**2),
        found.pose.z_mm,
        found.pose.tilt_x_rad,
        found.pose.tilt_y_rad,
        "gel",
        found.iterations + iterations,
    )


def depths_mm(sensor: SensorType, forces_n: Array) -> Array:
    """Return the depth of the imprint (rows, columns) behind the forces of a gel's pixels."""
    depth: Array = forces_n / (_bed_n_mm3(sensor) * sensor.pitch_mm**2)
    return depth


def bridge(depth_mm: Array, way: float) -> tuple[Array, int]:
    """Return the least imprint over a depth (n, m) that a membrane can follow, and the iterations.

    `way` is the length over which the membrane bridges, steps of the grid.
    """
    if way == 0:
        return depth_mm, 0
    pull = way * way
    padded = np.pad(depth_mm, 1)
    inside = padded[1:-1, 1:-1]
    tolerance = TOLERANCE * float(depth_mm.max())
    number = 0
    while number < MOST_STEPS:
        number += 1
        around = padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:]
        after = np.maximum(depth_mm, around * (pull / (1 + 4 * pull)))
        change = float(np.abs(after - inside).max())
        inside[:] = after
        if change <= tolerance:
            break
    return inside.copy(), number


def blur(values: Array, deviation: float) -> Array:
    """Return an image (rows, columns) under a bell of a deviation in its steps."""
    if deviation == 0:
        return values
    from scipy.ndimage import gaussian_filter

    return np.asarray(gaussian_filter(values, deviation, mode="nearest"))


def _bed_n_mm3(sensor: SensorType) -> float:
    """Return the stiffness of the bed of springs, N / mm^3."""
    return sensor.overlay.young_mpa / sensor.overlay.height_mm
