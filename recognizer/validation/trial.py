"""One trial: draw a touch, simulate it, read it, compare. Nothing but its number decides it.

Plan + number -> Trial. The reader gets the counts alone. A trial is drawn from
`default_rng([seed, number])`, so any of them can be repeated by its number, in any order and
on any machine.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.sensor import SensorType
from probe.simulate.registered import registered_surface
from probe.simulate.scene import Scene
from probe.simulate.touch import Touches, random_touches
from probe.surface.contract import Surface
from probe.surface.face import Face
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.recognition import Recognition
from recognizer.touch.signal import signal_of
from recognizer.validation.levels import LEVELS, read
from recognizer.validation.surfaces import FOREIGN, worn
from recognizer.validation.written import worn_away, written_surface

Array = NDArray[np.float64]

RIGHT, WRONG, REJECTED = "right", "wrong", "rejected"
INSIDE_MM = 9.0  #: of a face: its edges are at least so far from the sensor's centre
NEAR_MM = 2.0  #: an answer farther from the truth is wrong


@dataclass(frozen=True, slots=True)
class Plan:
    """What is drawn.

    `kind` is `face` (the sensor's centre at least `INSIDE_MM` from the edges), `edge` (nearer
    than that), `corner` (within `INSIDE_MM` of a corner), `worn` (a face with a share of its
    symbols gone), or one of the surfaces of `surfaces.FOREIGN`.
    """

    database: str
    seed: int = 1
    level: str = "typical"
    kind: str = "face"
    force_n: tuple[float, float] = (20.0, 120.0)
    tilt_rad: float = math.radians(2.0)
    worn: float = 0.2
    files: bool = False  #: touch the written STL files, not what the database says of them


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """What is touched, and what the sensor reads."""

    surface: Surface
    scene: Scene | None  #: None for a foreign surface
    touch: Touch
    counts: NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class Trial:
    """What became of a touch."""

    number: int
    kind: str
    level: str
    object: str  #: touched; empty for a foreign surface
    face: str
    x_mm: float
    y_mm: float
    theta_deg: float
    force_n: float
    tilt_deg: float
    edge_mm: float  #: from the sensor's centre to the nearest edge of the face
    verdict: str  #: right, wrong, rejected
    reason: str
    answer: str  #: object/face, empty if rejected
    error_mm: float  #: nan if not right
    error_deg: float
    chi2: float  #: squared pose error over the covariance, 3 degrees of freedom
    margin: float  #: nan where there is none
    noise: float
    seconds: float  #: CPU, of reading


def drawn(plan: Plan, number: int, reader: Reader) -> Drawn:
    """Return what is touched in a trial, and the reading."""
    rng = np.random.default_rng([plan.seed, number])
    level = LEVELS[plan.level]
    ranges = Touches(force_n=plan.force_n, tilt_rad=plan.tilt_rad)
    encoding = reader.lab.arrays[int(rng.integers(len(reader.lab.arrays)))]
    while True:
        scene: Scene | None = None
        surface: Surface
        if plan.kind in FOREIGN:
            surface = FOREIGN[plan.kind](encoding, rng)
            touch = _anywhere(rng, ranges)
        else:
            face = encoding.face(_by_name(encoding)[int(rng.integers(len(encoding.faces)))])
            scene = scene_of(plan.database, face.object, face.face, plan.files)
            most = _inmost(plan.database, face.object, face.face, plan.files)
            touch = _on(scene, plan.kind, most, rng, ranges)
            surface = scene.under(touch).surface
            if plan.kind == "worn" and isinstance(surface, Face):
                surface = worn(surface, plan.worn, rng)
            elif plan.kind == "worn":
                pitch = encoding.style.pitch_mm
                surface = worn_away(surface, face, pitch, plan.worn, rng)
        try:
            counts, _ = read(surface, reader.sensor, touch, level, rng)
        except ContactError:
            continue  # the plate slips off: no touch
        return Drawn(surface, scene, touch, counts)


def trial(plan: Plan, number: int, reader: Reader) -> Trial:
    """Return what became of one touch."""
    found = drawn(plan, number, reader)
    start = time.process_time()
    answer = recognise(reader, signal_of(found.counts.astype(np.float64)), number)
    return judged(plan, number, found, answer, time.process_time() - start)


def judged(plan: Plan, number: int, found: Drawn, answer: Recognition, seconds: float) -> Trial:
    """Compare an answer with the truth."""
    touch, scene = found.touch, found.scene
    error, degrees, chi2, verdict = math.nan, math.nan, math.nan, REJECTED
    if answer:
        verdict = WRONG
        same = scene is not None and (answer.object, answer.face) == (
            scene.object_name,
            scene.face,
        )
        if same and answer.T_face_probe is not None and answer.covariance is not None:
            T = answer.T_face_probe
            turn = math.atan2(T[1, 0], T[0, 0]) - touch.theta_rad
            away = np.array(
                [T[0, 3] - touch.x_mm, T[1, 3] - touch.y_mm, math.remainder(turn, 2 * math.pi)]
            )
            error, degrees = math.hypot(away[0], away[1]), math.degrees(away[2])
            chi2 = float(away @ np.linalg.solve(answer.covariance, away))
            verdict = RIGHT if error < NEAR_MM else WRONG
    edge = math.nan
    if scene is not None:
        edge = float(scene.region.distance_mm(np.array([[touch.x_mm, touch.y_mm]]))[0])
    return Trial(
        number=number,
        kind=plan.kind,
        level=plan.level,
        object=scene.object_name if scene else "",
        face=scene.face if scene else "",
        x_mm=touch.x_mm,
        y_mm=touch.y_mm,
        theta_deg=math.degrees(touch.theta_rad),
        force_n=touch.force_n,
        tilt_deg=math.degrees(math.hypot(touch.tilt_x_rad, touch.tilt_y_rad)),
        edge_mm=edge,
        verdict=verdict,
        reason=answer.reason,
        answer=f"{answer.object}/{answer.face}" if answer else "",
        error_mm=error,
        error_deg=degrees,
        chi2=chi2,
        margin=math.nan if answer.margin is None else answer.margin,
        noise=math.nan if answer.noise is None else answer.noise,
        seconds=seconds,
    )


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


def _on(scene: Scene, kind: str, most: float, rng: np.random.Generator, ranges: Touches) -> Touch:
    """Draw a touch of a face; where a face is too small for its kind, anywhere on it."""
    if kind == "corner":
        touch = next(random_touches(scene.region, rng, ranges))
        corner = scene.region.starts[int(rng.integers(len(scene.region.starts)))]
        towards = np.array([touch.x_mm, touch.y_mm]) - corner
        by = INSIDE_MM * rng.random() / max(float(np.hypot(*towards)), INSIDE_MM)
        at = corner + towards * by
        return _moved(touch, float(at[0]), float(at[1]))
    if kind == "edge":
        for touch in random_touches(scene.region, rng, ranges):
            if scene.region.distance_mm(np.array([[touch.x_mm, touch.y_mm]]))[0] < INSIDE_MM:
                return touch
    margin = min(INSIDE_MM, 0.8 * most)
    given = Touches(ranges.force_n, ranges.tilt_rad, margin, ranges.wrist)
    return next(random_touches(scene.region, rng, given))


def _moved(touch: Touch, x: float, y: float) -> Touch:
    return Touch(
        x, y, touch.theta_rad, touch.force_n, touch.tilt_x_rad, touch.tilt_y_rad, touch.wrist
    )


@lru_cache(maxsize=512)
def _inmost(database: str, object_name: str, face: str, files: bool) -> float:
    """Return how far the inmost point of a face lies from its edges, mm, nearly."""
    scene = scene_of(database, object_name, face, files)
    low, high = scene.region.box_mm
    x, y = (low + (high - low) * np.linspace(0, 1, 64)[:, None]).T
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    points = points[scene.region.contains(points)]
    return float(scene.region.distance_mm(points).max())


def _anywhere(rng: np.random.Generator, ranges: Touches) -> Touch:
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
    from probe.sensor import Overlay

    return SensorType(overlay=Overlay(kind="pad" if overlay == "pad" else "tab"))
