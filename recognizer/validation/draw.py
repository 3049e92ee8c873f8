"""What is touched, where, and what the sensor reads. Nothing but its number decides a touch.

TouchPlan + number -> DrawnTouch. It is drawn from `default_rng([seed, number])`, so any touch
can be repeated by its number, in any order and on any machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.sensor import SensorType
from probe.sensor_types import choose_sensor_type
from probe.simulate.registered import registered_object, registered_objects, registered_surface
from probe.simulate.scene import Scene
from probe.simulate.touch import TouchRanges, random_touches
from probe.simulate.world.levels import LEVELS, Level
from probe.simulate.world.reading import read_sensor
from probe.simulate.world.sensor_copy import SensorCopy, draw_copy
from probe.simulate.world.side_by_side import SideBySide, lay_beside
from probe.simulate.world.worn import wear_face, wear_part
from probe.surface.contract import HeightMap
from probe.surface.face import FaceSurface
from recognizer.touch.lab import EmbossedArray, EncodedFace
from recognizer.touch.reader import Reader
from recognizer.validation.errors import ValidationError
from recognizer.validation.made_kinds import SAME_PROFILE, SIDE, is_extra
from recognizer.validation.settings import DRAWING
from recognizer.validation.surfaces import FOREIGN
from recognizer.validation.written import written_surface

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TouchPlan:
    """What is drawn.

    `kind` is `face` (the sensor's centre at least `inside_mm` from the edges), `edge` (nearer
    than that), `corner` (within `inside_mm` of a corner), `worn` (a face with a share of its
    symbols gone), `copy`, `near` or `small` (inside faces of these members, `made_kinds`), `side`
    (near an edge beside which another object lies), `same_profile` (a part of another lab),
    `anywhere` (all places of a face are alike likely), or one of the surfaces of
    `surfaces.FOREIGN`.
    """

    database: str
    seed: int = 1
    level: str = "typical"
    kind: str = "face"
    force_n: tuple[float, float] = DRAWING.force_n
    tilt_rad: float = DRAWING.tilt_rad
    worn: float = DRAWING.worn
    files: bool = False  #: touch the written STL files, not what the database says of them
    prints: str = ""  #: listing of the printed surfaces that are touched instead; empty: none
    engine: str = "own"  #: of contact, `probe.contact.engines`
    sensor_per: str = "touch"  #: or `run`: the errors of the sensor stay the same
    labs: tuple[str, ...] = ()  #: databases of other labs, of `same_profile`
    policy: str = "one"  #: or `next`: touches follow until one is answered, `policy`
    only: str = ""  #: object/face that is touched; empty: any


@dataclass(frozen=True, slots=True, eq=False)
class DrawnTouch:
    """What is touched, and what the sensor reads."""

    surface: HeightMap
    scene: Scene | None  #: None for a foreign surface, and for parts of another lab
    touch: Touch
    counts: NDArray[np.uint16]
    drawn_anew: tuple[str, ...] = ()  #: why, for each time that the plate did not come to rest
    beside: tuple[Scene, Touch] | None = None  #: another face under the sensor, its touch there
    copy: SensorCopy | None = None  #: the sensor
    elsewhere: Callable[[Touch], MetSurface] | None = None  #: what the same touch meets there

    def truth_of(self, object_name: str | None, face: str | None) -> tuple[Scene | None, Touch]:
        """Return the truth that an answer is compared with: of the face named, if it is there."""
        if self.beside is not None:
            scene, _ = self.beside
            if (scene.object_name, scene.face) == (object_name, face):
                return self.beside
        return self.scene, self.touch


def draw_touch(plan: TouchPlan, number: int, reader: Reader) -> DrawnTouch:
    """Return what is touched in a trial, and the reading."""
    rng = np.random.default_rng([plan.seed, number])
    ranges = _ranges(plan, level_of(plan), reader.sensor)
    copy = _copy_of_run(plan.seed, reader.sensor) if plan.sensor_per == "run" else None
    anew: list[str] = []
    arrays = [
        one
        for one in reader.lab.arrays
        if plan.kind in FOREIGN or _by_name(one, plan.kind, plan.prints, plan.only)
    ]
    if not arrays:
        raise ValidationError(
            f"no face for touches of kind {plan.kind}{' was printed' if plan.prints else ''}",
            fix="name other kinds, or another set",
            place=plan.prints or plan.database,
        )
    encoding = arrays[int(rng.integers(len(arrays)))]
    while True:
        met = _meet(plan, encoding, ranges, rng)
        drawn = copy or draw_copy(reader.sensor, rng)
        try:
            return _read(plan, met, reader.sensor, rng, drawn, tuple(anew))
        except ContactError as error:
            anew.append(DRAWING.why_anew(error.cause))


def draw_again(
    plan: TouchPlan, before: DrawnTouch, touch: Touch, reader: Reader, rng: np.random.Generator
) -> DrawnTouch:
    """Return what the sensor of a touch reads of the same surface at another place.

    Raises
    ------
    ContactError
        The plate does not come to rest there.
    """
    if before.elsewhere is None or before.copy is None:
        raise ValidationError("a touch that nobody drew", fix="draw it by draw_touch")
    return _read(plan, before.elsewhere(touch), reader.sensor, rng, before.copy)


def draw_tilt(plan: TouchPlan, touch: Touch, rng: np.random.Generator) -> Touch:
    """Return a touch with another tilt of the wrist, as the plan draws it."""
    tilt = _ranges(plan, level_of(plan), SensorType()).tilt_rad * math.sqrt(rng.random())
    towards = float(rng.uniform(-math.pi, math.pi))
    return replace(touch, tilt_x_rad=tilt * math.cos(towards), tilt_y_rad=tilt * math.sin(towards))


@dataclass(frozen=True, slots=True, eq=False)
class MetSurface:
    """What the sensor comes down on, and where."""

    surface: HeightMap
    touch: Touch
    face: Scene | None  #: None for a surface of no part
    beside: tuple[Scene, Touch] | None = None
    elsewhere: Callable[[Touch], MetSurface] | None = None  #: the same, met by another touch


def _read(
    plan: TouchPlan, met: MetSurface, sensor: SensorType, rng: np.random.Generator,
    copy: SensorCopy, anew: tuple[str, ...] = (),
) -> DrawnTouch:  # fmt: skip
    """Return what a sensor reads of what it meets."""
    level = level_of(plan)
    counts, _ = read_sensor(
        met.surface, sensor, met.touch, level, rng, plan.engine,
        datum_mm=_datum(met.face if level.scale else None), copy=copy,
    )  # fmt: skip
    scene = None if plan.kind == SAME_PROFILE else met.face
    return DrawnTouch(met.surface, scene, met.touch, counts, anew, met.beside, copy, met.elsewhere)


def _meet(
    plan: TouchPlan, encoding: EmbossedArray, ranges: TouchRanges, rng: np.random.Generator
) -> MetSurface:
    """Draw what is touched and where."""
    if plan.kind in FOREIGN:
        foreign = FOREIGN[plan.kind](encoding, rng)
        return _met_at(lambda _: foreign, _draw_anywhere(rng, ranges), None)
    if plan.kind == SAME_PROFILE:
        lab = plan.labs[int(rng.integers(len(plan.labs)))]
        faces = _faces_of_lab(lab)
        name, shown = faces[int(rng.integers(len(faces)))]
        scene = scene_of(lab, name, shown, plan.files)
        touch = _draw_on_face(
            scene, plan.kind, _inradius_mm(lab, name, shown, plan.files), rng, ranges
        )
        return _met_at(lambda at: scene.under(at).surface, touch, scene)
    known = _by_name(encoding, plan.kind, plan.prints, plan.only)
    face = encoding.face(known[int(rng.integers(len(known)))])
    scene = scene_of(plan.database, face.object, face.face, plan.files, plan.prints)
    if plan.kind == SIDE:
        return _lay_beside(plan, encoding, scene, ranges, rng)
    most = _inradius_mm(plan.database, face.object, face.face, plan.files, plan.prints)
    touch = _draw_on_face(scene, plan.kind, most, rng, ranges)
    if plan.kind != "worn":
        return _met_at(lambda at: scene.under(at).surface, touch, scene)
    drawn, pitch = deepcopy(rng), encoding.style.pitch_mm
    surface = _worn(plan, scene, face, pitch, touch, rng)

    def met(at: Touch) -> MetSurface:  # other places of the face have lost the same symbols
        return MetSurface(
            _worn(plan, scene, face, pitch, at, deepcopy(drawn)), at, scene, elsewhere=met
        )

    return MetSurface(surface, touch, scene, elsewhere=met)


def _met_at(
    surface_at: Callable[[Touch], HeightMap], touch: Touch, face: Scene | None
) -> MetSurface:
    """Return what a touch meets of a surface that may depend on where it is touched."""
    return MetSurface(
        surface_at(touch), touch, face, elsewhere=lambda at: _met_at(surface_at, at, face)
    )


def _worn(
    plan: TouchPlan, scene: Scene, face: EncodedFace, pitch_mm: float, touch: Touch,
    rng: np.random.Generator,
) -> HeightMap:  # fmt: skip
    """Return a face of which a share of the symbols is gone."""
    surface = scene.under(touch).surface
    if isinstance(surface, FaceSurface):
        return wear_face(surface, plan.worn, rng)
    return wear_part(surface, face.centres_mm, face.rotation_rad, pitch_mm, plan.worn, rng)


def _lay_beside(
    plan: TouchPlan, encoding: EmbossedArray, scene: Scene, ranges: TouchRanges,
    rng: np.random.Generator,
) -> MetSurface:  # fmt: skip
    """Lay a face of another object beside one, and touch near where they meet."""
    faces = [encoding.face(n) for n in _by_name(encoding, SIDE, plan.prints)]
    others = [face for face in faces if face.object != scene.object_name]
    other = others[int(rng.integers(len(others)))]
    second = scene_of(plan.database, other.object, other.face, plan.files, plan.prints)
    place, at = lay_beside(scene.region, second.region, rng)
    touch = replace(_draw_anywhere(rng, ranges), x_mm=float(at[0]), y_mm=float(at[1]))
    surface = SideBySide(scene.surface, second.surface, place)

    def met(at: Touch) -> MetSurface:
        return MetSurface(surface, at, scene, (second, place.touch_inside(at)), met)

    return met(touch)


@lru_cache(maxsize=8)
def _faces_of_lab(database: str) -> list[tuple[str, str]]:
    """Return the objects and faces of another lab that bear symbols, in order."""
    return [
        (name, face.name)
        for name in registered_objects(database)
        for face in registered_object(database, name).faces
        if face.placement is not None
    ]


def _ranges(plan: TouchPlan, level: Level, sensor: SensorType) -> TouchRanges:
    """Return forces and tilts of a plan, or those of a level that has its own.

    Forces are those on `fsr-16`; another sensor is pressed as hard for its area.
    """
    tilt = plan.tilt_rad if level.tilt_rad is None else level.tilt_rad
    share = math.prod(sensor.half_mm) / math.prod(SensorType().half_mm)
    low, high = level.force_n or plan.force_n
    return TouchRanges(force_n=(low * share, high * share), tilt_rad=tilt)


def _datum(scene: Scene | None) -> tuple[float, float]:
    """Return what stays in its place when a print shrinks: the middle of the face."""
    if scene is None:
        return 0.0, 0.0
    x, y = scene.centre_mm().tolist()
    return x, y


@lru_cache(maxsize=4)
def _copy_of_run(seed: int, sensor: SensorType) -> SensorCopy:
    """Return the one sensor of a run."""
    return draw_copy(sensor, np.random.default_rng([seed, 0, 4]))


@lru_cache(maxsize=512)
def _by_name(encoding: EmbossedArray, kind: str, prints: str = "", only: str = "") -> list[int]:
    """Return the faces that a kind touches, in the order of their objects' names.

    With prints, those that were printed alone; with a face named, that one.

    Their numbers follow the order of registration, which a set made in parallel leaves to chance.
    """
    faces, names = encoding.faces.tolist(), encoding.names
    found = sorted(range(len(faces)), key=lambda n: (names[faces[n][0]], faces[n][1]))
    found = [n for n in found if is_extra(names[faces[n][0]], kind)]
    if kind == SIDE:  # round faces roll away from each other
        found = [n for n in found if encoding.face(n).round is None]
    if only:
        whole = {n: encoding.face(n) for n in found if only.startswith(names[faces[n][0]])}
        found = [n for n, face in whole.items() if f"{face.object}/{face.face}" == only]
    if not prints:
        return found
    from probe.simulate.printed import read_listing

    printed = read_listing(prints).keys
    shown = {n: encoding.face(n) for n in found}
    return [n for n, face in shown.items() if (face.object, face.face) in printed]


def level_of(plan: TouchPlan) -> Level:
    """Return what is wrong with the sensor; a printed surface brings the print's faults itself."""
    level = LEVELS[plan.level]
    return replace(level, wider_mm=0.0, scale=0.0) if plan.prints else level


