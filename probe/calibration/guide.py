"""Calibrate a load at a time: the load to put on next, the frames of it, and their summary.

The first step is the unloaded sensor, then one step per load. The faces of the guide are
`probe-sensor calibrate port` and the page of `open-bench`. Thesis 4.2, appendix 4.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from probe.calibration.load import LEAST_FRAMES, describe_load
from probe.errors import CalibrationError
from probe.frame import Frame

LONGEST: Final = 8.0  #: times the asked seconds, that frames which repeat themselves are read
MOST_FRAMES: Final = 20_000  #: of a load


@dataclass(slots=True)
class CalibrationGuide:
    """A mutable value: the loads of a calibration that is being made."""

    forces_n: list[float]  #: without the rest
    seconds: float  #: least time that a load is read, device time
    step: int = 0  #: 0: the unloaded sensor
    taken: list[NDArray[np.uint16]] = field(default_factory=list)  #: counts of the steps done
    described: list[str] = field(default_factory=list)  #: in words, of the steps done
    frames: list[Frame] = field(default_factory=list)  #: of the step that is, or was last, read
    reading: bool = False  #: whether frames are wanted
    _different: int = 0  #: frames that differ from the one before

    @property
    def steps(self) -> int:
        """How many loads there are, the unloaded sensor among them."""
        return 1 + len(self.forces_n)

    @property
    def done(self) -> bool:
        """Whether every load was read."""
        return self.step >= self.steps

    @property
    def newtons(self) -> float:
        """The load of this step; 0 for the unloaded sensor."""
        return self.forces_n[self.step - 1] if 0 < self.step < self.steps else 0.0

    def read(self) -> None:
        """Read the load that is on the sensor now.

        Raises CalibrationError: all loads were read, or one is being read.
        """
        if self.done or self.reading:
            raise CalibrationError("no load is asked for now", fix="wait, or finish")
        self.frames, self.reading = [], True

    def again(self) -> None:
        """Go back one step."""
        self.reading = False
        if self.step:
            self.step -= 1
            self.taken.pop()
            self.described.pop()

    def take(self, frames: Iterable[Frame]) -> None:
        """Take frames; a step ends when its time is over, and enough was read for an average.

        A frame that repeats the one before, as from a board that converts seldom, tells nothing
        new; a board that only repeats itself is read `LONGEST` times the asked seconds.
        """
        for frame in frames:
            if not self.reading:
                return
            if not self.frames or frame.t_ns < self.frames[0].t_ns:  # the board started again
                self.frames, self._different = [], 0
            last = self.frames[-1].counts if self.frames else None
            self._different += last is None or not np.array_equal(frame.counts, last)
            self.frames.append(frame)
            passed_s = (frame.t_ns - self.frames[0].t_ns) * 1e-9
            enough = self._different >= LEAST_FRAMES or passed_s >= LONGEST * self.seconds
            if (enough and passed_s >= self.seconds) or len(self.frames) >= MOST_FRAMES:
                self.end_step()

    def end_step(self) -> None:
        """End the step with the frames so far."""
        counts, self.reading = np.stack([frame.counts for frame in self.frames]), False
        self.taken.append(counts)
        self.described.append(describe_load(counts, self.taken[0] if self.step else None))
        self.step += 1
