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

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.simulate.scene import Scene
from probe.simulate.touch import TouchRanges
from probe.simulate.world.reading import read_sensor
from probe.simulate.world.sensor_copy import SensorCopy, draw_copy
from probe.simulate.world.side_by_side import SideBySide, lay_beside
from probe.simulate.world.worn import wear_face, wear_part
from probe.surface.contract import HeightMap
from probe.surface.face import FaceSurface
from recognizer.touch.lab import EmbossedArray, EncodedFace
from recognizer.touch.reader import Reader
from recognizer.validation.errors import ValidationError
from recognizer.validation.made_kinds import SAME_PROFILE, SIDE
from recognizer.validation.place import draw_anywhere, draw_on_face, inradius_mm
from recognizer.validation.settings import DRAWING
from recognizer.validation.surfaces import FOREIGN
from recognizer.validation.touch_plan import (
    TouchPlan,
    faces_of_kind,
    faces_of_lab,
    level_of,
    ranges_of,
    scene_of,
)

Array = NDArray[np.float64]


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
    ranges = ranges_of(plan, level_of(plan), reader.sensor)
    copy = _copy_of_run(plan.seed, reader.sensor) if plan.sensor_per == "run" else None
    anew: list[str] = []
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
    tilt = ranges_of(plan, level_of(plan), SensorType()).tilt_rad * math.sqrt(rng.random())
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
        return _met_at(lambda _: foreign, draw_anywhere(rng, ranges), None)
    if plan.kind == SAME_PROFILE:
        lab = plan.labs[int(rng.integers(len(plan.labs)))]
        faces = faces_of_lab(lab)
        name, shown = faces[int(rng.integers(len(faces)))]
        scene = scene_of(lab, name, shown, plan.files)
        touch = draw_on_face(
            scene, plan.kind, inradius_mm(lab, name, shown, plan.files), rng, ranges
        )
        return _met_at(lambda at: scene.under(at).surface, touch, scene)
    known = faces_of_kind(encoding, plan.kind, plan.prints, plan.only)
    face = encoding.face(known[int(rng.integers(len(known)))])
    scene = scene_of(plan.database, face.object, face.face, plan.files, plan.prints)
    if plan.kind == SIDE:
        return _lay_beside(plan, encoding, scene, ranges, rng)
    most = inradius_mm(plan.database, face.object, face.face, plan.files, plan.prints)
    touch = draw_on_face(scene, plan.kind, most, rng, ranges)
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
    faces = [encoding.face(n) for n in faces_of_kind(encoding, SIDE, plan.prints)]
    others = [face for face in faces if face.object != scene.object_name]
    other = others[int(rng.integers(len(others)))]
    second = scene_of(plan.database, other.object, other.face, plan.files, plan.prints)
    place, at = lay_beside(scene.region, second.region, rng)
    touch = replace(draw_anywhere(rng, ranges), x_mm=float(at[0]), y_mm=float(at[1]))
    surface = SideBySide(scene.surface, second.surface, place)

    def met(at: Touch) -> MetSurface:
        return MetSurface(surface, at, scene, (second, place.touch_inside(at)), met)

    return met(touch)


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
