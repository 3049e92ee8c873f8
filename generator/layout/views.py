"""A face as a sensor meets it: what it sees whole, and how much of it is loaded, pose by pose.

Outline + symbols of a face (mm, cells) + sensor -> symbols seen whole, and the loaded
share, at many poses.

A pose is a place of the sensor's centre on the face, and a turn. They are spread evenly, the
same every time (an additive recurrence). Seen whole is a symbol whose centre lies at least the
symbol's half size inside the sensor's rectangle. The loaded share is exact: the sensor's rectangle
cut by the outline, holes and all. Thesis 6.3.

M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018), for the recurrence.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import USUAL_SENSOR, SensorType
from generator.layout.footprint import Points
from generator.layout.placement import FaceLayout
from generator.plane.polygon import points_inside, signed_area

_STRIPS = 64  # poses looked at together
_STEPS = 1.2207440846057596 ** -np.arange(1.0, 4.0)  # of x, y and turn: 1.22^4 = 1.22 + 1


AROUND_MM = 20.0  #: of the usual sensor: half its width and a step


@dataclass(frozen=True, slots=True)
class ViewSettings:
    """How finely a face is looked at."""

    poses: int = 1000
    """On each face: shares within .008 of those of 40,000 on faces of 28 to 60 mm (pitch 7 and
    4.5 mm); 6 to 10 ms a face."""


VIEWS = ViewSettings()


@dataclass(frozen=True, slots=True)
class SensorView:
    """What of a face a sensor can see whole."""

    half_mm: tuple[float, float]  #: half width and half height of the sensor's rectangle
    symbol_half_mm: float  #: from a symbol's centre to the end of its strokes
    around_mm: float = AROUND_MM  #: from its centre to what another touch beside may show


def sensor_view(sensor: SensorType, symbol_half_mm: float) -> SensorView:
    """Return what a sensor type can see; a larger one steps farther, too."""
    around = AROUND_MM * sensor.across_mm / USUAL_SENSOR.across_mm
    return SensorView(sensor.half_mm, symbol_half_mm, around)


@dataclass(frozen=True, slots=True)
class FaceViews:
    """A face as a sensor meets it, pose by pose; the sensor's centre is on the face."""

    centre_mm: Points  #: (P, 2) of the sensor, face frame
    turn_rad: Points  #: (P,) of the sensor against the face
    seen: NDArray[np.int64]  #: (P,) symbols seen whole
    lines: NDArray[np.int64]  #: (P,) rows or columns in which these stand, the fewer of both
    loaded: Points  #: (P,) share of the sensor's rectangle that lies on the face
    around: NDArray[np.int64]  #: (P,) symbols that stand within `SensorView.around_mm`


def face_views(
    loops: Sequence[Points],
    face: FaceLayout,
    pitch_mm: float,
    view: SensorView,
    settings: ViewSettings = VIEWS,
) -> FaceViews:
    """Return what a sensor meets on one face.

    Parameters
    ----------
    loops
        Outline of the face: the outer loop (k, 2) counter-clockwise, holes clockwise, mm.
    face, pitch_mm
        Its symbols.
    view
        The sensor.
    settings
        How many poses.
    """
    centre, turn = _poses_on(loops, settings.poses)
    return views_at(loops, face, pitch_mm, view, centre, turn)


def views_at(
    loops: Sequence[Points],
    face: FaceLayout,
    pitch_mm: float,
    view: SensorView,
    centre_mm: Points,
    turn_rad: Points,
) -> FaceViews:
    """Return what a sensor meets at given poses of one face.

    Parameters
    ----------
    loops, face, pitch_mm, view
        As for `face_views`.
    centre_mm, turn_rad
        (P, 2) and (P,) of the sensor, face frame.
    """
    start, end = _edges(loops)
    c, s = np.cos(turn_rad)[:, None], np.sin(turn_rad)[:, None]
    ax, ay = _in_sensor(start, centre_mm, c, s)
    bx, by = _in_sensor(end, centre_mm, c, s)
    area = _area_within(ax, ay, bx, by, *view.half_mm)
    loaded = area / (4 * view.half_mm[0] * view.half_mm[1])
    whole = _seen_whole(face, pitch_mm, view, centre_mm, turn_rad)
    rows, columns = whole.any(axis=2).sum(axis=1), whole.any(axis=1).sum(axis=1)
    lines, around = np.minimum(rows, columns), _around(face, centre_mm, view.around_mm)
    return FaceViews(centre_mm, turn_rad, whole.sum(axis=(1, 2)), lines, loaded, around)


def _around(face: FaceLayout, centre: Points, reach_mm: float) -> NDArray[np.int64]:
    """Return how many symbols stand within a distance of each pose, (P,).

    Symbols are sorted by x, so that each pose looks at its strip alone: as many as on a small face.
    """
    order = np.argsort(face.centres_mm[:, 0], kind="stable")
    x, y = face.centres_mm[order].T
    first, last = (np.searchsorted(x, centre[:, 0] + by) for by in (-reach_mm, reach_mm))
    found = np.zeros(len(centre), np.int64)
    for start in range(0, len(centre), _STRIPS):
        some = slice(start, start + _STRIPS)
        width = int((last[some] - first[some]).max(initial=0))
        at = first[some, None] + np.arange(width)
        within = at < last[some, None]
        at = np.where(within, at, 0)
        away = np.hypot(x[at] - centre[some, :1], y[at] - centre[some, 1:])
        found[some] = (within & (away <= reach_mm)).sum(axis=1)
    return found


