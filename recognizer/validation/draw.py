"""What is touched, where, and what the sensor reads. Nothing but its number decides a touch.

TouchPlan + number -> DrawnTouch. It is drawn from `default_rng([seed, number])`, so any touch
can be repeated by its number, in any order and on any machine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.sensor import Overlay, SensorType
from probe.simulate.registered import registered_surface
from probe.simulate.scene import Scene
from probe.simulate.touch import TouchRanges, random_touches
from probe.simulate.world.levels import LEVELS, Level
from probe.simulate.world.reading import read_sensor
from probe.simulate.world.sensor_copy import SensorCopy, draw_copy
from probe.simulate.world.worn import wear_face, wear_part
from probe.surface.contract import HeightMap
from probe.surface.face import FaceSurface
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.reader import Reader
from recognizer.validation.settings import DRAWING
from recognizer.validation.surfaces import FOREIGN
from recognizer.validation.written import written_surface

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TouchPlan:
    """What is drawn.

    `kind` is `face` (the sensor's centre at least `inside_mm` from the edges), `edge` (nearer
    than that), `corner` (within `inside_mm` of a corner), `worn` (a face with a share of its
    symbols gone), or one of the surfaces of `surfaces.FOREIGN`.
    """

    database: str
    seed: int = 1
    level: str = "typical"
    kind: str = "face"
    force_n: tuple[float, float] = DRAWING.force_n
    tilt_rad: float = DRAWING.tilt_rad
    worn: float = DRAWING.worn
    files: bool = False  #: touch the written STL files, not what the database says of them
    engine: str = "own"  #: of contact, `probe.contact.engines`
    sensor_per: str = "touch"  #: or `run`: the errors of the sensor stay the same


@dataclass(frozen=True, slots=True, eq=False)
class DrawnTouch:
    """What is touched, and what the sensor reads."""

    surface: HeightMap
    scene: Scene | None  #: None for a foreign surface
    touch: Touch
    counts: NDArray[np.uint16]
    drawn_anew: tuple[str, ...] = ()  #: why, for each time that the plate did not come to rest


def draw_touch(plan: TouchPlan, number: int, reader: Reader) -> DrawnTouch:
    """Return what is touched in a trial, and the reading."""
    rng = np.random.default_rng([plan.seed, number])
    level = LEVELS[plan.level]
    ranges = _ranges(plan, level)
    copy = _copy_of_run(plan.seed, reader.sensor) if plan.sensor_per == "run" else None
    encoding = reader.lab.arrays[int(rng.integers(len(reader.lab.arrays)))]
    anew: list[str] = []
    while True:
        scene: Scene | None = None
        surface: HeightMap
        if plan.kind in FOREIGN:
            surface = FOREIGN[plan.kind](encoding, rng)
            touch = _draw_anywhere(rng, ranges)
        else:
            face = encoding.face(_by_name(encoding)[int(rng.integers(len(encoding.faces)))])
            scene = scene_of(plan.database, face.object, face.face, plan.files)
            most = _inradius_mm(plan.database, face.object, face.face, plan.files)
            touch = _draw_on_face(scene, plan.kind, most, rng, ranges)
            surface = scene.under(touch).surface
            if plan.kind == "worn" and isinstance(surface, FaceSurface):
                surface = wear_face(surface, plan.worn, rng)
            elif plan.kind == "worn":
                pitch = encoding.style.pitch_mm
                at, turn = face.centres_mm, face.rotation_rad
                surface = wear_part(surface, at, turn, pitch, plan.worn, rng)
        try:
            counts, _ = read_sensor(
                surface, reader.sensor, touch, level, rng, plan.engine,
                datum_mm=_datum(scene), copy=copy,
            )  # fmt: skip
        except ContactError as error:
            anew.append(DRAWING.why_anew(error.cause))
            continue
        return DrawnTouch(surface, scene, touch, counts, tuple(anew))


def _ranges(plan: TouchPlan, level: Level) -> TouchRanges:
    """Return forces and tilts of a plan, or those of a level that has its own."""
    tilt = plan.tilt_rad if level.tilt_rad is None else level.tilt_rad
    return TouchRanges(force_n=level.force_n or plan.force_n, tilt_rad=tilt)


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


@lru_cache(maxsize=8)
def _by_name(encoding: EmbossedArray) -> list[int]:
    """Return the faces in the order of their objects' names.

    Their numbers follow the order of registration, which a set made in parallel leaves to chance.
    """
    faces, names = encoding.faces.tolist(), encoding.names
    return sorted(range(len(faces)), key=lambda n: (names[faces[n][0]], faces[n][1]))


@lru_cache(maxsize=512)
def scene_of(database: str, object_name: str, face: str, files: bool) -> Scene:
    """Return a face as it was written, or as the database says that it is."""
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
    margin = min(inside, 0.8 * most)
    return next(random_touches(scene.region, rng, replace(ranges, margin_mm=margin)))


@lru_cache(maxsize=512)
def _inradius_mm(database: str, object_name: str, face: str, files: bool) -> float:
    """Return how far the inmost point of a face lies from its edges, mm, nearly."""
    scene = scene_of(database, object_name, face, files)
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


def sensor_of(overlay: str) -> SensorType:
    """Return the usual sensor with a tab or a pad overlay."""
    return SensorType(overlay=Overlay(kind="pad" if overlay == "pad" else "tab"))
