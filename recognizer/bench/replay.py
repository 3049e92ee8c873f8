"""A recording with a time line: it plays, pauses, and goes where it is told.

Pauses of the recording are shortened, and a clock that was set back stands still, so that the
time line has no empty stretch. No more than times and strengths are kept in memory.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from itertools import islice
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.frame import Frame
from probe.recording.layout import FrameBlock
from probe.recording.read import Recording
from recognizer.bench.errors import BenchError, BusyError
from recognizer.bench.settings import REPLAY


class ReplayFeed:
    """A recording with a time line; it begins to play at once.

    Parameters
    ----------
    url
        Its port.
    recording
        Read once as a whole, for the time line.
    ending
        Whether the server ends; reading then ends, too.
    """

    def __init__(
        self, url: str, recording: Recording, ending: Callable[[], bool] = lambda: False
    ) -> None:
        self.url = url
        self.recording = recording
        self._turn = threading.Lock()
        t_ns, self.strength = _times_and_strengths(playable_blocks(recording, ending))
        pauses = np.clip(np.diff(t_ns, prepend=t_ns[:1]) * 1e-9, 0.0, REPLAY.jump_s)
        self._at_s = np.cumsum(pauses)
        self.began_ns = int(t_ns[0]) if len(t_ns) else 0  #: time of the first frame
        self.seconds = float(self._at_s[-1]) if len(t_ns) else 0.0
        self._playing, self._speed = bool(len(t_ns)), 1.0
        self._place_s = 0.0
        self._clock_s = time.monotonic()
        self._next = 0
        self._frames: Iterator[Frame] = iter(())
        self._there = -1  # number of the frame that `_frames` yields next

    def take(self, timeout_s: float) -> list[Frame]:
        """Return the frames that are due."""
        with self._turn:
            place_s = self._advance()
            last = int(np.searchsorted(self._at_s, place_s, side="right"))
            first, self._next = self._next, max(self._next, last)
            frames = self._between(first, last)
            pause_s = timeout_s
            if self._playing and self._next < len(self._at_s):
                pause_s = min(timeout_s, (self._at_s[self._next] - place_s) / self._speed)
        if not frames:
            time.sleep(max(0.001, pause_s))
        return frames

    def play(self, *, playing: bool | None, speed: float | None, at_s: float | None) -> None:
        """Play or pause, faster or slower, from a place on the time line.

        Raises
        ------
        BenchError
            For a speed or a place that is none.
        """
        if speed is not None and not 0.1 <= speed <= 20:
            raise BenchError(f"a speed of {speed:g}", fix="give 0.1 to 20")
        with self._turn:
            place_s = self._advance()
            if playing and place_s >= self.seconds and at_s is None:
                at_s = 0.0
            if at_s is not None:
                self._place_s = min(max(at_s, 0.0), self.seconds)
                # the frame that is there is shown, also while it pauses
                at = int(np.searchsorted(self._at_s, self._place_s, side="right"))
                self._next = max(0, at - 1)
            self._speed = self._speed if speed is None else speed
            self._playing = self._playing if playing is None else playing
            self._playing = self._playing and bool(len(self._at_s))

    def as_json(self) -> dict[str, Any]:
        """Return the place on the time line."""
        with self._turn:
            place_s = self._advance()
            return {
                "state": "replay",
                "device": self.recording.origin.sensor,
                "frames": len(self.recording),
                "at": round(place_s, 3),
                "seconds": round(self.seconds, 3),
                "playing": self._playing,
                "speed": self._speed,
            }

    def notices(self) -> list[str]:
        """Return nothing: a recording has no accidents."""
        return []

    def overview(self) -> list[float]:
        """Return how strong the touches are along the time line, at even places, 0 ... 1."""
        if not len(self._at_s):
            return []
        bins = min(REPLAY.points, len(self._at_s))
        place = np.minimum(self._at_s / max(self.seconds, 1e-9) * bins, bins - 1).astype(int)
        top = np.zeros(bins)
        np.maximum.at(top, place, self.strength)
        return [round(float(v), 3) for v in top / max(float(top.max()), REPLAY.faint)]

    def rest(self, *, wanted: bool) -> None:
        """Do nothing: it plays on, and ends."""

    def close(self) -> None:
        """Pause."""
        with self._turn:
            self._playing = False

    def _advance(self) -> float:
        """Bring the place up to now; pause at the end."""
        now_s = time.monotonic()
        passed_s, self._clock_s = now_s - self._clock_s, now_s
        if self._playing:
            self._place_s += passed_s * self._speed
            if self._place_s >= self.seconds:
                self._place_s, self._playing = self.seconds, False
        return self._place_s

    def _between(self, first: int, last: int) -> list[Frame]:
        """Return frames `first` ... `last` - 1, the newest of them if there are many."""
        first = max(first, last - REPLAY.at_once)
        if first >= last:
            return []
        if self._there != first:
            self._frames = self.recording.frames(first)
        self._there = last
        return list(islice(self._frames, last - first))


def playable_blocks(recording: Recording, ending: Callable[[], bool]) -> Iterator[FrameBlock]:
    """Yield all blocks of a recording that is short enough to be played.

    Raises
    ------
    BenchError
        It is too long; nothing was read.
    BusyError
        `ending` says that the server ends.
    """
    frames = len(recording)
    if frames > REPLAY.most_frames or frames * prod(recording.shape) > REPLAY.most_values:
        rows, columns = recording.shape
        raise BenchError(
            f"a recording of {frames:,} frames of {rows} x {columns}; {REPLAY.most_frames:,} "
            f"frames or {REPLAY.most_values:,} values can be played",
            fix="play a part of it",
            place=Path(recording.path).name,
        )
    for block in recording.blocks():
        if ending():
            raise BusyError("open-bench ends", fix="start it again")
        yield block


def _times_and_strengths(
    blocks: Iterator[FrameBlock],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return times (ns) and strengths of all frames."""
    times, strengths = [np.zeros(0, np.int64)], [np.zeros(0)]
    for block in blocks:
        times.append(block.t_ns)
        over = block.counts.reshape(len(block), -1).astype(np.float64)
        strengths.append(over.sum(axis=1) - over.shape[1] * np.quantile(over, 0.05, axis=1))
    return np.concatenate(times), np.concatenate(strengths)
