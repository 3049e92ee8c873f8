"""What counts mean at the bench now: newtons by a calibration, and the bias of the unloaded sensor.

A mutable value. What an operator should know of it is returned as notices. Thesis 4.2.
"""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.calibration import Calibration, calibrate_image, drift_of
from probe.calibration.load import BIAS_FRAMES
from probe.errors import ProbeError
from probe.frame import Frame

Array = NDArray[np.float64]


@dataclass(slots=True)
class CalibrationState:
    """Calibration and bias; both belong to the sensor that is read."""

    calibration: Calibration | None = None
    name: str = ""  #: of its file
    warning: str = ""  #: that it does not hold any more
    bias: Array | None = None  #: (rows, columns) counts; None: not taken
    _resting: list[NDArray[np.uint16]] | None = None

    def take(self, frame: Frame) -> list[str]:
        """Take a frame where the bias is being taken; returns what there is to say."""
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
