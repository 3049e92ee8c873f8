"""The expected recognition rate of a part: the share of its touches that a reader would answer.

Solid + symbols of a face (mm, cells) + sensor -> what the sensor meets at many poses: symbols seen
whole, the loaded share of its rectangle, other faces in its way. Views + a table of measured
answers -> the share of touches that are answered at once, and within three, each where the answer
before says; of a face, and of the whole surface, on which blank faces answer nothing.

A pose is a place of the sensor's centre on the face, and a turn. They are spread evenly, the same
every time (an additive recurrence). Seen whole is a symbol whose centre lies at least the symbol's
half size inside the sensor's rectangle. The loaded share is exact: the rectangle cut by the
outline, holes and all. On a round face a plate rests along a line: symbols and surface count down
to `SAG_MM` under it. Where the sensor meets another face (`obstacle`) nothing is answered. Thesis
6.3.

`answers.json` is the table, measured (docs/folds.md): flat faces, a sensor of 25.4 mm whose centre
lies on the face and whose plate rests there, 20 to 120 N, letters made for tactels of 4.5 to 7 mm
(`answers_dense-4.json`: the letters of the published arrays, which are read less). Of that, other
sensor types answer a share that was measured too (`answers_of_types.json`,
`tests/campaigns/promised.py --types`).

M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018), for the recurrence.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import USUAL_SENSOR, SensorType
from generator.alphabet.known import Alphabet
from generator.alphabet.outline import SymbolStyle
from generator.array.contract import touches_needed
from generator.layout.footprint import Points
from generator.layout.obstacle import Box, SolidEdges, solid_edges
from generator.layout.placement import FaceLayout
from generator.plane.polygon import points_inside, segments, signed_area
from generator.polyhedron.development import Development, development
from generator.polyhedron.frame import face_area, face_frame, face_polygon
from generator.polyhedron.winged import Developable, Polyhedron

LOW = 0.5  #: share of touches under which a face is named: `validate-set` calls it no use
NOT_READABLE = 0.15  #: under which it is not readable: of seven touches one is answered
ONE_ROW = 0.7
"""Share of poses that show symbols of one row at most, from which that is the cause: all on a bar
12 mm wide (7 mm), 84 % on an L of such bars."""
POSES = 1000
"""On each face: shares within .008 of those of 40,000 on faces of 28 to 60 mm (pitch 7 and 4.5
mm); 6 to 10 ms a face."""
AROUND_MM = 20.0  #: of the usual sensor: half its width and a step
MEETS_MM2 = 1.0  #: of another face inside the sensor's rectangle: less than a tactel
SAG_MM = 0.3
"""Under the line along which a plate touches a round face, down to which symbols are seen: .25 to
.3 mm makes 600 touches of cans of 26 to 100 mm and cones the likeliest."""
TACTEL = "tactel"  #: how the names of alphabets begin that are made for tactels
_STRIPS = 64  # poses looked at together
_PAIRS = 1 << 18  # of poses and edges looked at together
_STEPS = 1.2207440846057596 ** -np.arange(1.0, 4.0)  # of x, y and turn: 1.22^4 = 1.22 + 1

Loops = Sequence[Points]  #: outline of a face: outer loop (k, 2) counter-clockwise, then holes, mm


@dataclass(frozen=True, slots=True)
class RecognitionRate:
    """Of one face."""

    at_once: float  #: share of touches, the sensor's centre on the face, that are answered
    #: within up to three touches, each where the answer before says; None: not measured
    within_three: float | None
    one_row: bool = False  #: touches show one row of symbols
    remedy: str = ""  #: what would make it answer most touches, where it does not
    blocked: float = 0.0  #: share of its places where the sensor meets another face
    meets: tuple[str, ...] = ()  #: which, the one most often met first

    @property
    def obstacle(self) -> str:
        """Say what the sensor meets and how often; empty where that is nothing."""
        if not self.meets:
            return ""
        more = f" and {len(self.meets) - 1} more" if len(self.meets) > 2 else ""
        named = f"{self.meets[0]}{more}" if more else " and ".join(self.meets)
        return f"the sensor meets {named} at {max(self.blocked, 0.01):.0%} of its places".replace(
            "%", " %"
        )


@dataclass(frozen=True, slots=True)
class PartRate:
    """Of touches anywhere on the surface of a whole part; blank faces answer none."""

    at_once: float  #: share of touches that are answered
    within_three: float | None  #: None: not measured
    encoded: float  #: share of the surface that faces with symbols have

    @property
    def text(self) -> str:
        """Say all of it."""
        later = "" if self.within_three is None else f", {percent(self.within_three)} within three"
        return (
            f"of touches anywhere on the part {percent(self.at_once)} are answered at once{later}; "
            f"{percent(self.encoded)} of its surface is encoded"
        )


def percent(share: float) -> str:
    """Return a share in per cent, never as all or none where it is not."""
    if 0 < share < 0.01:
        return "under 1 %"
    return "over 99 %" if 0.99 < share < 1 else f"{share:.0%}".replace("%", " %")


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
class AnswerTable:
    """How often a reader answers, measured: pitch x symbols seen whole x loaded share.

    Linear between its entries, constant beyond them. What is not answered at once is answered by
    the second or third touch the likelier, the more symbols stand around those seen whole already.
    """

    pitch_mm: tuple[float, ...]  #: rising
    seen: tuple[float, ...]  #: rising
    loaded: tuple[float, ...]  #: rising
    probability: NDArray[np.float64]  #: (pitch, seen, loaded)
    again: tuple[float, float, float]  #: its logit: constant, of log(1 + around), of log(1 + seen)

    def at(self, pitch_mm: float, seen: NDArray[np.int64], loaded: Points) -> Points:
        """Return the probability of an answer at each pose, (P,)."""
        low, high, part = _between(pitch_mm, self.pitch_mm)
        table = self.probability[low] * (1 - part) + self.probability[high] * part
        rows = np.stack([np.interp(loaded, self.loaded, row) for row in table])
        below, above, share = _between(seen, self.seen)
        pose = np.arange(len(seen))
        return np.asarray(rows[below, pose] * (1 - share) + rows[above, pose] * share)

    def later(self, seen: ArrayLike, around: ArrayLike) -> Points:
        """Return the probability that a touch is answered by the third, if not at once, (P,)."""
        seen, around = np.asarray(seen, float), np.asarray(around, float)
        constant, by_around, by_seen = self.again
        logit = constant + by_around * np.log1p(around) + by_seen * np.log1p(seen)
        return np.asarray(np.where(around > 0, 1 / (1 + np.exp(-logit)), 0.0))


@dataclass(frozen=True, slots=True)
class AnsweredShare:
    """Share that is answered of the touches that the usual sensor answers on flat faces, measured.

    Logistic in the loaded share: larger sensors hang over borders, which membranes of gels bridge.
    """

    across_mm: float  #: of the type, as `SensorType.across_mm`
    symbol_pitch_mm: float  #: that it was measured on
    constant: float
    by_loaded: float

    def at(self, loaded: Points) -> Points:
        """Return the share at each pose, (P,)."""
        return np.asarray(1 / (1 + np.exp(-(self.constant + self.by_loaded * loaded))))


ROUND = AnsweredShare(USUAL_SENSOR.across_mm, 5.0, -9.1, 13.3)
"""Of round faces: a plate that touches along a line and hangs over a rim, or over the seam of the
symbols, is read less than on a flat face; the likeliest numbers for the same touches."""


def face_rates(
    polyhedron: Polyhedron,
    faces: Iterable[FaceLayout],
    order: int,
    cells: int,
    style: SymbolStyle,
    alphabet: Alphabet,
    sensor: SensorType = USUAL_SENSOR,
) -> dict[int, RecognitionRate]:
    """Return the rate of each face by its number; equal faces that stand free share the work.

    Empty for arrays that are read by a scan: no rate was measured there. `order` and `cells` are
    those of the array; round faces are the polyhedron's `surfaces`.
    """
    if touches_needed(order, cells, style.pitch_mm, sensor_mm=sensor.across_mm) > 1:
        return {}
    solid = solid_edges(polyhedron)
    view = sensor_view(sensor, symbol_half_mm(alphabet, style))
    table = measured_answers(alphabet.name)
    surfaces = {surface.carrier: surface for surface in polyhedron.surfaces}
    known: dict[bytes, RecognitionRate] = {}
    rates = {}
    for face in faces:
        surface = surfaces.get(face.face)
        if not len(face.labels):
            rates[face.face] = RecognitionRate(0.0, 0.0)
        elif surface is not None:
            views = round_views(solid, surface, development(polyhedron, surface), face, style, view)
            rates[face.face] = _rate(views, table, style.pitch_mm, sensor)
        else:
            loops, frame = face_polygon(polyhedron, face.face), face_frame(polyhedron, face.face)
            free = solid.rise_mm(frame) <= style.height_mm
            key = _face_key(loops, face) + (b"" if free else str(face.face).encode())
            if key not in known:
                views = face_views(loops, face, style.pitch_mm, view)
                views = beside_obstacles(views, solid, frame, style.height_mm, view)
                known[key] = _rate(views, table, style.pitch_mm, sensor)
            rates[face.face] = known[key]
    return rates


def symbol_half_mm(alphabet: Alphabet, style: SymbolStyle) -> float:
    """Return the distance from a symbol's centre to the end of its strokes."""
    return alphabet.reach * style.pitch_mm + style.stroke_mm / 2


