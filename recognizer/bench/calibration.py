"""What counts mean at the bench: the calibration in use, the bias, and a new calibration.

A new one is made load by load: first the unloaded sensor, then a step for each load. Each is read
for a few seconds and may be read again. Thesis 4.2, appendix 4.
"""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.calibration import (
    Calibration,
    Condition,
    calibrate_image,
    calibration_from,
    drift_of,
    even_load,
)
from probe.calibration.load_words import describe_load
from probe.calibration.settings import AVERAGE
from probe.circuit import Electronics
from probe.errors import ProbeError
from probe.frame import Frame
from recognizer.bench.errors import BenchError, BusyError

Array = NDArray[np.float64]
Counts = NDArray[np.uint16]

MOST_LOADS = 12
MOST_FRAMES = 20_000  #: of a load
LONGEST = 8.0  #: times the seconds asked for, that frames which repeat themselves are read


@dataclass(slots=True)
class CalibrationState:
    """A mutable value: calibration and bias of the sensor that is read."""

    calibration: Calibration | None = None
    name: str = ""  #: of its file
    warning: str = ""  #: that it does not hold any more
    bias: Array | None = None  #: (rows, columns) counts; None: not taken
    _resting: list[NDArray[np.uint16]] | None = None

    def take(self, frame: Frame) -> list[str]:
        """Take a frame while the bias is being taken; returns notices."""
        if self._resting is None:
            return []
        self._resting.append(frame.counts)
        if len(self._resting) < AVERAGE.bias_frames:
            return []
        frames, self._resting = np.stack(self._resting), None
        self.bias = frames.mean(axis=0)
        notices = [f"the bias is the mean of {AVERAGE.bias_frames} frames"]
        if self.calibration is not None:
            self.warning = drift_of(self.calibration, frames).warning
            notices.append(self.warning or "the calibration still holds")
        return notices

    def values(self, frame: Frame) -> tuple[Array, bool]:
        """Return the readings (rows, columns), and whether they are newtons.

        Raises
        ------
        ProbeError
            When the calibration is not one of this sensor's.
        """
        if self.calibration is None:
            return frame.counts.astype(np.float64), False
        return calibrate_image(frame, self.calibration).values, True

    def switch_bias(self, *, on: bool) -> str:
        """Begin to take the bias, or do without it."""
        self.bias, self._resting = None, [] if on else None
        return "taking the bias: keep the sensor unloaded" if on else "bias off"

    def use(self, calibration: Calibration | None, name: str = "") -> str:
        """Read newtons from now on, or counts."""
        self.calibration, self.name, self.warning = calibration, name, ""
        return f"readings are newtons by {name}" if calibration else "readings are counts"

    def as_json(self) -> dict[str, Any]:
        """Return both for the page."""
        known = self.calibration
        taken = "none" if self.bias is None else "taken"
        return {
            "bias": taken if self._resting is None else "taking",
            "calibration": None if known is None else {
                "name": self.name,
                "made": known.made,
                "age": _age(known.made),
                "bad": int(known.bad.sum()),
                "warning": self.warning,
            },
        }  # fmt: skip


def values_or_counts(state: CalibrationState, frame: Frame) -> tuple[Array, bool, str]:
    """Return the readings; counts, and why, where the calibration does not fit the frame."""
    try:
        return (*state.values(frame), "")
    except ProbeError as error:
        state.use(None)
        return (*state.values(frame), f"calibration off: {error.cause}")


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
    descriptions: list[str] = field(default_factory=list)  #: of what was taken
    _frames: list[Counts] | None = None  #: while a step is read
    _began_ns: int = 0
    _different: int = 0  #: frames that differ from the one before

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
            self.descriptions.pop()

    def take(self, frame: Frame) -> None:
        """Take a frame; a step ends when its time is over, and enough was read for an average.

        A frame that repeats the one before, as from a board that converts seldom, adds nothing; a
        board that only repeats itself is read `LONGEST` times as long.
        """
        if self._frames is None:
            return
        if not self._frames or frame.t_ns < self._began_ns:  # the board started again
            self._frames, self._began_ns, self._different = [], frame.t_ns, 0
        self._different += not self._frames or not np.array_equal(frame.counts, self._frames[-1])
        self._frames.append(frame.counts)
        passed_s = (frame.t_ns - self._began_ns) * 1e-9
        enough = self._different >= AVERAGE.frames or passed_s >= LONGEST * self.seconds
        if (enough and passed_s >= self.seconds) or len(self._frames) >= MOST_FRAMES:
            counts, self._frames = np.stack(self._frames), None
            self.taken.append(counts)
            self.descriptions.append(describe_load(counts, self.taken[0] if self.step else None))
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
            "felt": list(self.descriptions),
        }


def forces_given(forces_n: list[float]) -> tuple[float, ...]:
    """Return loads in newtons, checked.

    Raises
    ------
    BenchError
        When they are none, or too many.
    """
    sound = all(math.isfinite(force) and 0 < force <= 10_000 for force in forces_n)
    if not sound or not 1 <= len(forces_n) <= MOST_LOADS:
        raise BenchError(
            f"loads {forces_n}", fix=f"give 1 to {MOST_LOADS} forces above 0 N, rising"
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


def _age(made: str) -> str:
    """Return how old a calibration is, in words."""
    try:
        then = datetime.datetime.fromisoformat(made)
    except ValueError:
        return made or "not dated"
    days = (datetime.datetime.now(then.tzinfo) - then).total_seconds() / 86400
    if days >= 2:
        return f"{days:.0f} days"
    return f"{24 * days:.0f} h" if days >= 0.1 else "fresh"
