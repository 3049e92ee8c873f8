"""Heights of a surface under points of the sensor; what is no height is refused.

A surface gives a finite height, or -inf where there is no matter; mm, sensor frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]


def heights_at(surface: HeightMap, touch: Touch, points_mm: Array) -> Array:
    """Return heights (...), mm, at points (..., 2) of the sensor frame.

    Raises
    ------
    ContactError
        For heights that are no numbers, or +inf.
    """
    asked = touch.on_surface(points_mm.reshape(-1, 2))
    heights = np.asarray(surface.heights_mm(asked), np.float64)
    if heights.shape != (len(asked),) or not heights.max(initial=-np.inf) < np.inf:  # NaN, too
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
