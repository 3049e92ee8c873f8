"""What is touched, where, and what the sensor reads: deterministic in (seed, number).

TouchPlan + number -> DrawnTouch. It is drawn from `default_rng([seed, number])`, so any touch
can be repeated by its number, in any order and on any machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import alphabet_named
from generator.array import profile
from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.simulate.scene import Scene, TouchRanges, bare_scene, random_touches
from probe.simulate.world.sensor import LevelSensor, SensorInstance, sample_sensor
from probe.simulate.world.surfaces import (
    AdjacentParts,
    FramePlace,
    draw_dots,
    draw_ridges,
    draw_rough,
    draw_text,
    exchange_symbols,
    place_adjacent,
    seat_panel,
    seats_of,
    worn_scene,
)
from probe.surface.contract import HeightMap
from probe.surface.face import endless_face
from probe.surface.indenters import FlatPlate
from probe.surface.symbols import Relief
from recognizer.touch.lab import EmbossedArray, EncodedFace
from recognizer.touch.reader import Reader
from recognizer.validation.encoded_set import (
    DECOYS,
    EXCHANGED,
    OTHER_LABS,
    SAME_PROFILE,
    SAME_SIZES,
    SIDE,
    TURNED,
)
from recognizer.validation.errors import ValidationError
from recognizer.validation.touch_plan import ROW, TouchPlan, faces_of_kind, faces_of_lab

#: A touch inside a face keeps this far from its edges: a sensor of 25 mm then shows most of its
#: window; nearer ones are of the kind `edge`, or `corner` about a corner.
INSIDE_MM = 9.0
#: A touch without a rest is drawn again: words of the cause, and the reason that is counted.
UNREST = (
    ("tips", "the plate tips"),
    ("under the", "nothing bears it"),
    ("too thin", "strokes too thin"),
    ("finds no rest", "no rest in the engine"),
    ("does not settle", "no rest in the engine"),
    ("another face", "met another face"),
)
DRAWS = 64  #: of a touch that shows enough symbols to exchange some
TURN_RAD = 0.01  #: a panel turned by less stands as registered
FOREIGN_SYMBOLS = 64  #: rows and columns of foreign symbols, repeated without end


def _random_symbols(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return symbols of the lab's alphabet and pitch, drawn at random."""
    shape = (FOREIGN_SYMBOLS, FOREIGN_SYMBOLS)
    return _embossed_surface(encoding, rng.integers(encoding.array.order, size=shape))


