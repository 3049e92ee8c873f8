"""One trial: draw a touch, simulate it, read it, compare with the truth.

TouchPlan + number -> Trial, a row of the results. The reader gets the counts alone. Of a plan whose
policy is `next`, touches follow where the one before proposes, on the same surface and by the same
sensor, a step away that the arm makes not quite as planned; the reader gets the step alone, and
reads all touches of the trial as one belief (`recognizer.scan`). Where the plate finds no rest, it
reads zeros.

Numbers of a row are kept to the digits that mean something, so that two machines whose libraries
differ in the last bit of a sum write the same bytes. CPU times are in rows of their own, because no
two runs agree in them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.database.round_face import RoundFace
from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.scan import surface_to_sensor
from recognizer.scan.session import Scan
from recognizer.touch.lab import find_face
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.recognition import NextTouch, Recognition
from recognizer.validation.draw import DrawnTouch, draw_again, draw_tilt, draw_touch
from recognizer.validation.touch_plan import TouchPlan

#: An answer farther from the truth is wrong: under half of the finest pitch (4.5 mm), so that the
#: next cell is never taken for the true one.
NEAR_MM = 2.0
#: An answer turned farther is wrong: a mounting a quarter turn off, or a symbol that looks alike
#: when turned; right ones are within 3 degrees.
NEAR_DEG = 10.0
#: Symbols in view over those of a window, from which an answer is expected: as many as a window has
#: need not stand as a window.
ENOUGH = 1.5
MOST = 3  #: touches until one is answered
STEP_OFF_MM = 0.3  #: standard deviation of an arm's step, along x and along y
TURN_OFF_RAD = math.radians(0.2)  #: of its turn
FORCE_OFF = 0.1  #: of the logarithm of the force
TRIES = 4  #: tilts of the wrist that are drawn until the plate finds a rest
STREAM = 7  #: of random numbers, apart from those that draw the first touch

RIGHT, WRONG, REJECTED = "right", "wrong", "rejected"
ONE, NEXT = POLICY_NAMES = ("one", "next")

Row = dict[str, Any]
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Trial:
    """The outcome of a touch: all but `seconds` are the columns of a row."""

    number: int
    kind: str  #: as `campaign.KINDS` names it
    surface: str  #: the kind, or which foreign surface
    level: str
    object: str  #: touched; empty for a foreign surface
    face: str
    x_mm: float  #: of the sensor, face frame
    y_mm: float
    theta_deg: float
    force_n: float
    tilt_deg: float
    edge_mm: float  #: from the sensor's centre to the nearest edge of the face
    symbols: int  #: registered ones whose centre lies under the sensor
    enough: bool  #: whether these are `ENOUGH` windows, on a face that is not worn
    verdict: str  #: right, wrong, rejected
    reason: str
    answer: str  #: object/face, empty if rejected
    error_mm: float  #: nan if not right
    error_deg: float
    chi2: float  #: squared pose error over the covariance, 3 degrees of freedom
    margin: float  #: nan where there is none
    noise: float
    touches: int = 1  #: until one was answered, or all that were made
    drawn_anew: str = ""  #: why touches before it were none, ` | ` between; usually empty
    seconds: float = 0.0  #: CPU, of reading

    def row(self) -> Row:
        """Return the columns, numbers as they are kept; -0 becomes 0."""
        found = {name: getattr(self, name) for name in COLUMNS}
        for name, kind in COLUMNS.items():
            if kind == "float":
                found[name] = round(float(found[name]), DECIMALS.get(name, 6)) + 0.0
        return found


#: Columns of a row and their types: str, int, bool, float.
COLUMNS = {field.name: str(field.type) for field in fields(Trial) if field.name != "seconds"}
DECIMALS = {"chi2": 4, "margin": 4}  #: after the point; 6 of the others
OF_ANSWER = ("verdict", "reason", "answer", "error_mm", "error_deg", "chi2", "margin", "noise")


def trial(plan: TouchPlan, number: int, reader: Reader) -> Trial:
    """Return the outcome of one touch, or of those that followed it: first place, last answer."""
    reader = plan.knowing(reader)
    return judge_all(plan, number, touches_of(plan, number, reader), reader)


@dataclass(frozen=True, slots=True, eq=False)
class PolicyTouch:
    """A touch of a trial, and the answer by all touches made by then."""

    found: DrawnTouch
    answer: Recognition
    seconds: float  #: CPU, of reading


def touches_of(plan: TouchPlan, number: int, reader: Reader) -> list[PolicyTouch]:
    """Return the touches of a trial, read: one, or those that follow each other."""
    if plan.policy == NEXT:
        return list(touch_until_answered(plan, number, reader, MOST))
    found = draw_touch(plan, number, reader)
    start = time.process_time()
    answer = recognise(reader, reader.signal(found.counts), number)
    return [PolicyTouch(found, answer, time.process_time() - start)]


def touch_until_answered(
    plan: TouchPlan, number: int, reader: Reader, most: int
) -> Iterator[PolicyTouch]:
    """Yield the touches of a trial, the last one answered unless `most` were made."""
    rng = np.random.default_rng([plan.seed, number, STREAM])
    found = draw_touch(plan, number, reader)
    scan, pose, made = Scan(reader), np.eye(4), 0
    while True:
        start = time.process_time()
        answer = scan.add(found.counts.astype(np.float64), pose, seq=number)
        made += 1
        yield PolicyTouch(found, answer, time.process_time() - start)
        step = answer.next
        if answer or step is None or made == most:
            return
        pose = pose @ surface_to_sensor(step.dx_mm, step.dy_mm, math.radians(step.turn_deg))
        found = _touch_at(plan, found, step, reader, rng)


def judge_all(plan: TouchPlan, number: int, made: list[PolicyTouch], reader: Reader) -> Trial:
    """Return the outcome of touches that followed each other: first place, last answer."""
    spent = sum(one.seconds for one in made)
    first = judge(plan, number, made[0].found, made[0].answer, reader, spent)
    if len(made) == 1:
        return first
    last = judge(plan, number, made[-1].found, made[-1].answer, reader)
    answered = {name: getattr(last, name) for name in OF_ANSWER}
    return replace(first, touches=len(made), **answered)


def _touch_at(
    plan: TouchPlan, before: DrawnTouch, step: NextTouch, reader: Reader, rng: np.random.Generator
) -> DrawnTouch:
    """Return the touch after a step as the arm makes it."""
    at, off = before.touch, rng.standard_normal(4)
    dx, dy = step.dx_mm + STEP_OFF_MM * off[0], step.dy_mm + STEP_OFF_MM * off[1]
    x, y = at.on_surface(np.array([dx, dy])).tolist()
    turn = math.radians(step.turn_deg) + TURN_OFF_RAD * off[2]
    force = step.force_n * math.exp(FORCE_OFF * off[3])
    moved = replace(at, x_mm=x, y_mm=y, theta_rad=at.theta_rad + turn, force_n=force)
    for _ in range(TRIES):
        try:
            return draw_again(plan, before, draw_tilt(plan, moved, rng), reader, rng)
        except ContactError:
            continue
    return replace(before, touch=moved, counts=np.zeros_like(before.counts))


def judge(
    plan: TouchPlan,
    number: int,
    found: DrawnTouch,
    answer: Recognition,
    reader: Reader,
    seconds: float = 0.0,
) -> Trial:
    """Compare an answer with the truth; `seconds` is the CPU time of reading."""
    scene, touch = found.truth_of(answer.object, answer.face)
    held = find_face(reader.lab, scene.object_name, scene.face) if scene else None
    error, degrees, chi2, verdict = math.nan, math.nan, math.nan, REJECTED
    if answer:
        verdict = WRONG
        touched = scene and (scene.object_name, scene.face)
        T = answer.T_face_probe
        if (answer.object, answer.face) == touched and T is not None and (
            answer.covariance is not None
        ):  # fmt: skip
            away = _away(T, touch)
            if math.hypot(away[0], away[1]) >= NEAR_MM:
                bent = reader.lab.arrays[held[0]].face(held[1]).round if held else None
                if bent is not None:
                    away = _away(T, _across_seam(bent, T, touch))
            error, degrees = math.hypot(away[0], away[1]), math.degrees(away[2])
            chi2 = float(away @ np.linalg.solve(answer.covariance, away))
            verdict = RIGHT if error < NEAR_MM and abs(degrees) < NEAR_DEG else WRONG
    edge, symbols, enough = math.nan, 0, False
    if scene is not None:
        edge = float(scene.region.distance_mm(np.array([[touch.x_mm, touch.y_mm]]))[0])
        if held is not None:
            encoding = reader.lab.arrays[held[0]]
            own = touch.on_sensor(encoding.face(held[1]).centres_mm)
            symbols = int((np.abs(own) < reader.sensor.half_mm).all(axis=1).sum())
            enough = plan.kind != "worn" and symbols >= ENOUGH * math.prod(encoding.array.window)
    return Trial(
        number=number,
        kind=plan.counted_as or plan.kind,
        surface=plan.kind,
        level=plan.level,
        object=scene.object_name if scene else "",
        face=scene.face if scene else "",
        x_mm=touch.x_mm,
        y_mm=touch.y_mm,
        theta_deg=math.degrees(touch.theta_rad),
        force_n=touch.force_n,
        tilt_deg=math.degrees(math.hypot(touch.tilt_x_rad, touch.tilt_y_rad)),
        edge_mm=edge,
        symbols=symbols,
        enough=enough,
        verdict=verdict,
        reason=answer.reason,
        answer=f"{answer.object}/{answer.face}" if answer else "",
        error_mm=error,
        error_deg=degrees,
        chi2=chi2,
        margin=math.nan if answer.margin is None else answer.margin,
        noise=math.nan if answer.noise is None else answer.noise,
        drawn_anew=" | ".join(found.resampled),
        seconds=seconds,
    )


def _away(T_face_probe: Array, touch: Touch) -> Array:
    """Return how far an answer is from a touch: x, y, turn."""
    turn = math.atan2(T_face_probe[1, 0], T_face_probe[0, 0]) - touch.theta_rad
    x, y = T_face_probe[:2, 3]
    return np.array([x - touch.x_mm, y - touch.y_mm, math.remainder(turn, math.tau)])


def _across_seam(face: RoundFace, T_face_probe: Array, touch: Touch) -> Touch:
    """Return a touch of a round face as it stands in the plane that touches where the answer is.

    The unrolled plane has a place beside the seam of a closed face twice; the object has it once.
    """
    T_object_plane = face.tangent(float(T_face_probe[0, 3]), float(T_face_probe[1, 3]))
    T = np.linalg.solve(T_object_plane, face.tangent(touch.x_mm, touch.y_mm))
    x, y = (T @ (touch.x_mm, touch.y_mm, 0.0, 1.0))[:2].tolist()
    c, s = (T[:2, :2] @ (math.cos(touch.theta_rad), math.sin(touch.theta_rad))).tolist()
    return replace(touch, x_mm=x, y_mm=y, theta_rad=math.atan2(s, c))
