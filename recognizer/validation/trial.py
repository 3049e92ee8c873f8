"""One trial: draw a touch, simulate it, read it, compare.

TouchPlan + number -> Trial. The reader gets the counts alone; of a plan whose policy is `next` also
the steps between touches, and what became of the trial is what the last touch said.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.recognition import Recognition
from recognizer.validation.draw import DrawnTouch, draw_touch
from recognizer.validation.policy import NEXT, touch_until_answered
from recognizer.validation.settings import JUDGING, POLICIES
from recognizer.validation.touch_plan import TouchPlan

RIGHT, WRONG, REJECTED = "right", "wrong", "rejected"


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
    drawn_anew: str = ""  #: why the touch was drawn again, each time; ` | ` between
    touches: int = 1  #: until one was answered, or all that were made


def trial(plan: TouchPlan, number: int, reader: Reader) -> Trial:
    """Return what became of one touch, or of those that followed it."""
    if plan.policy == NEXT:
        return _trial_of_several(plan, number, reader)
    found = draw_touch(plan, number, reader)
    start = time.process_time()
    answer = recognise(reader, reader.signal(found.counts), number)
    return judge(plan, number, found, answer, time.process_time() - start)


def _trial_of_several(plan: TouchPlan, number: int, reader: Reader) -> Trial:
    """Return what became of touches until one was answered: the first one's place, the last's fate.

    A touch that is not answered is of the place of the first.
    """
    made = list(touch_until_answered(plan, number, reader, POLICIES.most))
    spent = sum(one.seconds for one in made)
    first, last = (judge(plan, number, one.found, one.answer, spent) for one in (made[0], made[-1]))
    return replace(
        first, verdict=last.verdict, reason=last.reason, answer=last.answer,
        error_mm=last.error_mm, error_deg=last.error_deg, chi2=last.chi2, margin=last.margin,
        noise=last.noise, touches=len(made),
    )  # fmt: skip


def judge(
    plan: TouchPlan, number: int, found: DrawnTouch, answer: Recognition, seconds: float
) -> Trial:
    """Compare an answer with the truth."""
    scene, touch = found.truth_of(answer.object, answer.face)
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
            near = error < JUDGING.near_mm and abs(degrees) < JUDGING.near_deg
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
