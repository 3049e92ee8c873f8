"""When a touch is worth reading: as soon as it is steady, and again when it has changed.

Forces of frame after frame -> what to do with this one. The page wants an answer at once, so
one steady frame is enough (`recognizer.touch.source` averages many), and a touch that was not
answered is read again. One that never comes to rest is read all the same after a while.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from recognizer.bench.settings import TRIGGER

Array = NDArray[np.float64]

Phase = Literal["none", "felt", "moving", "read", "again", "held"]
"""none: nothing is touched. felt: a touch has begun that was not read yet. moving: what is felt is
no longer what was read. read, again: read this frame; again: it was read and not answered.
held: there is nothing to do."""


@dataclass(slots=True)
class ReadTrigger:
    """A mutable value: the touch at hand."""

    _before: Array | None = None
    _read: Array | None = None
    _since_s: float = 0.0
    _read_s: float = 0.0
    _answered: bool = False

    def phase(self, forces: Array, *, contact: bool, now_s: float) -> Phase:
        """Return what a frame is.

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
            return "none"
        if before is None:
            self._since_s = now_s
            return "felt"
        changed = (
            self._read is None
            or _relative_difference(_shape(forces), _shape(self._read)) > TRIGGER.changed
        )
        if _relative_difference(forces, before) < TRIGGER.steady:
            self._since_s = now_s
        elif now_s - self._since_s < TRIGGER.restless_s:
            return "felt" if self._read is None else "moving" if changed else "held"
        if changed:
            return "read"
        return "again" if not self._answered and now_s - self._read_s > TRIGGER.again_s else "held"

    def read(self, forces: Array, *, answered: bool, now_s: float) -> None:
        """Take note that a frame was read."""
        self._read, self._answered = forces, answered
        self._read_s = now_s


def _relative_difference(a: Array, b: Array) -> float:
    return float(np.abs(a - b).sum() / max(float(np.maximum(a, b).sum()), 1e-12))


def _shape(forces: Array) -> Array:
    return np.asarray(forces / max(float(forces.sum()), 1e-9))
