"""Polygon of a face -> places to press, left to right and top to bottom. Thesis 4.3, figure 4.11.

Neighbours overlap by three quarters of the sensor. The step is 4.25 tactels, not 4: steps of
whole tactels see every edge at the same place between two tactels. Places stand on a lattice that
may be turned; it is as wide as the face, so that its outer touches reach the face's edge or a
little beyond. mm, surface frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.errors import SurfaceError
from probe.surface.polygon import polygon, signed_area

STEP_TACTELS = 4.25  #: between neighbours, which then share three quarters


@dataclass(frozen=True, slots=True)
class RasterPlan:
    """Where to press."""

    places_mm: NDArray[np.float64]  #: (n, 2) of the sensor's centre, in the order of scanning
    cover: NDArray[np.float64]  #: (n,) share of the sensor that lies over the face
    lines: NDArray[np.int64]  #: (n,) number of the line, from the top
    theta_rad: float  #: the sensor's x axis from the surface's

    def __len__(self) -> int:
        return len(self.places_mm)

    def there_and_back(self, least_cover: float = 0.0) -> NDArray[np.float64]:
        """Return the places (n, 2) line by line, every other line back.

        Those that cover less than `least_cover` of what the best one covers are left out.
        """
        kept = self.cover >= least_cover * self.cover.max(initial=0.0)
        lines = [self.places_mm[kept & (self.lines == line)] for line in np.unique(self.lines)]
        return np.concatenate([line[:: (-1) ** n] for n, line in enumerate(lines)])


def raster(
    loops: Sequence[ArrayLike],
    sensor: SensorType | None = None,
    *,
    step_tactels: float = STEP_TACTELS,
    theta_rad: float = 0.0,
    least_cover: float = 0.1,
) -> RasterPlan:
    """Lay a raster of touches over a face.

    Parameters
    ----------
    loops
        (n, 2) corners of the face, and of its holes after it, mm, either way round.
    step_tactels
        Between neighbours, both ways.
    theta_rad
        The sensor's x axis, and the lines of the raster, from the surface's x axis.
    least_cover
        Places with a smaller share of the sensor over the face are left out.

    Raises
    ------
    SurfaceError
        A loop that is no polygon, or a step that is none.
    """
    sensor = sensor or SensorType()
    if not (0 < step_tactels <= min(sensor.rows, sensor.columns)):
        raise SurfaceError(
            f"a step of {step_tactels:g} tactels",
            fix=f"take more than 0 and at most {min(sensor.rows, sensor.columns)}",
        )
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    turn = np.array([[c, -s], [s, c]])  # from the raster's axes to the surface's
    polygons = [loop @ turn for loop in polygon(loops).loops()]
    half = np.array(sensor.half_mm)
    low, high = polygons[0].min(axis=0), polygons[0].max(axis=0)
    xs, ys = (
        _positions(low[i], high[i], half[i], step_tactels * sensor.step_mm[i]) for i in (0, 1)
    )
    places, cover, lines = [], [], []
    for line, y in enumerate(ys[::-1]):
        strips = [_clip_polygon(p, 1, y - half[1], y + half[1]) for p in polygons]
        for x in xs:
            areas = [
                abs(signed_area(_clip_polygon(p, 0, x - half[0], x + half[0]))) for p in strips
            ]
            share = (areas[0] - sum(areas[1:])) / float(4 * half[0] * half[1])
            if share > 0 and share >= least_cover:
                places.append((x, y))
                cover.append(share)
                lines.append(line)
    if not places:
        raise SurfaceError(
            f"no place covers {least_cover:.0%} of the sensor",
            fix="take a larger face, or a smaller share",
        )
    return RasterPlan(
        np.array(places).reshape(-1, 2) @ turn.T, np.array(cover), np.array(lines, int), theta_rad
    )


def _positions(low: float, high: float, half: float, step: float) -> NDArray[np.float64]:
    """Return centres, a step apart, about the middle, that together reach from low to high."""
    rest = max(0.0, high - low - 2 * half)
    count = math.ceil(rest / step - 1e-9) + 1
    numbers = np.arange(count, dtype=np.float64) - (count - 1) / 2
    return (low + high) / 2 + numbers * step


def _clip_polygon(
    polygon: NDArray[np.float64], axis: int, low: float, high: float
) -> NDArray[np.float64]:
    """Cut a polygon to low ... high of one coordinate (Sutherland and Hodgman).

    What falls apart stays joined along the cut, which has no area.
    """
    for bound, sign in ((low, 1.0), (high, -1.0)):
        if not len(polygon):
            break
        inside = sign * (polygon[:, axis] - bound)
        following, beyond = np.roll(polygon, -1, axis=0), np.roll(inside, -1)
        kept = []
        for a, b, u, v in zip(polygon, following, inside, beyond, strict=True):
            if u >= 0:
                kept.append(a)
            if (u < 0) != (v < 0):
                cut = a + (b - a) * (u / (u - v))
                cut[axis] = bound
                kept.append(cut)
        polygon = np.array(kept, np.float64).reshape(-1, 2)
    return polygon
