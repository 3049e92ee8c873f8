"""What counts mean at the bench: the calibration in use, the bias, and a new calibration.

A new one is made by the guide of `probe.calibration`, whose steps the page shows. Thesis 4.2.
"""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass
from typing import Any, Final

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
from probe.calibration.guide import CalibrationGuide
from probe.calibration.load import BIAS_FRAMES
from probe.circuit import Electronics
from probe.errors import ProbeError
from probe.frame import Frame
from recognizer.bench.errors import BenchError, BusyError

Array = NDArray[np.float64]

MOST_LOADS: Final = 12


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
        if len(self._resting) < BIAS_FRAMES:
            return []
        frames, self._resting = np.stack(self._resting), None
        self.bias = frames.mean(axis=0)
        notices = [f"the bias is the mean of {BIAS_FRAMES} frames"]
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
class PageGuide:
    """A mutable value: a calibration that is being made."""

    sensor: str
    guide: CalibrationGuide
    board: Electronics | None
    made: str

    def read(self) -> None:
        """Read the load that is on the sensor now.

        Raises
        ------
        BusyError
            All loads were read, or one is being read.
        """
        if self.guide.done or self.guide.reading:
            raise BusyError("no load is asked for now", fix="wait, or finish the calibration")
        self.guide.read()

    def calibration(self) -> Calibration:
        """Return the laws.

        Raises
        ------
        BusyError
            Loads are missing.
        CalibrationError
            The loads do not determine the laws.
        """
        if not self.guide.done:
            raise BusyError("loads are missing", fix="read every load first")
        rest, *taken = self.guide.taken
        loads = [
            even_load(counts, force, name=f"{force:g} N")
            for counts, force in zip(taken, self.guide.forces_n, strict=True)
        ]
        return calibration_from(rest, loads, sensor=self.sensor, made=self.made, board=self.board)

    def as_json(self) -> dict[str, Any]:
        """Return the step for the page."""
        guide = self.guide
        ask = "Unload the sensor." if guide.step == 0 else f"Put {guide.newtons:g} N on, evenly."
        return {
            "step": guide.step,
            "steps": guide.steps,
            "newtons": guide.newtons,
            "ask": "Every load was read." if guide.done else ask,
            "reading": guide.reading,
            "done": guide.done,
            "felt": list(guide.felt),
        }


def page_guide(
    sensor: str, forces_n: list[float], seconds: float, board: Electronics | None, made: str
) -> PageGuide:
    """Return the guide for some loads.

    Raises
    ------
    BenchError
        The loads are no forces, or too many.
    """
    sound = all(math.isfinite(force) and 0 < force <= 10_000 for force in forces_n)
    if not sound or not 1 <= len(forces_n) <= MOST_LOADS:
        raise BenchError(
            f"loads {forces_n}", fix=f"give 1 to {MOST_LOADS} forces above 0 N, rising"
        )
    return PageGuide(sensor, CalibrationGuide(forces_n, seconds), board, made)


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