def part_rate(
    polyhedron: Polyhedron, faces: Sequence[FaceLayout], rates: Mapping[str, RecognitionRate | None]
) -> PartRate | None:
    """Return the rate of a whole part from those of its faces by name; None: none was measured."""
    if not any(rates.values()):
        return None
    facets = {surface.carrier: surface.facets for surface in polyhedron.surfaces}
    area = [face_area(polyhedron, face) for face in range(len(polyhedron.faces))]
    once, within, encoded = 0.0, 0.0, 0.0
    for face in faces:
        if len(face.labels):
            own = sum(area[facet] for facet in facets.get(face.face, (face.face,)))
            encoded += own
            rate = rates[polyhedron.faces[face.face].name] or RecognitionRate(0.0, 0.0)
            once += own * rate.at_once
            within += own * (math.nan if rate.within_three is None else rate.within_three)
    whole = sum(area)
    later = None if math.isnan(within) else _to_three_places(within / whole)
    return PartRate(_to_three_places(once / whole), later, _to_three_places(encoded / whole))


def face_rate(
    loops: Loops,
    face: FaceLayout,
    style: SymbolStyle,
    alphabet: Alphabet,
    sensor: SensorType,
    poses: int = POSES,
) -> RecognitionRate:
    """Return the rate of one flat face that stands free, to three places."""
    if not len(face.labels):
        return RecognitionRate(0.0, 0.0)
    view = sensor_view(sensor, symbol_half_mm(alphabet, style))
    views = face_views(loops, face, style.pitch_mm, view, poses)
    return _rate(views, measured_answers(alphabet.name), style.pitch_mm, sensor)


