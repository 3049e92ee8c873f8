"""Sample points on the tips of the overlay. Thesis 4.2.

SensorType + `Tips` -> points (rows * columns, q, 2) in the sensor frame and the depth of each
below the highest place of its tip. A round tip carries rings of points of equal share (7, 19,
37, 61 ...), turned from tab to tab by the golden angle, so that what they miss at an edge does
not add up along a stroke; a pad's tactel carries a square pattern (4, 9, 16 ... points).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.errors import ContactError

Array = NDArray[np.float64]

NUMBERS = tuple(3 * k * (k + 1) + 1 for k in range(1, 17))  #: 7, 19, 37, 61, 91 ... 817
_GOLDEN_RAD = math.pi * (3 - math.sqrt(5))


@dataclass(frozen=True, slots=True, eq=False)
class Tips:
    """Sampling and defects of the tips."""

    points: int = 19  #: on each tip, one of `NUMBERS`
    dome_mm: float = 0.0  #: how far the rim of a round tip lies below its middle
    lengths_mm: Array | None = None  #: (rows, columns) how much longer each tab is than drawn
    shifts_mm: Array | None = None  #: (rows, columns, 2) how far each stands off its place


def tip_points(sensor: SensorType, tips: Tips) -> tuple[Array, Array]:
    """Return the sample points (rows * columns, q, 2) of the tips, row by row, and their depths.

    The depths (rows * columns, q) mm lie below the plane of the undeformed tips, z away from the
    object: negative for a tab that is longer than drawn.

    Raises `ContactError` when the number of points is none of the patterns', or a shape is wrong.
    """
    points, drop = _draw_tips(sensor, tips.points, tips.dome_mm)
    shape = sensor.shape
    if tips.shifts_mm is not None:
        shifts = _require_shape(tips.shifts_mm, (*shape, 2), "shifts")
        points = points + shifts.reshape(-1, 1, 2)
    if tips.lengths_mm is not None:
        drop = drop - _require_shape(tips.lengths_mm, shape, "lengths").reshape(-1, 1)
    return points, drop


@lru_cache(maxsize=16)
def _draw_tips(sensor: SensorType, number: int, dome_mm: float) -> tuple[Array, Array]:
    """Return points and drops of tips without defects."""
    tabs = sensor.rows * sensor.columns
    if sensor.overlay.kind == "tab":
        unit = rings(number)
        angle = _GOLDEN_RAD * np.arange(tabs)
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        turned = np.stack([c * unit[:, 0] - s * unit[:, 1], s * unit[:, 0] + c * unit[:, 1]], -1)
        offsets = turned * (sensor.overlay.tab_diameter_mm / 2)
        depth = dome_mm * np.einsum("qi,qi->q", unit, unit)
    else:
        unit = square(number)
        offsets = np.broadcast_to(unit * sensor.pitch_mm, (tabs, len(unit), 2))
        depth = np.zeros(len(unit))
    points = sensor.centres_mm().reshape(tabs, 1, 2) + offsets
    drop = np.tile(depth, (tabs, 1))
    for array in (points, drop):
        array.setflags(write=False)
    return points, drop


def rings(n: int) -> Array:
    """Return n points (n, 2) of equal share on the unit disc: 1, 6, 12 ... on rings.

    Each ring lies at the root mean square radius of its share of the disc.
    """
    if n not in NUMBERS:
        raise ContactError(
            f"{n} points on a round tip; patterns have {', '.join(map(str, NUMBERS))}",
            fix="take 19, or 37 for finer edges",
        )
    ring = np.repeat(np.arange(17), [1, *range(6, 97, 6)])[:n]
    inside = np.where(ring > 0, 3 * ring * (ring - 1) + 1, 0)
    within = 3 * ring * (ring + 1) + 1
    radius = np.sqrt((inside + within) / (2 * n)) * (ring > 0)
    turn = (np.arange(n) - inside + ring % 2 / 2) / np.maximum(6 * ring, 1)
    angle = 2 * math.pi * turn
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def square(n: int) -> Array:
    """Return about n points (k k, 2) at the middles of equal squares of the unit square."""
    k = max(1, round(math.sqrt(n)))
    middle = (np.arange(k) + 0.5) / k - 0.5
    return np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)


def _require_shape(values: Array, shape: tuple[int, ...], name: str) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise ContactError(
            f"the tips' {name} have shape {array.shape}, finite numbers of {shape} are needed",
            fix="give one per tab, rows from the top",
        )
    return array