@lru_cache(maxsize=512)
def scene_of(database: str, object_name: str, face: str, files: bool, prints: str = "") -> Scene:
    """Return a face as it was printed, as it was written, or as the database says that it is."""
    if prints:
        from probe.simulate.printed import printed_scene

        return printed_scene(prints, database, object_name, face)
    if files:
        return written_surface(database, object_name, face)
    return registered_surface(database, object_name, face)


def _draw_on_face(
    scene: Scene, kind: str, most: float, rng: np.random.Generator, ranges: TouchRanges
) -> Touch:
    """Draw a touch of a face; where a face is too small for its kind, anywhere on it."""
    inside = DRAWING.inside_mm
    if kind == "corner":
        touch = next(random_touches(scene.region, rng, ranges))
        corner = scene.region.starts[int(rng.integers(len(scene.region.starts)))]
        towards = np.array([touch.x_mm, touch.y_mm]) - corner
        by = inside * rng.random() / max(float(np.hypot(*towards)), inside)
        at = corner + towards * by
        return replace(touch, x_mm=float(at[0]), y_mm=float(at[1]))
    if kind == "edge":
        for touch in random_touches(scene.region, rng, ranges):
            if scene.region.distance_mm(np.array([[touch.x_mm, touch.y_mm]]))[0] < inside:
                return touch
    margin = 0.0 if kind == "anywhere" else min(inside, 0.8 * most)
    return next(random_touches(scene.region, rng, replace(ranges, margin_mm=margin)))


