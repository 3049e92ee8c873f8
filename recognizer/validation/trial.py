"""One trial: draw a touch, simulate it, read it, compare; a touch as a row of the results.

TouchPlan + number -> Trial -> Row. The reader gets the counts alone. Of a plan whose policy is
`next`, touches follow where the one before proposes, on the same surface and by the same sensor,
a step away that the arm makes not quite as planned; the reader gets the step alone, and reads all
touches so far as one belief (`recognizer.scan`). Where the plate finds no rest, it reads zeros.

Numbers of a row are kept to the digits that mean something (`COLUMNS`), so that two machines whose
libraries differ in the last bit of a sum write the same bytes. CPU times are in rows of their own,
because no two runs agree in them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.errors import ContactError
from probe.scan.places import surface_to_sensor
from recognizer.scan.session import Scan
from recognizer.touch.lab import EncodedFace, Lab
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

#: Says where to touch after an answer that is none; `rng` is the trial's.
Proposal = Callable[[Recognition, np.random.Generator], NextTouch | None]


@dataclass(frozen=True, slots=True)
class Trial:
    """The outcome of a touch."""

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
    drawn_anew: str = ""  #: why the touch was drawn again, each time; ` | ` between
    touches: int = 1  #: until one was answered, or all that were made


def trial(plan: TouchPlan, number: int, reader: Reader) -> Trial:
    """Return the outcome of one touch, or of those that followed it."""
    if plan.policy == NEXT:
        return _trial_of_several(plan, number, reader)
    found = draw_touch(plan, number, reader)
    start = time.process_time()
    answer = recognise(reader, reader.signal(found.counts), number)
    return judge(plan, number, found, answer, time.process_time() - start)


def _trial_of_several(plan: TouchPlan, number: int, reader: Reader) -> Trial:
    """Return the outcome of touches until one was answered: first place, last answer."""
    made = list(touch_until_answered(plan, number, reader, MOST))
    spent = sum(one.seconds for one in made)
    first, last = (judge(plan, number, one.found, one.answer, spent) for one in (made[0], made[-1]))
    return replace(
        first, verdict=last.verdict, reason=last.reason, answer=last.answer,
        error_mm=last.error_mm, error_deg=last.error_deg, chi2=last.chi2, margin=last.margin,
        noise=last.noise, touches=len(made),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class PolicyTouch:
    """A touch of a trial and what all touches so far say."""

    found: DrawnTouch
    answer: Recognition
    seconds: float  #: CPU, of reading


def touch_until_answered(
    plan: TouchPlan,
    number: int,
    reader: Reader,
    most: int,
    proposal: Proposal = lambda answer, _: answer.next,
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
        step = None if answer else proposal(answer, rng)
        if step is None or made == most:
            return
        pose = pose @ surface_to_sensor(step.dx_mm, step.dy_mm, math.radians(step.turn_deg))
        found = _touch_at(plan, found, step, reader, rng)


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
        touch: Touch = draw_tilt(plan, moved, rng)
        try:
            return draw_again(plan, before, touch, reader, rng)
        except ContactError:
            continue
    return replace(before, touch=moved, counts=np.zeros_like(before.counts))


def judge(
    plan: TouchPlan, number: int, found: DrawnTouch, answer: Recognition, seconds: float
) -> Trial:
    """Compare an answer with the truth."""
    scene, touch = found.truth_of(answer.object, answer.face)
    error, degrees, chi2, verdict = math.nan, math.nan, math.nan, REJECTED
    if answer:
        verdict = WRONG
        touched = scene and (scene.object_name, scene.face)
        if (
            (answer.object, answer.face) == touched
            and answer.T_face_probe is not None
            and answer.covariance is not None
        ):
            T = answer.T_face_probe
            turn = math.atan2(T[1, 0], T[0, 0]) - touch.theta_rad
            away = np.array(
                [T[0, 3] - touch.x_mm, T[1, 3] - touch.y_mm, math.remainder(turn, 2 * math.pi)]
            )
            error, degrees = math.hypot(away[0], away[1]), math.degrees(away[2])
            chi2 = float(away @ np.linalg.solve(answer.covariance, away))
            near = error < NEAR_MM and abs(degrees) < NEAR_DEG
            verdict = RIGHT if near else WRONG
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
        drawn_anew=" | ".join(found.resampled),
    )


#: Names and kinds: text, whole, truth, or decimals after the point.
COLUMNS: dict[str, str | int] = {
    "number": "whole",
    "kind": "text",  #: as `campaign.KINDS` names it
    "surface": "text",  #: the kind, or which foreign surface
    "level": "text",
    "object": "text",  #: touched; empty for a foreign surface
    "face": "text",
    "x_mm": 6,
    "y_mm": 6,
    "theta_deg": 6,
    "force_n": 6,
    "tilt_deg": 6,
    "edge_mm": 6,
    "symbols": "whole",  #: registered ones whose centre lies under the sensor
    "enough": "truth",  #: whether that is enough (`JudgeSettings`)
    "verdict": "text",
    "reason": "text",
    "answer": "text",
    "error_mm": 6,
    "error_deg": 6,
    "chi2": 4,
    "margin": 4,
    "noise": 6,
    "touches": "whole",  #: until one was answered, or all that were made
    "drawn_anew": "text",  #: why touches before it were none, ` | ` between; usually empty
}


@dataclass(frozen=True, slots=True)
class CpuTime:
    """CPU seconds of a touch."""

    number: int
    drawing: float  #: surface, contact and reading of the sensor
    reading: float  #: by the recognizer


@dataclass(frozen=True, slots=True)
class SymbolsInView:
    """What of a face is under the sensor."""

    symbols: int
    enough: bool


def row_of(trial: Trial, kind: str, seen: SymbolsInView) -> Row:
    """Return the row of a trial, its numbers as they are kept."""
    row: Row = {}
    given: Row = {
        "kind": kind,
        "surface": trial.kind,
        "symbols": seen.symbols,
        "enough": seen.enough,
    }
    for name, what in COLUMNS.items():
        value = given[name] if name in given else getattr(trial, name)
        row[name] = round(float(value), what) + 0.0 if isinstance(what, int) else value
    return row


def symbols_in_view(lab: Lab, sensor: SensorType, trial: Trial) -> SymbolsInView:
    """Return how many symbols a touch had in view, and whether they were enough.

    Enough is `JudgeSettings.enough` times the cells of the array's window, on a face that is
    not worn.
    """
    found = find_face(lab, trial.object, trial.face)
    if found is None:
        return SymbolsInView(0, enough=False)
    face, window = found
    angle = np.radians(trial.theta_deg)
    c, s = np.cos(angle), np.sin(angle)
    own = (face.centres_mm - (trial.x_mm, trial.y_mm)) @ np.array([[c, -s], [s, c]])
    symbols = int((np.abs(own) < sensor.half_mm).all(axis=1).sum())
    return SymbolsInView(symbols, enough=trial.kind != "worn" and symbols >= ENOUGH * window)


def find_face(lab: Lab, object_name: str, face: str) -> tuple[EncodedFace, int] | None:
    """Return a face of the lab, and the cells of its array's window; None if it is foreign."""
    for encoding in lab.arrays:
        for object_id, name in encoding.names.items():
            if name != object_name:
                continue
            for number in np.flatnonzero(encoding.faces[:, 0] == object_id).tolist():
                held = encoding.face(number)
                if held.face == face:
                    return held, encoding.array.window[0] * encoding.array.window[1]
    return None
