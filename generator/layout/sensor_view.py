"""What a sensor meets at many poses on a face: symbols seen whole, load, other faces in its way.

Outline + symbols of a face (mm, cells) + sensor -> `FaceViews`. A pose is a place of the sensor's
centre on the face, and a turn. They are spread evenly, the same every time (an additive
recurrence). Seen whole is a symbol whose centre lies at least the symbol's half size inside the
sensor's rectangle. The loaded share is exact: the rectangle cut by the outline, holes and all. On a
round face a plate rests along a line, and symbols count down to `SAG_MM` under it. Thesis 6.3.

M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018), for the recurrence.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import USUAL_SENSOR, SensorType
from generator.alphabet.known import Alphabet
from generator.alphabet.outline import SymbolStyle
from generator.layout.footprint import Points
from generator.layout.obstacle import Box, SolidEdges
from generator.layout.placement import FaceLayout
from generator.plane.polygon import points_inside, segments, signed_area
from generator.polyhedron.development import Development
from generator.polyhedron.winged import Developable

POSES = 1000
"""On each face: shares within .008 of those of 40,000 on faces of 28 to 60 mm (pitch 7 and 4.5
mm); 6 to 10 ms a face."""
AROUND_MM = 20.0  #: of the usual sensor: half its width and a step
MEETS_MM2 = 1.0  #: of another face inside the sensor's rectangle: less than a tactel
SAG_MM = 0.3
"""Under the line along which a plate touches a round face, down to which symbols are seen: .25 to
.3 mm makes 600 touches of cans of 26 to 100 mm and cones the likeliest."""
_STRIPS = 64  # poses looked at together
_PAIRS = 1 << 18  # of poses and edges looked at together
_STEPS = 1.2207440846057596 ** -np.arange(1.0, 4.0)  # of x, y and turn: 1.22^4 = 1.22 + 1

Loops = Sequence[Points]  #: outline of a face: outer loop (k, 2) counter-clockwise, then holes, mm


@dataclass(frozen=True, slots=True)
class SensorView:
    """What of a face a sensor can see whole."""

    half_mm: tuple[float, float]  #: half width and half height of the sensor's rectangle
    symbol_half_mm: float  #: from a symbol's centre to the end of its strokes
    around_mm: float = AROUND_MM  #: from its centre to what a next touch may show


@dataclass(frozen=True, slots=True)
class FaceViews:
    """A face as a sensor meets it, pose by pose; the sensor's centre is on the face."""

    centre_mm: Points  #: (P, 2) of the sensor, face frame
    turn_rad: Points  #: (P,) of the sensor against the face
    seen: NDArray[np.int64]  #: (P,) symbols seen whole
    lines: NDArray[np.int64]  #: (P,) rows or columns in which these stand, the fewer of both
    loaded: Points  #: (P,) share of the sensor's rectangle that lies on the face
    around: NDArray[np.int64]  #: (P,) symbols that stand within `SensorView.around_mm`
    blocked: NDArray[np.bool_]  #: (P,) whether the sensor meets another face
    meets: tuple[str, ...] = ()  #: which, the one most often met first
    round: bool = False  #: whether the face is: it answers the `ROUND` share of a flat one


@dataclass(frozen=True, slots=True)
class Band:
    """What a plate feels of a round face: a band through the sensor's centre at each pose."""

    along_rad: Points  #: (P,) direction, face frame
    half_mm: Points  #: (P,) half its width


def symbol_half_mm(alphabet: Alphabet, style: SymbolStyle) -> float:
    """Return the distance from a symbol's centre to the end of its strokes."""
    return alphabet.reach * style.pitch_mm + style.stroke_mm / 2


def sensor_view(sensor: SensorType, symbol_half_mm: float) -> SensorView:
    """Return what a sensor type can see; a larger one steps farther, too."""
    around = AROUND_MM * sensor.across_mm / USUAL_SENSOR.across_mm
    return SensorView(sensor.half_mm, symbol_half_mm, around)


