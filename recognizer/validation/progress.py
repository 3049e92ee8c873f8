"""How far a campaign is: rate, counts and time left, on the bar of all commands."""

from __future__ import annotations

import time
from collections.abc import Iterable
from datetime import timedelta

from encoded_objects.base.output import ProgressBar
from recognizer.validation.rows import Row
from recognizer.validation.trial import REJECTED, RIGHT, WRONG


class TouchProgress:
    """Moves a bar by touches; without a bar it counts in silence."""

    def __init__(self, bar: ProgressBar | None = None) -> None:
        self._bar = bar or ProgressBar(None, None)
        self.begin("", 0, 0)

    def begin(self, stage: str, touches: int, done: int) -> None:
        """Begin a stage; touches done before count for the bar, not for the rate."""
        self._touches, self._before, self._new = touches, done, 0
        self._counts = dict.fromkeys((RIGHT, WRONG, REJECTED), 0)
        self._start = time.monotonic()
        self._bar.begin(stage, touches or None, done)

    def step(self, what: str) -> None:
        """Take note of one more thing that is done in a stage without touches."""
        self._new += 1
        done = self._before + self._new
        rate = self._new / max(time.monotonic() - self._start, 1e-3)
        left = timedelta(seconds=round((self._touches - done) / max(rate, 1e-9)))
        self._bar.show(done, f"{done:,}/{self._touches:,} {what}, {left} left")

    def add(self, rows: Iterable[Row]) -> None:
        """Take note of some more touches."""
        for row in rows:
            self._counts[row["verdict"]] += 1
            self._new += 1
        done = self._before + self._new
        rate = self._new / max(time.monotonic() - self._start, 1e-3)
        left = timedelta(seconds=round((self._touches - done) / max(rate, 1e-9)))
        counts = ", ".join(f"{number:,} {name}" for name, number in self._counts.items())
        text = f"{done:,}/{self._touches:,}  {rate:.1f} touches/s, {left} left; {counts}"
        self._bar.show(done, text)
