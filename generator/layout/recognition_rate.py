"""The expected recognition rate of a part: the share of its touches that a reader would answer.

Solid + symbols of a face (mm, cells) + sensor -> what the sensor meets at many poses: symbols seen
whole, the loaded share of its rectangle, other faces in its way. Views + a table of measured
answers -> the share of touches that are answered at once, and within three, each where the answer
before says; of a face, and of the whole surface, on which blank faces answer nothing.

What the sensor meets is found in `sensor_view`; where it meets another face (`obstacle`) nothing is
answered. Thesis 6.3.

`answers.json` is the table, measured (docs/folds.md): flat faces, a sensor of 25.4 mm whose centre
lies on the face and whose plate rests there, 20 to 120 N, letters made for tactels of 4.5 to 7 mm
(`answers_dense-4.json`: the letters of the published arrays, which are read less). Of that, other
sensor types answer a share that was measured too (`answers_of_types.json`,
`tests/campaigns/promised.py --types`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
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
from generator.layout.obstacle import solid_edges
from generator.layout.placement import FaceLayout
from generator.layout.sensor_view import (
    POSES,
    FaceViews,
    Loops,
    beside_obstacles,
    face_views,
    round_views,
    sensor_view,
    symbol_half_mm,
)
from generator.polyhedron.development import development
from generator.polyhedron.frame import face_frame, face_polygon, surface_areas
from generator.polyhedron.winged import Polyhedron

LOW = 0.5  #: share of touches under which a face is named: `validate-set` calls it no use
NOT_READABLE = 0.15  #: under which it is not readable: of seven touches one is answered
ONE_ROW = 0.7
"""Share of poses that show symbols of one row at most, from which that is the cause: all on a bar
12 mm wide (7 mm), 84 % on an L of such bars."""
TACTEL = "tactel"  #: how the names of alphabets begin that are made for tactels


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
    one_side: bool = False  #: a tag, of which that side alone is touched

    @property
    def shares(self) -> dict[str, float | None]:
        """Return the shares by name, for programs."""
        return {name: getattr(self, name) for name in ("at_once", "within_three", "encoded")}

    @property
    def touched(self) -> float:
        """Return the share of the surface that is touched: of a tag its encoded side."""
        return self.encoded if self.one_side else 1.0

    @property
    def text(self) -> str:
        """Say all of it."""
        side, later = self.touched, ""
        if self.within_three is not None:
            later = f", {percent(self.within_three / side)} within three"
        if self.one_side:
            return (
                f"of touches on its encoded side {percent(self.at_once / side)} are answered at "
                f"once{later}; that is {percent(side)} of its surface"
            )
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

    constant: float
    by_loaded: float

    def at(self, loaded: Points) -> Points:
        """Return the share at each pose, (P,)."""
        return np.asarray(1 / (1 + np.exp(-(self.constant + self.by_loaded * loaded))))


ROUND = AnsweredShare(-9.1, 13.3)
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


def part_rate(
    polyhedron: Polyhedron, faces: Sequence[FaceLayout], rates: Mapping[str, RecognitionRate | None]
) -> PartRate | None:
    """Return the rate of a whole part from those of its faces by name; None: none was measured."""
    if not any(rates.values()):
        return None
    areas = surface_areas(polyhedron)
    once, within, encoded = 0.0, 0.0, 0.0
    for face in faces:
        if len(face.labels):
            own = areas[face.face]
            encoded += own
            rate = rates[polyhedron.faces[face.face].name] or RecognitionRate(0.0, 0.0)
            once += own * rate.at_once
            within += own * (math.nan if rate.within_three is None else rate.within_three)
    whole = sum(areas.values())
    later = None if math.isnan(within) else _to_three_places(within / whole)
    shares = _to_three_places(once / whole), later, _to_three_places(encoded / whole)
    return PartRate(*shares, one_side=polyhedron.kind == "tag" and encoded > 0.0)


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
    """Return the rate from the probability of an answer at each pose.

    `table`, measured with the usual sensor, is looked up at the pitch divided by the sensor's
    coarseness. What is answered later is known of the usual sensor alone.
    """
    free, share = ~views.blocked, answered_share(sensor)
    once = table.at(pitch_mm / sensor.coarseness, views.seen, views.loaded)
    once = (once if share is None else once * share.at(views.loaded)) * free
    once *= ROUND.at(views.loaded) if views.round else 1.0
    within = None
    if sensor.name == USUAL_SENSOR.name:
        later = once + (1 - once) * table.later(views.seen, views.around) * free
        within = _to_three_places(float(later.mean()))
    return RecognitionRate(
        _to_three_places(float(once.mean())),
        within,
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


def answered_share(sensor: SensorType) -> AnsweredShare | None:
    """Return what a sensor type answers of what the usual one would; None of the usual one.

    Of a type that was not measured it is that of the one most like it.
    """
    return measured_types().get(like_measured(sensor))


def like_measured(sensor: SensorType) -> str:
    """Return the name of the measured type whose answers a type is taken to have.

    Itself, or the one most like it in tactels to a symbol and symbols across the sensor.
    """
    names = (USUAL_SENSOR.name, *measured_types())
    if sensor.name in names:
        return sensor.name
    from encoded_objects.base.sensor_type_file import sensor_type_named  # costs start-up

    def unlike(name: str) -> float:
        one = sensor_type_named(name)
        tactels, ours = (each.symbol_pitch_mm / max(each.step_mm) for each in (one, sensor))
        symbols, seen = (each.across_mm / each.symbol_pitch_mm for each in (one, sensor))
        return math.hypot(math.log(tactels / ours), math.log(symbols / seen))

    return min(names, key=unlike)


@lru_cache(maxsize=1)
def measured_types() -> dict[str, AnsweredShare]:
    """Return the shares of the sensor types that were measured, by name."""
    text = (resources.files("generator.layout") / "answers_of_types.json").read_text("utf-8")
    return {name: AnsweredShare(*one["logit"]) for name, one in json.loads(text).items()}


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