def face_views(
    loops: Loops,
    face: FaceLayout,
    pitch_mm: float,
    view: SensorView,
    poses: int = POSES,
) -> FaceViews:
    """Return what a sensor meets on one face, its outline given as loops (k, 2) mm."""
    centre, turn = _poses_on(loops, poses)
    return views_at(loops, face, pitch_mm, view, centre, turn)


def views_at(
    loops: Loops,
    face: FaceLayout,
    pitch_mm: float,
    view: SensorView,
    centre_mm: Points,
    turn_rad: Points,
    band: Band | None = None,
) -> FaceViews:
    """Return what a sensor meets at poses (P, 2) mm and (P,) rad of one face, face frame.

    `band`: within which it sees symbols of a round face.
    """
    start, end, *_ = segments(loops)
    loaded = _covered(start, end, centre_mm, turn_rad, view)
    whole = _seen_whole(face, pitch_mm, view, centre_mm, turn_rad, band)
    rows, columns = whole.any(axis=2).sum(axis=1), whole.any(axis=1).sum(axis=1)
    lines, around = np.minimum(rows, columns), _around(face, centre_mm, view.around_mm)
    seen, blocked = whole.sum(axis=(1, 2)), np.zeros(len(turn_rad), np.bool_)
    return FaceViews(centre_mm, turn_rad, seen, lines, loaded, around, blocked)


def round_views(
    solid: SolidEdges,
    surface: Developable,
    flat: Development,
    face: FaceLayout,
    style: SymbolStyle,
    view: SensorView,
    poses: int = POSES,
) -> FaceViews:
    """Return what a sensor meets on a round face; places are those of the plane it unrolls to."""
    centre, turn = _poses_on((flat.outline,), poses)
    band = felt_band(surface, flat, centre)
    views = views_at((flat.outline,), face, style.pitch_mm, view, centre, turn, band)
    met: Counter[str] = Counter()
    facets = flat.facets_of(centre)
    for facet in np.unique(facets):
        if solid.rise_mm(flat.T_object_flat[facet]) > style.height_mm:
            some = np.flatnonzero(facets == facet)
            views.blocked[some], names = _obstacles(
                solid, flat.T_object_flat[facet], style.height_mm, centre[some], turn[some], view
            )
            met += names
    return replace(views, meets=tuple(name for name, _ in met.most_common()), round=True)


def felt_band(surface: Developable, flat: Development, centre_mm: Points) -> Band:
    """Return what a plate feels at places (P, 2) of the plane to which a round face unrolls."""
    facet = flat.facets_of(centre_mm)
    wide = [np.hypot(*np.diff(ends, axis=0).T)[facet] for ends in (flat.low, flat.high)]
    low, high = ((ends[:-1] + ends[1:])[facet] / 2 for ends in (flat.low, flat.high))
    up = high - low
    share = ((centre_mm - low) * up).sum(axis=1) / (up**2).sum(axis=1)
    there = (wide[0] + share * (wide[1] - wide[0])) / np.maximum(*wide)
    radius = np.maximum(surface.radius_mm / math.cos(surface.half_angle_rad) * there, SAG_MM)
    return Band(np.arctan2(up[:, 1], up[:, 0]), radius * np.arccos(1 - SAG_MM / radius))


def beside_obstacles(
    views: FaceViews, solid: SolidEdges, T_object_face: Points, height_mm: float, view: SensorView
) -> FaceViews:
    """Return views of a flat face with what the sensor meets that rises higher than this."""
    if solid.rise_mm(T_object_face) <= height_mm:
        return views
    centre, turn = views.centre_mm, views.turn_rad
    blocked, names = _obstacles(solid, T_object_face, height_mm, centre, turn, view)
    return replace(views, blocked=blocked, meets=tuple(name for name, _ in names.most_common()))


def _obstacles(
    solid: SolidEdges, frame: Points, height_mm: float, centre: Points, turn: Points,
    view: SensorView,
) -> tuple[NDArray[np.bool_], Counter[str]]:  # fmt: skip
    """Return whether the sensor meets another face at each pose, and how often which."""
    area, box = 4 * view.half_mm[0] * view.half_mm[1], _box(centre, view)
    start, end, _ = solid.above(frame, height_mm, box)
    blocked = area * _covered(start, end, centre, turn, view) > MEETS_MM2
    return blocked, solid.nearest(frame, height_mm, box, centre[blocked])


