"""What a face promises: the share of its touches that a sensor's reader would answer.

Outline + symbols of a face (mm, cells) + sensor -> symbols seen whole, loaded share and rivals at
many poses; with a table of measured answers -> the share of touches that are answered.

A pose is a place of the sensor's centre on the face, and a turn. They are spread evenly, the
same every time (an additive recurrence). Seen whole as in `generator.array.visible`. The loaded
share is exact: the sensor's rectangle cut by the outline, holes and all. Thesis 6.3.

M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018), for the recurrence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.array.contract import SymbolArray
from generator.layout.footprint import Points
from generator.layout.placement import FaceLayout
from generator.layout.places import Cells, windows_in

_STEPS = 1.2207440846057596 ** -np.arange(1.0, 4.0)  # of x, y and turn: 1.22^4 = 1.22 + 1


@dataclass(frozen=True, slots=True)
class PromiseSettings:
    """How finely a face is looked at."""

    poses: int = 1000
    """On each face: shares within .008 of those of 40,000 on faces of 28 to 60 mm (pitch 7 and
    4.5 mm); 6 to 10 ms a face."""


PROMISE = PromiseSettings()


@dataclass(frozen=True, slots=True)
class SensorView:
    """What of a face a sensor can see whole."""

    half_mm: tuple[float, float]  #: half width and half height of the sensor's rectangle
    symbol_half_mm: float  #: from a symbol's centre to the end of its strokes


class SeenRanks:
    """Ranks of sets of cells of one array, each found once, for all faces that stand on it."""

    def __init__(self, array: SymbolArray) -> None:
        self.array = array
        self._known: dict[bytes, int] = {}

    def rank(self, rows: Cells, columns: Cells) -> int:
        """Return the rank of cells (n,); only their differences matter."""
        if not len(rows):
            return 0
        key = np.stack([rows - rows.min(), columns - columns.min()]).tobytes()
        if key not in self._known:
            self._known[key] = self.array.rank(rows, columns)
        return self._known[key]


@dataclass(frozen=True, slots=True)
class FaceViews:
    """A face as a sensor meets it, pose by pose; the sensor's centre is on the face."""

    centre_mm: Points  #: (P, 2) of the sensor, face frame
    turn_rad: Points  #: (P,) of the sensor against the face
    seen: NDArray[np.int64]  #: (P,) symbols seen whole
    loaded: Points  #: (P,) share of the sensor's rectangle that lies on the face
    rivals: Points  #: (P,) places of a full array that show the same in these cells; 0: none


@dataclass(frozen=True, slots=True)
class AnswerTable:
    """How often a reader answers, measured: symbols seen whole x loaded share -> probability.

    Between its entries it is linear, beyond them constant.
    """

    seen: tuple[float, ...]  #: rising
    loaded: tuple[float, ...]  #: rising
    probability: Points  #: (seen, loaded)

    def at(self, seen: NDArray[np.int64], loaded: Points) -> Points:
        """Return the probability of an answer at each pose, (P,)."""
        rows = np.stack([np.interp(loaded, self.loaded, row) for row in self.probability])
        place = np.interp(seen, self.seen, np.arange(len(self.seen)))
        low = place.astype(np.int64)
        high = np.minimum(low + 1, len(self.seen) - 1)
        pose = np.arange(len(place))
        return np.asarray(rows[low, pose] + (place - low) * (rows[high, pose] - rows[low, pose]))


def promised_share(views: FaceViews, table: AnswerTable, used: float) -> float:
    """Return the share of touches of a face that will be answered at once.

    Parameters
    ----------
    views
        Of the face.
    table
        Measured where no rival is registered.
    used
        Share of the array's cells that carry symbols, as if strewn at random: a pose with r
        rivals has none of them registered with probability exp(-r used).
    """
    alone = np.exp(-views.rivals * used)
    return float((table.at(views.seen, views.loaded) * alone).mean())


