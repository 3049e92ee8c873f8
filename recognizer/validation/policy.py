"""Touches until one is answered: each where the one before says, on the same surface.

TouchPlan + number -> the touches of a trial, each with its answer. The first is that of the policy
`one`. Every further one is really made in simulation, by the same sensor, a step away that the arm
makes not quite as it was told; the reader hears the step alone, and reads all touches so far as
one belief (`recognizer.scan`). Where the plate finds no rest, nothing is felt.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.errors import ContactError
from recognizer.scan.session import Scan
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import NextTouch, Recognition
from recognizer.validation.draw import DrawnTouch, draw_again, draw_tilt, draw_touch
from recognizer.validation.settings import POLICIES
from recognizer.validation.touch_plan import TouchPlan

Array = NDArray[np.float64]

ONE, NEXT = POLICY_NAMES = ("one", "next")

#: Says where to touch after an answer that is none; `rng` is the trial's.
Proposal = Callable[[Recognition, np.random.Generator], NextTouch | None]


@dataclass(frozen=True, slots=True, eq=False)
class PolicyTouch:
    """A touch of a trial and what all touches so far say."""

    found: DrawnTouch
    answer: Recognition
    seconds: float  #: CPU, of reading


def as_told(answer: Recognition, _rng: np.random.Generator) -> NextTouch | None:
    """Return what the answer proposes."""
    return answer.next


def touch_until_answered(
    plan: TouchPlan,
    number: int,
    reader: Reader,
    most: int,
    proposal: Proposal = as_told,
) -> Iterator[PolicyTouch]:
    """Yield the touches of a trial, the last one answered unless `most` were made."""
    rng = np.random.default_rng([plan.seed, number, POLICIES.stream])
    found = draw_touch(plan, number, reader)
    scan, pose, told = Scan(reader), np.eye(4), 0
    while True:
        start = time.process_time()
        answer = scan.add(found.counts.astype(np.float64), pose, seq=number)
        told += 1
        yield PolicyTouch(found, answer, time.process_time() - start)
        step = None if answer else proposal(answer, rng)
        if step is None or told == most:
            return
        pose = pose @ _step_pose(step)
        found = _touch_at(plan, found, step, reader, rng)


def _step_pose(step: NextTouch) -> Array:
    """Return (4, 4) of a step in the frame before it."""
    turn = math.radians(step.turn_deg)
    T = np.eye(4)
    T[:2, :2] = [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
    T[:2, 3] = step.dx_mm, step.dy_mm
    return T


def _touch_at(
    plan: TouchPlan, before: DrawnTouch, step: NextTouch, reader: Reader, rng: np.random.Generator
) -> DrawnTouch:
    """Return the touch after a step as the arm makes it."""
    at, off = before.touch, rng.standard_normal(4)
    dx, dy = step.dx_mm + POLICIES.off_mm * off[0], step.dy_mm + POLICIES.off_mm * off[1]
    x, y = at.on_surface(np.array([dx, dy])).tolist()
    turn = math.radians(step.turn_deg) + POLICIES.off_rad * off[2]
    force = step.force_n * math.exp(POLICIES.force * off[3])
    moved = replace(at, x_mm=x, y_mm=y, theta_rad=at.theta_rad + turn, force_n=force)
    for _ in range(POLICIES.tries):
        touch: Touch = draw_tilt(plan, moved, rng)
        try:
            return draw_again(plan, before, touch, reader, rng)
        except ContactError:
            continue
    return replace(before, touch=moved, counts=np.zeros_like(before.counts))
