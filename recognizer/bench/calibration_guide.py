"""Calibrate a load at a time: what to put on, what was felt, and at the end the laws.

The first step is the unloaded sensor, then one step per load. Each is read for a few seconds
and may be read again. Thesis 4.2, appendix 4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.calibration import Calibration, Condition, calibration_from, even_load
from probe.calibration.load import LEAST_FRAMES, describe_load
from probe.circuit import Electronics
from probe.frame import Frame
from recognizer.bench.errors import BenchError, BusyError
from recognizer.bench.settings import GUIDE

Counts = NDArray[np.uint16]


@dataclass(slots=True)
class CalibrationGuide:
    """A mutable value: a calibration that is being made."""

    sensor: str
    forces_n: tuple[float, ...]  #: without the rest
    seconds: float
    board: Electronics | None
    made: str
    step: int = 0
    taken: list[Counts] = field(default_factory=list)  #: of the steps that are done
    felt: list[str] = field(default_factory=list)
    _frames: list[Counts] | None = None  #: while a step is read
    _began_ns: int = 0
    _news: int = 0  #: frames of them that differ from the one before

    @property
    def steps(self) -> int:
        """How many loads there are, the unloaded sensor among them."""
        return 1 + len(self.forces_n)

    @property
    def done(self) -> bool:
        """Whether every load was read."""
        return self.step >= self.steps

    def read(self) -> None:
        """Read what is on the sensor now.

        Raises
        ------
        BusyError
            When all loads were read, or one is being read.
        """
        if self.done or self._frames is not None:
            raise BusyError("no load is asked for now", fix="wait, or finish the calibration")
        self._frames = []

    def again(self) -> None:
        """Go back one step."""
        self._frames = None
        if self.step:
            self.step -= 1
            self.taken.pop()
            self.felt.pop()

    def take(self, frame: Frame) -> None:
        """Take a frame; a step ends when its time is over, and enough was read for an average.

        A frame that repeats the one before, as from a board that converts seldom, tells nothing
        new; of a board that only repeats itself, more is not waited for than a few times longer.
        """
        if self._frames is None:
            return
        if not self._frames or frame.t_ns < self._began_ns:  # the board started again
            self._frames, self._began_ns, self._news = [], frame.t_ns, 0
        self._news += not self._frames or not np.array_equal(frame.counts, self._frames[-1])
        self._frames.append(frame.counts)
        passed_s = (frame.t_ns - self._began_ns) * 1e-9
        told = self._news >= LEAST_FRAMES or passed_s >= GUIDE.longest * self.seconds
        if (told and passed_s >= self.seconds) or len(self._frames) >= GUIDE.most_frames:
            counts, self._frames = np.stack(self._frames), None
            self.taken.append(counts)
            self.felt.append(describe_load(counts, self.taken[0] if self.step else None))
            self.step += 1

    def calibration(self) -> Calibration:
        """Return the laws.

        Raises
        ------
        BusyError
            When loads are missing.
        CalibrationError
            When the loads do not determine the laws.
        """
        if not self.done:
            raise BusyError("loads are missing", fix="read every load first")
        loads = [
            even_load(counts, force, name=f"{force:g} N")
            for counts, force in zip(self.taken[1:], self.forces_n, strict=True)
        ]
        return calibration_from(
            self.taken[0], loads, sensor=self.sensor, made=self.made, board=self.board
        )

    def as_json(self) -> dict[str, Any]:
        """Return the step for the page."""
        force = self.forces_n[self.step - 1] if 0 < self.step < self.steps else 0.0
        ask = "Unload the sensor." if self.step == 0 else f"Put {force:g} N on, evenly."
        return {
            "step": self.step,
            "steps": self.steps,
            "newtons": force,
            "ask": "Every load was read." if self.done else ask,
            "reading": self._frames is not None,
            "done": self.done,
            "felt": list(self.felt),
        }


def forces_given(forces_n: list[float]) -> tuple[float, ...]:
    """Return loads in newtons, checked.

    Raises
    ------
    BenchError
        When they are none, or too many.
    """
    sound = all(math.isfinite(force) and 0 < force <= 10_000 for force in forces_n)
    if not sound or not 1 <= len(forces_n) <= GUIDE.most_loads:
        raise BenchError(
            f"loads {forces_n}", fix=f"give 1 to {GUIDE.most_loads} forces above 0 N, rising"
        )
    return tuple(forces_n)


def condition_json(calibration: Calibration) -> dict[str, Any]:
    """Return what a calibration says of the sensor: unsound tactels, scatter, loads."""
    marks = ["".join(Condition(int(v)).letter for v in row) for row in calibration.condition]
    return {
        "bad": int(calibration.bad.sum()),
        "tactels": int(calibration.bad.size),
        "scatter": round(calibration.scatter, 2),
        "repeat": round(calibration.repeat, 4),
        "loads": list(calibration.loads),
        "condition": marks,
    }