def face_views(
    loops: Sequence[Points],
    face: FaceLayout,
    pitch_mm: float,
    view: SensorView,
    ranks: SeenRanks,
    settings: PromiseSettings = PROMISE,
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
    ranks
        Of the array on which it stands.
    settings
        How many poses.
    """
    start, end = _edges(loops)
    centre, turn = _poses_on(start, end, settings.poses)
    return views_at(loops, face, pitch_mm, view, ranks, centre, turn)


def views_at(
    loops: Sequence[Points],
    face: FaceLayout,
    pitch_mm: float,
    view: SensorView,
    ranks: SeenRanks,
    centre_mm: Points,
    turn_rad: Points,
) -> FaceViews:
    """Return what a sensor meets at given poses of one face.

    Parameters
    ----------
    loops, face, pitch_mm, view, ranks
        As for `face_views`.
    centre_mm, turn_rad
        (P, 2) and (P,) of the sensor, face frame.
    """
    start, end = _edges(loops)
    c, s = np.cos(turn_rad)[:, None], np.sin(turn_rad)[:, None]
    across, up = _in_sensor(face.centres_mm, centre_mm, c, s)
    whole = (np.abs(across) <= view.half_mm[0] - view.symbol_half_mm) & (
        np.abs(up) <= view.half_mm[1] - view.symbol_half_mm
    )
    ax, ay = _in_sensor(start, centre_mm, c, s)
    bx, by = _in_sensor(end, centre_mm, c, s)
    area = _area_within(ax, ay, bx, by, *view.half_mm)
    loaded = area / (4 * view.half_mm[0] * view.half_mm[1])
    rows, columns = _cells_unwrapped(face, pitch_mm)
    array = ranks.array
    unknown = 1 - _rank_seen(whole, rows, columns, ranks) / array.full_rank
    rivals = (float(array.rows) * float(array.columns) + 1) ** unknown - 1
    return FaceViews(centre_mm, turn_rad, whole.sum(axis=1), loaded, rivals)


def _edges(loops: Sequence[Points]) -> tuple[Points, Points]:
    return np.concatenate(list(loops)), np.concatenate(
        [np.roll(loop, -1, axis=0) for loop in loops]
    )


def _poses_on(start: Points, end: Points, number: int) -> tuple[Points, Points]:
    """Return centres (P, 2) inside the outline and turns (P,), `number` of them."""
    low = start.min(axis=0)
    size = start.max(axis=0) - low
    area = float((start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]).sum()) / 2
    found = np.empty((0, 3))
    first, batch = 1, int(1.1 * number * float(size.prod()) / area) + 16
    while len(found) < number:
        fractions = (0.5 + np.arange(first, first + batch)[:, None] * _STEPS) % 1.0
        points = low + fractions[:, :2] * size
        x, y = points[:, :1], points[:, 1:]
        rising = (start[:, 1] <= y) != (end[:, 1] <= y)
        slope = (end[:, 0] - start[:, 0]) / np.where(
            start[:, 1] == end[:, 1], 1.0, end[:, 1] - start[:, 1]
        )
        crossed = rising & (x < start[:, 0] + slope * (y - start[:, 1]))
        inside = crossed.sum(axis=1) % 2 == 1
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


def _cells_unwrapped(face: FaceLayout, pitch_mm: float) -> tuple[Cells, Cells]:
    """Return rows and columns (n,) of a face's symbols as they lie in the plane, from 0 on."""
    place = face.placement
    c, s = np.cos(place.rotation_rad), np.sin(place.rotation_rad)
    x, y = face.centres_mm.T
    column = np.rint((c * x - s * y + place.x_mm) / pitch_mm - 0.5).astype(np.int64)
    row = np.rint(-(s * x + c * y + place.y_mm) / pitch_mm - 0.5).astype(np.int64)
    return row - row.min(initial=0), column - column.min(initial=0)


def _shows_window(
    whole: NDArray[np.bool_], rows: Cells, columns: Cells, window: tuple[int, int]
) -> NDArray[np.bool_]:
    """Return at which poses (P,) the array's window lies in the cells seen whole."""
    if not len(rows):
        return np.zeros(len(whole), dtype=bool)
    grid = np.zeros((np.ptp(rows) + 1, len(whole), np.ptp(columns) + 1, 1), dtype=bool)
    grid[rows - rows.min(), :, columns - columns.min(), 0] = whole.T
    return np.asarray(windows_in(grid, *window).any(axis=(0, 2, 3)))


def _rank_seen(
    whole: NDArray[np.bool_], rows: Cells, columns: Cells, ranks: SeenRanks
) -> NDArray[np.int64]:
    """Return the rank of the cells seen whole at each pose, (P,)."""
    found = np.full(len(whole), ranks.array.full_rank)
    for pose in np.flatnonzero(~_shows_window(whole, rows, columns, ranks.array.window)):
        found[pose] = ranks.rank(rows[whole[pose]], columns[whole[pose]])
    return found