@lru_cache(maxsize=512)
def _inradius_mm(
    database: str, object_name: str, face: str, files: bool, prints: str = ""
) -> float:
    """Return how far the inmost point of a face lies from its edges, mm, nearly."""
    scene = scene_of(database, object_name, face, files, prints)
    low, high = scene.region.box_mm
    x, y = (low + (high - low) * np.linspace(0, 1, 64)[:, None]).T
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    points = points[scene.region.contains(points)]
    return float(scene.region.distance_mm(points).max())


def _draw_anywhere(rng: np.random.Generator, ranges: TouchRanges) -> Touch:
    low, high = ranges.force_n
    theta, towards = rng.uniform(-math.pi, math.pi, 2)
    tilt = ranges.tilt_rad * math.sqrt(rng.random())
    x, y = rng.uniform(0, 100, 2)
    return Touch(
        x_mm=float(x),
        y_mm=float(y),
        theta_rad=float(theta),
        force_n=float(rng.uniform(low, high)),
        tilt_x_rad=tilt * math.cos(towards),
        tilt_y_rad=tilt * math.sin(towards),
    )


def sensor_of(sensor_type: str, overlay: str) -> SensorType:
    """Return the sensor type of a campaign, given as YAML, with the overlay that it names."""
    return choose_sensor_type(None, sensor_type, None, "--sensor-type").with_overlay(overlay)