def _other_lab(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return another array in the lab's alphabet and pitch."""
    own = encoding.array
    names = ("one-touch", "large") if own.order == 4 else ("thesis",)
    others = [profile(name).array() for name in names]
    others = [a for a in others if (a.rows, a.columns) != (own.rows, own.columns)]
    if not others or others[0].order != own.order:
        return _random_symbols(encoding, rng)
    array = others[0]
    row, column = (int(rng.integers(size)) for size in (array.rows, array.columns))
    rows, columns = np.indices((FOREIGN_SYMBOLS, FOREIGN_SYMBOLS))
    labels = array.symbols((rows + row) % array.rows, (columns + column) % array.columns)
    return _embossed_surface(encoding, labels)


def _letters(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return letters as high and as thick as the symbols."""
    letters = alphabet_named("letters-4")
    strokes = tuple(glyph.strokes for glyph in letters.glyphs)
    return draw_text(strokes, letters.reach, encoding.style.pitch_mm, _relief(encoding), rng)


#: Surfaces that no database knows, `--kinds foreign`, in the style of the lab's symbols.
FOREIGN: dict[str, Callable[[EmbossedArray, np.random.Generator], HeightMap]] = {
    "blank": lambda _lab, _rng: FlatPlate(),
    "ridges": lambda lab, rng: draw_ridges(lab.style.pitch_mm, lab.style.stroke_mm, rng),
    "dots": lambda lab, rng: draw_dots(lab.style.pitch_mm, rng),
    "rough": lambda _, rng: draw_rough(rng),
    "random symbols": _random_symbols,
    "other lab": _other_lab,
    "text": _letters,
}


def _embossed_surface(encoding: EmbossedArray, labels: NDArray[np.int64]) -> HeightMap:
    style, alphabet = encoding.style, encoding.alphabet
    return endless_face(
        labels,
        tuple(glyph.strokes for glyph in alphabet.glyphs),
        pitch_mm=style.pitch_mm,
        unit_mm=alphabet.reach * style.pitch_mm,
        relief=_relief(encoding),
    )


def _relief(encoding: EmbossedArray) -> Relief:
    style = encoding.style
    return Relief(style.height_mm, style.stroke_mm, style.draft_rad, style.chamfer_mm)


@dataclass(frozen=True, slots=True, eq=False)
class ContactScene:
    """What lies under the sensor, wherever it touches."""

    scene: Scene
    registered: bool = True  #: whether the lab knows it
    adjacent: tuple[Scene, FramePlace] | None = None  #: another face under the sensor, and where


@dataclass(frozen=True, slots=True, eq=False)
class DrawnTouch:
    """A touch, and what the sensor reads."""

    contact: ContactScene
    touch: Touch
    counts: NDArray[np.uint16]
    sensor: SensorInstance
    resampled: tuple[str, ...] = ()  #: why, for each time that the plate did not come to rest

    def truth_of(self, object_name: str | None, face: str | None) -> tuple[Scene | None, Touch]:
        """Return the truth that an answer is compared with: of the face named, if it is there.

        The scene is None where the lab does not know what is touched.
        """
        if self.contact.adjacent is not None:
            scene, place = self.contact.adjacent
            if (scene.object_name, scene.face) == (object_name, face):
                return scene, place.touch_inside(self.touch)
        return (self.contact.scene if self.contact.registered else None), self.touch


def draw_touch(plan: TouchPlan, number: int, reader: Reader) -> DrawnTouch:
    """Return what is touched in a trial, and the reading.

    Raises ValidationError: the set has no face of the plan's kind.
    """
    rng = np.random.default_rng([plan.seed, number])
    ranges = plan.ranges(reader.sensor)
    of_run = _sensor_of_run(plan.seed, reader.sensor) if plan.sensor_per == "run" else None
    resampled: list[str] = []
    arrays = [
        one
        for one in reader.lab.arrays
        if plan.kind in FOREIGN or faces_of_kind(one, plan.kind, plan.prints, plan.only)
    ]
    if not arrays:
        raise ValidationError(
            f"no face for touches of kind {plan.kind}{' was printed' if plan.prints else ''}",
            fix="name other kinds, or another set",
            place=plan.prints or plan.database,
        )
    encoding = arrays[int(rng.integers(len(arrays)))]
    while True:
        contact, touch = _sample_scene(plan, encoding, reader.sensor, ranges, rng)
        sensor = of_run or sample_sensor(reader.sensor, rng)
        try:
            counts = _read(plan, contact.scene, touch, sensor, reader, rng)
        except ContactError as error:
            reasons = (reason for words, reason in UNREST if words in error.cause)
            resampled.append(next(reasons, "other"))
        else:
            return DrawnTouch(contact, touch, counts, sensor, tuple(resampled))


def draw_again(
    plan: TouchPlan, before: DrawnTouch, touch: Touch, reader: Reader, rng: np.random.Generator
) -> DrawnTouch:
    """Return what the sensor of a touch reads of the same surface at another place.

    Raises ContactError: the plate does not come to rest there, or on another face.
    """
    counts = _read(plan, before.contact.scene, touch, before.sensor, reader, rng)
    return DrawnTouch(before.contact, touch, counts, before.sensor)


def draw_tilt(plan: TouchPlan, touch: Touch, rng: np.random.Generator) -> Touch:
    """Return a touch with another tilt of the wrist, as the plan draws it."""
    tilt = plan.ranges(SensorType()).tilt_rad * math.sqrt(rng.random())
    towards = float(rng.uniform(-math.pi, math.pi))
    return replace(touch, tilt_x_rad=tilt * math.cos(towards), tilt_y_rad=tilt * math.sin(towards))


def _read(
    plan: TouchPlan, scene: Scene, touch: Touch, sensor: SensorInstance, reader: Reader,
    rng: np.random.Generator,
) -> NDArray[np.uint16]:  # fmt: skip
    worse = LevelSensor(reader.sensor, plan.noise, plan.engine, sensor)
    reading = worse.read(scene, touch, rng)
    if scene.meets_another_face(reading.contact.z_mm):
        raise ContactError(
            f"the plate meets another face, {reading.contact.z_mm:.1f} mm over {scene.face}",
            fix="move the sensor away from what stands over the face",
        )
    return reading.counts


def _sample_scene(
    plan: TouchPlan, encoding: EmbossedArray, sensor: SensorType, ranges: TouchRanges,
    rng: np.random.Generator,
) -> tuple[ContactScene, Touch]:  # fmt: skip
    if plan.kind in FOREIGN:
        foreign = bare_scene(FOREIGN[plan.kind](encoding, rng), plan.kind)
        return ContactScene(foreign, registered=False), _draw_anywhere(rng, ranges)
    if plan.kind in (SAME_PROFILE, SAME_SIZES):
        labs = plan.labs[-1:] if plan.kind == SAME_SIZES else plan.labs[:OTHER_LABS]
        lab = labs[int(rng.integers(len(labs)))]
        faces = faces_of_lab(lab)
        scene, most = plan.face(*faces[int(rng.integers(len(faces)))], lab=lab)
        return ContactScene(scene, registered=False), _draw_on_face(plan, scene, most, rng, ranges)
    known = faces_of_kind(encoding, plan.kind, plan.prints, plan.only)
    face = encoding.face(known[int(rng.integers(len(known)))])
    if plan.kind in DECOYS:
        plan = replace(plan, files=plan.files and plan.kind == SIDE)
    scene, most = plan.face(face.object, face.face)
    if plan.kind == SIDE:
        return _adjacent(plan, encoding, scene, ranges, rng)
    if plan.kind in EXCHANGED:
        return _exchanged(plan, encoding, face, sensor, ranges, rng)
    if plan.kind in DECOYS:
        return _reseated(plan, encoding, scene, ranges, rng)
    touch = _draw_on_face(plan, scene, most, rng, ranges)
    if plan.kind == ROW:
        quarters = round((touch.theta_rad + face.rotation_rad) / (math.pi / 2))
        touch = replace(touch, theta_rad=quarters * math.pi / 2 - face.rotation_rad)
    if plan.kind == "worn":
        pitch_mm = encoding.style.pitch_mm
        scene = worn_scene(scene, face.centres_mm, face.rotation_rad, pitch_mm, plan.worn, rng)
    return ContactScene(scene), touch


def _draw_on_face(
    plan: TouchPlan, scene: Scene, most: float, rng: np.random.Generator, ranges: TouchRanges
) -> Touch:
    """Draw a touch of a face; where the face is too small for its kind, anywhere on it."""
    if plan.kind == "corner":
        touch = next(random_touches(scene.region, rng, ranges))
        corner = scene.region.starts[int(rng.integers(len(scene.region.starts)))]
        towards = np.array([touch.x_mm, touch.y_mm]) - corner
        by = INSIDE_MM * rng.random() / max(float(np.hypot(*towards)), INSIDE_MM)
        at = corner + towards * by
        return replace(touch, x_mm=float(at[0]), y_mm=float(at[1]))
    if plan.kind == "edge":
        for touch in random_touches(scene.region, rng, ranges):
            if scene.region.distance_mm(np.array([[touch.x_mm, touch.y_mm]]))[0] < INSIDE_MM:
                return touch
    margin = 0.0 if plan.kind == "anywhere" else min(INSIDE_MM, 0.8 * most)
    return next(random_touches(scene.region, rng, replace(ranges, margin_mm=margin)))


def _draw_anywhere(rng: np.random.Generator, ranges: TouchRanges) -> Touch:
    """Draw a touch of a surface that has no edges near, within 100 mm of its origin."""
    theta, towards = rng.uniform(-math.pi, math.pi, 2)
    tilt = ranges.tilt_rad * math.sqrt(rng.random())
    x, y = rng.uniform(0, 100, 2)
    return Touch(
        x_mm=float(x),
        y_mm=float(y),
        theta_rad=float(theta),
        force_n=float(rng.uniform(*ranges.force_n)),
        tilt_x_rad=tilt * math.cos(towards),
        tilt_y_rad=tilt * math.sin(towards),
    )


def _adjacent(
    plan: TouchPlan, encoding: EmbossedArray, scene: Scene, ranges: TouchRanges,
    rng: np.random.Generator,
) -> tuple[ContactScene, Touch]:  # fmt: skip
    """Place a face of another object edge to edge with one, and touch near where they meet."""
    faces = [encoding.face(n) for n in faces_of_kind(encoding, SIDE, plan.prints)]
    others = [face for face in faces if face.object != scene.object_name]
    other = others[int(rng.integers(len(others)))]
    second, _ = plan.face(other.object, other.face)
    place, at = place_adjacent(scene.region, second.region, rng)
    touch = replace(_draw_anywhere(rng, ranges), x_mm=float(at[0]), y_mm=float(at[1]))
    both = replace(scene, surface=AdjacentParts(scene.surface, second.surface, place))
    return ContactScene(both, adjacent=(second, place)), touch


def _exchanged(
    plan: TouchPlan, encoding: EmbossedArray, face: EncodedFace, sensor: SensorType,
    ranges: TouchRanges, rng: np.random.Generator,
) -> tuple[ContactScene, Touch]:  # fmt: skip
    """Exchange some of the symbols that lie wholly under the sensor; every answer is wrong.

    A touch that shows fewer is drawn again; on a face that never shows as many all are exchanged.
    """
    scene, most = plan.face(face.object, face.face)
    inside = np.array(sensor.half_mm) - encoding.alphabet.reach * encoding.style.pitch_mm
    number = EXCHANGED[plan.kind]
    for _ in range(DRAWS):
        touch = _draw_on_face(plan, scene, most, rng, ranges)
        whole = np.flatnonzero((np.abs(touch.on_sensor(face.centres_mm)) < inside).all(axis=1))
        if len(whole) >= number:
            break
    chosen = rng.permutation(whole)[:number]
    order = encoding.array.order
    labels = (face.labels[chosen] + rng.integers(1, order, size=len(chosen))) % order
    surface = exchange_symbols(scene.surface, face.centres_mm[chosen], labels)
    return ContactScene(replace(scene, surface=surface), registered=not len(chosen)), touch


def _reseated(
    plan: TouchPlan, encoding: EmbossedArray, scene: Scene, ranges: TouchRanges,
    rng: np.random.Generator,
) -> tuple[ContactScene, Touch]:  # fmt: skip
    """Glue a panel into its seat turned, or another one of the object into that seat.

    What is touched is that panel, so the answer that names it, and the place on it, is right; any
    other is wrong. That the panel is not where the database has it, one touch cannot tell.
    """
    faces = [encoding.face(n) for n in faces_of_kind(encoding, plan.kind, plan.prints)]
    ways = []
    for other in faces:
        same = other.face == scene.face
        if other.object == scene.object_name and same == (plan.kind == TURNED):
            panel, _ = plan.face(other.object, other.face)
            ways += [(panel, place) for place in seats_of(scene.region, panel.region)]
    if plan.kind == TURNED:
        ways = [way for way in ways if abs(way[1].turn_rad) > TURN_RAD]
    touch = _draw_on_face(replace(plan, kind="anywhere"), scene, 0.0, rng, ranges)
    if not ways:  # no other way to glue it: as registered
        return ContactScene(scene), touch
    panel, place = ways[int(rng.integers(len(ways)))]
    both = replace(scene, surface=seat_panel(scene.surface, panel.surface, place))
    return ContactScene(both, registered=False, adjacent=(panel, place)), touch


@lru_cache(maxsize=4)
def _sensor_of_run(seed: int, sensor: SensorType) -> SensorInstance:
    return sample_sensor(sensor, np.random.default_rng([seed, 0, 4]))