def _to_three_places(share: float) -> float:
    """Return a share rounded, but never to all where it is not."""
    return min(round(share, 3), 0.999) if share < 1 - 1e-9 else 1.0


def _rate(
    views: FaceViews, table: AnswerTable, pitch_mm: float, sensor: SensorType
) -> RecognitionRate:
    once, within = answered_shares(views, table, pitch_mm, sensor)
    free = ~views.blocked
    return RecognitionRate(
        _to_three_places(once),
        None if within is None else _to_three_places(within),
        one_row=bool(free.any() and (views.lines[free] <= 1).mean() >= ONE_ROW),
        blocked=round(float(views.blocked.mean()), 3),
        meets=views.meets,
    )


def _face_key(loops: Loops, face: FaceLayout) -> bytes:
    """Return equal bytes for faces that show equal symbols at every pose."""
    place = face.placement
    turn = np.array([math.cos(place.rotation_rad), math.sin(place.rotation_rad)])
    numbers = [np.concatenate(list(loops)).ravel(), face.centres_mm.ravel(), turn]
    return (np.round(np.concatenate(numbers), 6) + 0.0).tobytes()


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


@dataclass(frozen=True, slots=True)
class Band:
    """What a plate feels of a round face: a band through the sensor's centre at each pose."""

    along_rad: Points  #: (P,) direction, face frame
    half_mm: Points  #: (P,) half its width


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


