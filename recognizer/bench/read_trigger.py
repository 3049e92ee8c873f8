"""When a touch is worth reading: as soon as it is steady, and again when it has changed.

Forces of frame after frame -> whether to read this one. The page wants an answer at once, so
one steady frame is enough (`recognizer.touch.contacts` averages many), and a touch that was not
answered is read again. One that never comes to rest is read all the same after a while.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.bench.settings import TRIGGER

Array = NDArray[np.float64]


@dataclass(slots=True)
class ReadTrigger:
    """A mutable value: the touch at hand."""

    touches: int = 0  #: begun so far
    _before: Array | None = None
    _read: Array | None = None
    _since_s: float = 0.0
    _read_s: float = 0.0
    _answered: bool = False

    def due(self, forces: Array, *, contact: bool, now_s: float) -> bool:
        """Return whether to read a frame.

        Parameters
        ----------
        forces
            (rows, columns) over the background.
        contact
            Whether anything is touched.
        now_s
            Any clock, s.
        """
        before, self._before = self._before, forces if contact else None
        if not contact:
            self._read = None
            return False
        if before is None:
            self.touches += 1
            self._since_s = now_s
            return False
        steady = _relative_difference(forces, before) < TRIGGER.steady
        if steady:
            self._since_s = now_s
        elif now_s - self._since_s < TRIGGER.restless_s:
            return False
        if (
            self._read is None
            or _relative_difference(_shape(forces), _shape(self._read)) > TRIGGER.changed
        ):
            return True
        return not self._answered and now_s - self._read_s > TRIGGER.again_s

    def read(self, forces: Array, *, answered: bool, now_s: float) -> None:
        """Take note that a frame was read."""
        self._read, self._answered = forces, answered
        self._read_s = now_s


def _relative_difference(a: Array, b: Array) -> float:
    return float(np.abs(a - b).sum() / max(float(np.maximum(a, b).sum()), 1e-12))


def _shape(forces: Array) -> Array:
    return np.asarray(forces / max(float(forces.sum()), 1e-9))
