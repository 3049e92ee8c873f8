"""What a gel of a level shows of a touch: imprint, lighting, camera, blemishes.

Of a level count its print (width, scale; in the surface already), `gain` (the depth that is
made of a shade is off by a share that changes slowly over the gel, half of the spread of
tactels), `exponent` (its law), `dead` (blemishes), `cross_talk` (blur, pixels), `noise_n` (over
that of `typical`, times the type's noise) and the wrist. It has no tips, no film and no rows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Contact, Touch
from probe.contact.gel import depths_mm, gel
from probe.simulate.world.levels import TYPICAL, Level
from probe.simulate.world.mounting import mount
from probe.simulate.world.sensor_copy import SensorCopy
from probe.surface.contract import HeightMap

SHADE_PIXELS = 6.0  #: way over which the error of lighting changes


def read_gel(
    surface: HeightMap,
    sensor: SensorType,
    touch: Touch,
    level: Level,
    rng: np.random.Generator,
    copy: SensorCopy,
) -> tuple[NDArray[np.uint16], Contact]:
    """Return the counts (rows, columns) of a gel's depth map, and the contact.

    Raises
    ------
    ContactError
        The touch has no equilibrium.
    """
    from scipy.ndimage import gaussian_filter

    contact = gel(surface, sensor, touch)
    depth = depths_mm(sensor, contact.forces_n)
    if level.cross_talk > 0:
        depth = gaussian_filter(depth, level.cross_talk, mode="nearest")
    shade = gaussian_filter(copy.gains, SHADE_PIXELS, mode="reflect")
    shade = shade / max(float(shade.std()), 1e-12)
    top = max(float(depth.max()), 1e-12)
    seen = top * (depth / top) ** (level.exponent * sensor.exponent)
    counts = seen * np.exp(level.gain / 2 * shade) / sensor.unit
    noise = sensor.noise * level.noise_n / TYPICAL.noise_n
    counts = counts + noise * rng.standard_normal(sensor.shape)
    counts[copy.dead(level) | ~sensor.present()] = 0.0
    counts = np.clip(np.rint(counts), 0, sensor.full)
    return mount(counts.astype(np.uint16), level.mounting), contact
