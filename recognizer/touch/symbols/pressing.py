"""How hard a tilted plate presses symbols and the bare face: depth -> force, and back.

The plate stands at a depth u(x, y) = u0 + ux x + uy y below the tops of the symbols, a plane
over the sensor, in heights of the overlay. A tactel on a symbol gets scale F(u), one over the
bare face scale F(u - h), h the height of the symbols; the shape F is the overlay's: a
neo-Hookean tab's (1 - u)^-2 - (1 - u), or a pad's, which stays linear. Thesis 3.3, 4.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.settings import DEFAULTS, GainSettings

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pressing:
    """The law of an overlay over symbols of one height."""

    hardens: bool  #: a tab does, a pad is taken as linear
    symbol: float  #: height of the symbols over that of the overlay
    deepest: float  #: heights of the overlay; beyond it F goes on straight
    scale: float  #: N, of a tactel on a plateau, where readings are newtons

    def force(self, depth: Array) -> Array:
        """Return F (0 without contact) at depths in heights of the overlay."""
        above = np.maximum(depth, 0.0)
        if not self.hardens:
            return np.asarray(3.0 * above)
        rest = 1 - np.minimum(above, self.deepest)
        beyond = np.maximum(depth - self.deepest, 0.0) * _stiffness(self.deepest)
        return np.asarray(rest**-2 - rest + beyond)

    def slope(self, depth: Array) -> Array:
        """Return dF/du, 0 without contact."""
        if not self.hardens:
            return np.where(depth > 0, 3.0, 0.0)
        return np.where(depth > 0, _stiffness(np.clip(depth, 0.0, self.deepest)), 0.0)

    def depth(self, force: Array) -> Array:
        """Return the depths at which F has given values, at most `deepest`."""
        if not self.hardens:
            return np.asarray(force / 3.0)
        return np.asarray(np.interp(force, *_forces_by_depth(self)))


def pressing_of(
    sensor: SensorType, height_mm: float, settings: GainSettings = DEFAULTS.gain
) -> Pressing:
    """Return how a sensor's overlay presses symbols of a height."""
    overlay = sensor.overlay
    if overlay.kind == "tab":
        area = math.pi * overlay.tab_diameter_mm**2 / 4
    else:
        area = sensor.pitch_mm**2
    return Pressing(
        hardens=overlay.kind == "tab",
        symbol=height_mm / overlay.height_mm,
        deepest=settings.deepest,
        scale=overlay.young_mpa / 3.0 * area,
    )


@lru_cache(maxsize=16)
def _forces_by_depth(pressing: Pressing) -> tuple[Array, Array]:
    """Return rising forces and the depths at which they are."""
    table = np.linspace(0.0, pressing.deepest, 257)
    return pressing.force(table), table


def _stiffness(depth: Array | float) -> Array:
    return np.asarray(2.0 * (1.0 - depth) ** -3 + 1.0)