def _box(centre: Points, view: SensorView) -> Box:
    """Return lowest and highest x and y that sensors at these places reach."""
    reach = math.hypot(*view.half_mm)
    return centre.min(axis=0) - reach, centre.max(axis=0) + reach


def _covered(start: Points, end: Points, centre: Points, turn: Points, view: SensorView) -> Points:
    """Return the share of the sensor's rectangle inside outlines of edges (n, 2), (P,)."""
    area, step = np.zeros(len(turn)), max(1, _PAIRS // max(1, len(start)))
    for first in range(0, len(turn), step):
        some = slice(first, first + step)
        c, s = np.cos(turn[some])[:, None], np.sin(turn[some])[:, None]
        ends = (_in_sensor(points, centre[some], c, s) for points in (start, end))
        area[some] = _area_within(*next(ends), *next(ends), *view.half_mm)
    return area / (4 * view.half_mm[0] * view.half_mm[1])


def _around(face: FaceLayout, centre: Points, reach_mm: float) -> NDArray[np.int64]:
    """Return how many symbols stand within a distance of each pose, (P,), by strips of x."""
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


def _poses_on(loops: Loops, number: int) -> tuple[Points, Points]:
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
    contributions of edges outside the rectangle cancel around a loop.
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
    face: FaceLayout, pitch: float, view: SensorView, centre: Points, turn: Points,
    band: Band | None,
) -> NDArray[np.bool_]:  # fmt: skip
    """Return which cells in reach of each pose bear a symbol seen whole, (P, rows, columns)."""
    free = np.array(view.half_mm) - view.symbol_half_mm
    row, column = _cells_at(face, pitch, centre)
    reach = math.floor(float(np.hypot(*np.maximum(free, 0.0))) / pitch + 0.5)
    steps = np.arange(-reach, reach + 1)
    rows, columns = (np.rint(at).astype(np.int64)[:, None] + steps for at in (row, column))
    along = ((columns - column[:, None]) * pitch)[:, None, :]
    down = ((rows - row[:, None]) * pitch)[:, :, None]
    c, s = (f(turn + face.placement.rotation_rad)[:, None, None] for f in (np.cos, np.sin))
    bears, low = _bearing(face, pitch)
    i, j = rows - low[0], columns - low[1]
    there = [(n >= 0) & (n < size) for n, size in zip((i, j), bears.shape, strict=True)]
    i, j = np.where(there[0], i, 0), np.where(there[1], j, 0)
    shown = bears[i[:, :, None], j[:, None, :]] & there[0][:, :, None] & there[1][:, None, :]
    across, up = c * along - s * down, -s * along - c * down
    shown &= (np.abs(across) <= free[0]) & (np.abs(up) <= free[1])
    if band is not None:
        c, s = (f(band.along_rad - turn)[:, None, None] for f in (np.cos, np.sin))
        shown &= np.abs(c * up - s * across) <= band.half_mm[:, None, None]
    return np.asarray(shown)


def _cells_at(face: FaceLayout, pitch_mm: float, points: Points) -> tuple[Points, Points]:
    """Return row and column of points (n, 2) from the anchor on: whole at a cell's centre."""
    place = face.placement
    c, s = np.cos(place.rotation_rad), np.sin(place.rotation_rad)
    x, y = points.T
    column = (c * x - s * y + place.x_mm) / pitch_mm - 0.5
    return -(s * x + c * y + place.y_mm) / pitch_mm - 0.5, column


def _bearing(face: FaceLayout, pitch_mm: float) -> tuple[NDArray[np.bool_], tuple[int, int]]:
    """Return which cells of a face's box bear symbols; its least row and column from the anchor."""
    cells = _cells_at(face, pitch_mm, face.centres_mm)
    row, column = (np.rint(at).astype(np.int64) for at in cells)
    low = int(row.min(initial=0)), int(column.min(initial=0))
    size = int(row.max(initial=0)) - low[0] + 1, int(column.max(initial=0)) - low[1] + 1
    bears = np.zeros(size, dtype=bool)
    bears[row - low[0], column - low[1]] = True
    return bears, low
