"""Guarded approach: move on until a force is felt, and press no harder than allowed. Thesis 4.3.

Steps of one length until something is felt; then steps chosen by the stiffness that was felt,
short of the force that is wanted, because contacts harden as they are pressed. Giving up is a
value with a reason. The step must be so short that one step from no contact cannot exceed the
force limit: step times the stiffness of wrist and overlay together.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from probe.errors import ContactError

_SHORT = 0.7  #: share of the step that the stiffness so far would ask for
Reason = Literal["contact", "no contact", "force limit", "travel limit", "too stiff"]


@dataclass(frozen=True, slots=True)
class ApproachLimits:
    """What an approach wants, and what it may do."""

    force_n: float = 80.0  #: to be reached
    tolerance_n: float = 1.0  #: either way
    felt_n: float = 0.5  #: from here on something is touched
    most_n: float = 120.0  #: at more, the sensor is lifted at once
    travel_mm: float = 20.0  #: from the start of the approach
    step_mm: float = 0.5  #: while nothing is felt
    finest_mm: float = 1e-4  #: that the arm can do


@dataclass(frozen=True, slots=True)
class Approach:
    """How an approach ended."""

    reason: Reason  #: "contact": the wanted force is there; otherwise why not
    travel_mm: float  #: where the sensor is now, from the start
    force_n: float  #: the last that was felt there

    def __bool__(self) -> bool:
        return self.reason == "contact"


def guarded_approach(
    feel: Callable[[float], float], limits: ApproachLimits | None = None
) -> Approach:
    """Move the sensor on until the wanted force is felt.

    `feel` moves the sensor to a travel (mm from the start, towards the object) and returns the
    force (N) there. After "no contact" and "force limit" the sensor is back at the start.

    Raises
    ------
    ContactError
        Limits that contradict each other, or a force that is no number.

    Examples
    --------
    >>> end = guarded_approach(lambda travel: max(0.0, 8.0 * (travel - 3.0)))
    >>> end.reason, round(end.travel_mm)
    ('contact', 13)
    """
    limits = limits or ApproachLimits()
    _check(limits)
    before = low = (0.0, 0.0)  # travel and force; low is the furthest with too little force
    high: tuple[float, float] | None = None  # the nearest with too much
    at, touched = 0.0, False
    while True:
        force = _feel_n(feel, at)
        touched |= force >= limits.felt_n
        if force > limits.most_n:
            feel(0.0)
            return Approach("force limit", 0.0, force)
        if abs(force - limits.force_n) <= limits.tolerance_n:
            return Approach("contact", at, force)
        if force > limits.force_n:
            high = (at, force)
        else:
            before, low = low, (at, force)
        if high and high[0] - low[0] <= limits.finest_mm:
            return Approach("too stiff", low[0], _feel_n(feel, low[0]))
        if not high and low[0] >= limits.travel_mm:
            if touched:
                return Approach("travel limit", at, force)
            feel(0.0)
            return Approach("no contact", 0.0, force)
        at = (
            _interpolate_travel(low, high, limits) if high else _advance_travel(before, low, limits)
        )


def _advance_travel(
    before: tuple[float, float], low: tuple[float, float], limits: ApproachLimits
) -> float:
    """Return the next travel while the force is still too small."""
    step = limits.step_mm
    if low[1] >= limits.felt_n:
        stiffness = (low[1] - before[1]) / max(low[0] - before[0], limits.finest_mm)
        wanted = _SHORT * (limits.force_n - low[1])
        step = min(step, wanted / stiffness) if stiffness > 0 else step / 4
    return min(low[0] + max(step, limits.finest_mm), limits.travel_mm)


def _interpolate_travel(
    low: tuple[float, float], high: tuple[float, float], limits: ApproachLimits
) -> float:
    """Return the next travel between too little and too much, by proportion."""
    share = (limits.force_n - low[1]) / (high[1] - low[1])
    return low[0] + min(max(share, 0.1), 0.9) * (high[0] - low[0])


def _feel_n(feel: Callable[[float], float], travel: float) -> float:
    force = float(feel(travel))
    if not math.isfinite(force):
        raise ContactError(
            f"the force at {travel:.4g} mm is {force}", fix="check the sensor and its calibration"
        )
    return force


def _check(limits: ApproachLimits) -> None:
    rising = 0 < limits.felt_n <= limits.force_n - limits.tolerance_n
    rising = rising and limits.force_n + limits.tolerance_n <= limits.most_n < math.inf
    steps = 0 < limits.finest_mm <= limits.step_mm <= limits.travel_mm < math.inf
    if not (rising and steps and limits.tolerance_n > 0):
        raise ContactError(
            f"limits that contradict each other: {limits}",
            fix="felt_n < force_n < most_n, and finest_mm < step_mm < travel_mm, all above 0",
        )
