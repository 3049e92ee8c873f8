"""The page's face of a guided calibration: its step as JSON, and at the end the laws."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from probe.calibration import Calibration, Condition, calibration_from, even_load
from probe.calibration.guide import CalibrationGuide
from probe.circuit import Electronics
from recognizer.bench.errors import BenchError, BusyError

MOST_LOADS: Final = 12


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
