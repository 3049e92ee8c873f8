"""Where the tips of the overlay are asked for contact: a few points on each. Thesis 4.2.

Sensor + `Tips` -> points (rows * columns, q, 2) in the sensor frame and the depth of each
below the highest place of its tip. A round tip carries a hexagonal pattern (7, 19, 37 or 61
points of equal share) with the disc's own second moment, turned from tab to tab by the
golden angle, so that what it misses at an edge does not add up along a stroke; a pad's
tactel carries a square one (4, 9, 16 ... points).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from probe.errors import ContactError
from probe.sensor import Sensor

Array = NDArray[np.float64]

HEXAGONS = tuple(3 * k * (k + 1) + 1 for k in range(1, 17))  #: 7, 19, 37, 61, 91 ... 817
_GOLDEN_RAD = math.pi * (3 - math.sqrt(5))


@dataclass(frozen=True, slots=True, eq=False)
class Tips:
    """What is known of the tips beyond the sensor's drawing, and how finely they are asked."""

    points: int = 19  #: on each tip, one of `HEXAGONS`
    dome_mm: float = 0.0  #: how far the rim of a round tip lies below its middle
    lengths_mm: Array | None = None  #: (rows, columns) how much longer each tab is than drawn
    shifts_mm: Array | None = None  #: (rows, columns, 2) how far each stands off its place


def tip_points(sensor: Sensor, tips: Tips) -> tuple[Array, Array]:
    """Return where the tips are asked, and how deep these places lie.

    Parameters
    ----------
    sensor
        Its overlay tells round tips of tabs from the squares of a pad.
    tips
        Number of points, dome and defects.

    Returns
    -------
    points_mm
        (rows * columns, q, 2), sensor frame, row by row.
    drop_mm
        (rows * columns, q) depth below the plane of the undeformed tips, z away from the
        object: negative for a tab that is longer than drawn.

    Raises
    ------
    ContactError
        When the number of points is none of the patterns', or a shape is wrong.
    """
    points, drop = _drawn(sensor, tips.points, tips.dome_mm)
    shape = (sensor.rows, sensor.columns)
    if tips.shifts_mm is not None:
        shifts = _shaped(tips.shifts_mm, (*shape, 2), "shifts")
        points = points + shifts.reshape(-1, 1, 2)
    if tips.lengths_mm is not None:
        drop = drop - _shaped(tips.lengths_mm, shape, "lengths").reshape(-1, 1)
    return points, drop


@lru_cache(maxsize=16)
def _drawn(sensor: Sensor, number: int, dome_mm: float) -> tuple[Array, Array]:
    """Return points and drops of tips without defects."""
    tabs = sensor.rows * sensor.columns
    if sensor.overlay.kind == "tab":
        unit = hexagon(number)
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


def hexagon(n: int) -> Array:
    """Return n points (n, 2) of equal share on the unit disc, second moment 1/2 like the disc's."""
    if n not in HEXAGONS:
        raise ContactError(
            f"{n} points on a round tip; patterns have {', '.join(map(str, HEXAGONS))}",
            fix="take 19, or 37 for finer edges",
        )
    ring = HEXAGONS.index(n) + 1
    i, j = np.mgrid[-ring : ring + 1, -ring : ring + 1]
    inside = np.abs(i + j) <= ring
    i, j = i[inside], j[inside]
    points = np.stack([i + j / 2, j * (math.sqrt(3) / 2)], axis=1)
    moment = np.einsum("ni,ni->", points, points) / n
    return np.asarray(points / math.sqrt(2 * moment))


def square(n: int) -> Array:
    """Return about n points (k k, 2) at the middles of equal squares of the unit square."""
    k = max(1, round(math.sqrt(n)))
    middle = (np.arange(k) + 0.5) / k - 0.5
    return np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)


def _shaped(values: Array, shape: tuple[int, ...], name: str) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise ContactError(
            f"the tips' {name} have shape {array.shape}, finite numbers of {shape} are needed",
            fix="give one per tab, rows from the top",
        )
    return array