def answered_shares(
    views: FaceViews, table: AnswerTable, pitch_mm: float, sensor: SensorType = USUAL_SENSOR
) -> tuple[float, float | None]:
    """Return the shares of touches that will be answered at once, and within three.

    The second is known of the usual sensor alone: None of others.
    """
    once = answered_at_once(table, pitch_mm, views.seen, views.loaded, sensor) * ~views.blocked
    once *= ROUND.at(views.loaded) if views.round else 1.0
    if sensor.name != USUAL_SENSOR.name:
        return float(once.mean()), None
    within = once + (1 - once) * table.later(views.seen, views.around) * ~views.blocked
    return float(once.mean()), float(within.mean())


def answered_share(sensor: SensorType) -> AnsweredShare | None:
    """Return what a sensor type answers of what the usual one would; None of the usual one.

    Of a type that was not measured it is that of the one most like it in size and pitch.
    """
    known = measured_types()
    if sensor.name == USUAL_SENSOR.name or sensor.name in known:
        return known.get(sensor.name)
    nearest = min(known.values(), key=lambda one: _unlike(one, sensor))
    return nearest if _unlike(nearest, sensor) < _unlike(USUAL_SENSOR, sensor) else None


def _unlike(one: AnsweredShare | SensorType, sensor: SensorType) -> float:
    size = one.across_mm / sensor.across_mm
    pitch = one.symbol_pitch_mm / sensor.symbol_pitch_mm
    return math.hypot(math.log(size), math.log(pitch))


def answered_at_once(
    table: AnswerTable,
    pitch_mm: float,
    seen: NDArray[np.int64],
    loaded: Points,
    sensor: SensorType = USUAL_SENSOR,
) -> Points:
    """Return the probability that a touch is answered at once at each pose, (P,).

    `table`, measured with the usual sensor, is looked up at the pitch divided by the sensor's
    coarseness; `seen` (P,) symbols seen whole, `loaded` (P,) the loaded share.
    """
    usual, share = table.at(pitch_mm / sensor.coarseness, seen, loaded), answered_share(sensor)
    return usual if share is None else usual * share.at(loaded)


@lru_cache(maxsize=1)
def measured_types() -> dict[str, AnsweredShare]:
    """Return the shares of the sensor types that were measured, by name."""
    text = (resources.files("generator.layout") / "answers_of_types.json").read_text("utf-8")
    return {
        name: AnsweredShare(one["across_mm"], one["pitch_mm"], *one["logit"])
        for name, one in json.loads(text).items()
    }


@lru_cache(maxsize=2)
def measured_answers(letters: str = TACTEL) -> AnswerTable:
    """Return the table of an alphabet's letters, measured with the reader and the usual sensor."""
    name = "answers.json" if letters.startswith(TACTEL) else "answers_dense-4.json"
    text = (resources.files("generator.layout") / name).read_text(encoding="utf-8")
    values = json.loads(text)
    pitch, seen, loaded = (tuple(values[name]) for name in ("pitch_mm", "seen", "loaded"))
    again = tuple(values["again"])
    return AnswerTable(pitch, seen, loaded, np.array(values["probability"]), again)


def _between(value: Any, steps: Sequence[float]) -> tuple[Any, Any, Any]:
    """Return the entries around values, and how far each lies from the lower to the upper."""
    place = np.interp(value, steps, np.arange(len(steps)))
    low = np.floor(place).astype(np.int64)
    return low, np.minimum(low + 1, len(steps) - 1), place - low


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