def _edges(loops: Sequence[Points]) -> tuple[Points, Points]:
    return np.concatenate(list(loops)), np.concatenate(
        [np.roll(loop, -1, axis=0) for loop in loops]
    )


def _poses_on(loops: Sequence[Points], number: int) -> tuple[Points, Points]:
    """Return centres (P, 2) inside the outline and turns (P,), `number` of them."""
    corners = np.concatenate(list(loops))
    low = corners.min(axis=0)
    size = corners.max(axis=0) - low
    area = sum(signed_area(loop) for loop in loops)
    found = np.empty((0, 3))
    first, batch = 1, int(1.1 * number * float(size.prod()) / area) + 16
    while len(found) < number:
        fractions = (0.5 + np.arange(first, first + batch)[:, None] * _STEPS) % 1.0
        points = low + fractions[:, :2] * size
        inside = points_inside(points, loops)
        found = np.concatenate([found, np.c_[points, fractions[:, 2] * 2 * np.pi][inside]])
        first += batch
    return found[:number, :2], found[:number, 2]


def _in_sensor(points: Points, centre: Points, c: Points, s: Points) -> tuple[Points, Points]:
    """Return x and y, (P, n) each, of points (n, 2) in the frame of each pose."""
    x, y = points[:, 0] - centre[:, :1], points[:, 1] - centre[:, 1:]
    return c * x + s * y, c * y - s * x


def _area_within(
    ax: Points, ay: Points, bx: Points, by: Points, half_width: float, half_height: float
) -> Points:
    """Return the area (P,) of polygons inside a rectangle about the origin.

    Minus the sum over edges a b of the integral of clamp(y) dx, x clamped too (Green's theorem):
    what an edge does beside the rectangle adds up to nothing around a loop.
    """
    run = np.where(ax == bx, 1.0, bx - ax)
    ends = []
    for x in (ax, bx):
        part = (np.clip(x, -half_width, half_width) - ax) / run
        ends.append(ay + part * (by - ay))
    low, high = ends
    width = np.clip(bx, -half_width, half_width) - np.clip(ax, -half_width, half_width)
    rise = high - low
    flat = np.abs(rise) < 1e-9 * half_height
    mean = (_integral(high, half_height) - _integral(low, half_height)) / np.where(flat, 1.0, rise)
    mean = np.where(flat, np.clip(low, -half_height, half_height), mean)
    return np.asarray(-(width * mean).sum(axis=1))


def _integral(y: Points, half: float) -> Points:
    """Return the integral of clamp(t, -half, half) from 0 to y."""
    inside = np.clip(y, -half, half)
    return np.asarray(inside * inside / 2 + half * (np.abs(y) - np.abs(inside)))


def _seen_whole(
    face: FaceLayout, pitch: float, view: SensorView, centre: Points, turn: Points
) -> NDArray[np.bool_]:
    """Return which cells around each pose bear a symbol seen whole, (P, rows, columns).

    Only cells that the sensor can reach are looked at: as many on a large face as on a small one.
    """
    free = np.array(view.half_mm) - view.symbol_half_mm
    place = face.placement
    c, s = np.cos(place.rotation_rad), np.sin(place.rotation_rad)
    x, y = centre.T
    # Of the sensor's centre, cells from the anchor on: a cell's centre has whole numbers.
    column = (c * x - s * y + place.x_mm) / pitch - 0.5
    row = -(s * x + c * y + place.y_mm) / pitch - 0.5
    reach = math.floor(float(np.hypot(*np.maximum(free, 0.0))) / pitch + 0.5)
    steps = np.arange(-reach, reach + 1)
    rows, columns = (np.rint(at).astype(np.int64)[:, None] + steps for at in (row, column))
    along = ((columns - column[:, None]) * pitch)[:, None, :]
    down = ((rows - row[:, None]) * pitch)[:, :, None]
    c, s = (f(turn + place.rotation_rad)[:, None, None] for f in (np.cos, np.sin))
    bears, low = _bearing(face, pitch)
    i, j = rows - low[0], columns - low[1]
    there = [(n >= 0) & (n < size) for n, size in zip((i, j), bears.shape, strict=True)]
    i, j = np.where(there[0], i, 0), np.where(there[1], j, 0)
    shown = bears[i[:, :, None], j[:, None, :]] & there[0][:, :, None] & there[1][:, None, :]
    across, up = c * along - s * down, -s * along - c * down
    return np.asarray(shown & (np.abs(across) <= free[0]) & (np.abs(up) <= free[1]))


def _bearing(face: FaceLayout, pitch_mm: float) -> tuple[NDArray[np.bool_], tuple[int, int]]:
    """Return which cells of a face's box bear symbols, and its least row and column.

    Rows and columns count from the anchor, as they lie in the plane.
    """
    place = face.placement
    c, s = np.cos(place.rotation_rad), np.sin(place.rotation_rad)
    x, y = face.centres_mm.T
    column = np.rint((c * x - s * y + place.x_mm) / pitch_mm - 0.5).astype(np.int64)
    row = np.rint(-(s * x + c * y + place.y_mm) / pitch_mm - 0.5).astype(np.int64)
    low = int(row.min(initial=0)), int(column.min(initial=0))
    size = int(row.max(initial=0)) - low[0] + 1, int(column.max(initial=0)) - low[1] + 1
    bears = np.zeros(size, dtype=bool)
    bears[row - low[0], column - low[1]] = True
    return bears, low
