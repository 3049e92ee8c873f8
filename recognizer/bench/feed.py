"""Where the bench's frames come from: a probe that may go and come back, or a recording."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from itertools import islice
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from encoded_objects.base.errors import EncodedObjectsError
from probe.client.client import Client
from probe.client.receiver import ClientStatistics
from probe.frame import Frame
from probe.recording.layout import FrameBlock
from probe.recording.read import Recording
from recognizer.bench.errors import BenchError, BusyError

RETRY_S = 1.0  #: after a probe went away for good
SILENT_S = 0.6  #: without a frame a probe is gone
AT_ONCE = 512  #: frames of a recording that are taken at a time
POINTS = 800  #: of the time line's picture
MOST_FRAMES = 2_000_000  #: of a recording that is played, or uploaded
MOST_VALUES = 1 << 30  #: of its images: twice as many as 2,000,000 of 16 x 16 have
FAINT = 2048.0  #: counts of all tactels; a recording of noise alone looks like one
PAUSE_S = 0.5  #: longer pauses in a recording are shortened to it


class Feed:
    """Where frames come from; this one is connected to nothing."""

    def take(self, timeout_s: float) -> list[Frame]:
        """Return the frames that wait, or wait for one."""
        time.sleep(timeout_s)
        return []

    def as_json(self) -> dict[str, Any]:
        """Return the state for the page: state, cause, fix, and the time line if there is one."""
        return {"state": "none"}

    def notices(self) -> list[str]:
        """Return notices since the last call."""
        return []

    def rest(self, *, wanted: bool) -> None:
        """Stop frames that nobody wants, or let them come again."""

    def close(self) -> None:
        """Release the port."""


class ProbeFeed(Feed):
    """A probe behind a port; one that is not there is tried again for as long as it is wanted."""

    def __init__(self, url: str, sensor: int | None = None) -> None:
        self._url = url
        self._sensor = sensor
        self._stream: Client | None = None
        self._notices: list[str] = []
        self._state, self._cause, self._fix = "waiting", "", ""
        self._heard_s = self._tried_s = -1e9
        self._counts = ClientStatistics()
        self._closed = self._resting = False

    def take(self, timeout_s: float) -> list[Frame]:
        """Return the frames that wait; opens the port, or tries it again."""
        began_s = time.monotonic()
        frames: list[Frame] = []
        if self._resting:
            time.sleep(timeout_s)
            return frames
        try:
            if self._stream is None and not self._closed and began_s - self._tried_s > RETRY_S:
                self._tried_s = began_s
                self._stream = Client(self._url, sensor=self._sensor)
            if self._stream is not None:
                frames = self._stream.take(timeout_s)
        except EncodedObjectsError as gone:
            self._end_stream()
            if self._state == "live" or self._cause != gone.cause:
                self._notices.append(gone.cause)
            self._state, self._cause, self._fix = "gone", gone.cause, gone.fix
        self._note_state(frames)
        if not frames:  # an ended stream does not wait
            time.sleep(max(0.0, min(timeout_s, began_s + timeout_s - time.monotonic())))
        return frames

    def as_json(self) -> dict[str, Any]:
        """Return the state, and what the client counted."""
        stream = self._stream
        if stream is not None:
            self._counts = stream.statistics()
        ident = None if stream is None else stream.ident
        counts = self._counts
        return {
            "state": self._state, "cause": self._cause, "fix": self._fix,
            "device": "" if ident is None else ident.name,
            "sensor": None if ident is None else ident.sensor,
            "rate": round(counts.rate, 1) if self._state == "live" else 0.0,
            "frames": counts.frames, "lost": counts.lost,
            "damaged": counts.failed + counts.doubtful, "late": counts.overruns,
            "restarts": counts.reboots, "returns": counts.reopenings,
        }  # fmt: skip

    def notices(self) -> list[str]:
        """Return notices since the last call."""
        stream = self._stream
        notices, self._notices = self._notices, []
        return notices + ([] if stream is None else stream.notices())

    def select(self, sensor: int) -> None:
        """Read another sensor of the board."""
        if not 0 <= sensor <= 7:
            raise BenchError(f"sensor {sensor}", fix="the board has sensors 0 to 7")
        self._sensor = sensor
        if self._stream is not None:
            self._stream.select_sensor(sensor)

    def rest(self, *, wanted: bool) -> None:
        """Close the port while nobody wants frames."""
        if wanted or self._resting:
            self._resting = not wanted
            return
        self._resting = True
        self._tried_s = -1e9
        self._end_stream()
        if self._state == "live":
            self._state = "waiting"

    def close(self) -> None:
        """Close the port for good."""
        self._closed = True
        self._end_stream()

    def _end_stream(self) -> None:
        if self._stream is not None:
            self._counts = self._stream.statistics()
            self._stream.__exit__(None, None, None)
            self._stream = None

    def _note_state(self, frames: list[Frame]) -> None:
        now_s = time.monotonic()
        if frames:
            self._heard_s = now_s
            if self._state == "gone":
                self._notices.append("the probe is back")
            self._state = "live"
            self._cause = self._fix = ""
        elif self._state == "live" and now_s - self._heard_s > SILENT_S:
            self._notices.append("the probe is gone")
            self._state, self._fix = "gone", "plug it in again; it is looked for all the time"
            self._cause = "no frame comes any more"


class ReplayFeed(Feed):
    """A recording with a time line: it plays at once, pauses, and goes to any place.

    It is read once as a whole for the time line, until `ending` says that the server ends. Only
    times and strengths are kept. Pauses are shortened, and a clock that was set back stands still,
    so that the time line has no empty stretch.
    """

    def __init__(self, recording: Recording, ending: Callable[[], bool] = lambda: False) -> None:
        self.recording = recording
        self._turn = threading.Lock()
        times, strengths = [np.zeros(0, np.int64)], [np.zeros(0)]
        for block in playable_blocks(recording, ending):
            times.append(block.t_ns)
            over = block.counts.reshape(len(block), -1).astype(np.float64)
            strengths.append(over.sum(axis=1) - over.shape[1] * np.quantile(over, 0.05, axis=1))
        t_ns, self._strength = np.concatenate(times), np.concatenate(strengths)
        pauses = np.clip(np.diff(t_ns, prepend=t_ns[:1]) * 1e-9, 0.0, PAUSE_S)
        self._at_s = np.cumsum(pauses)
        self.began_ns = int(t_ns[0]) if len(t_ns) else 0  #: time of the first frame
        self.seconds = float(self._at_s[-1]) if len(t_ns) else 0.0
        self._playing, self._speed = bool(len(t_ns)), 1.0
        self._place_s = 0.0
        self._clock_s = time.monotonic()
        self._next = 0
        self._frames: Iterator[Frame] = iter(())
        self._position = -1  # number of the frame that `_frames` yields next

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
        """Play or pause, faster or slower, from a place on the time line (s)."""
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
                "state": "replay", "device": self.recording.origin.sensor,
                "frames": len(self.recording),
                "at": round(place_s, 3), "seconds": round(self.seconds, 3),
                "playing": self._playing, "speed": self._speed,
            }  # fmt: skip

    def overview(self) -> list[float]:
        """Return how strong the touches are along the time line, at even places, 0 ... 1."""
        if not len(self._at_s):
            return []
        bins = min(POINTS, len(self._at_s))
        place = np.minimum(self._at_s / max(self.seconds, 1e-9) * bins, bins - 1).astype(int)
        top = np.zeros(bins)
        np.maximum.at(top, place, self._strength)
        return [round(float(v), 3) for v in top / max(float(top.max()), FAINT)]

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
        first = max(first, last - AT_ONCE)
        if first >= last:
            return []
        if self._position != first:
            self._frames = self.recording.frames(first)
        self._position = last
        return list(islice(self._frames, last - first))


def playable_blocks(recording: Recording, ending: Callable[[], bool]) -> Iterator[FrameBlock]:
    """Yield all blocks of a recording that is short enough to be played.

    Raises BenchError: it is too long; nothing was read; BusyError: `ending` says that the server
    ends.
    """
    frames = len(recording)
    if frames > MOST_FRAMES or frames * prod(recording.shape) > MOST_VALUES:
        rows, columns = recording.shape
        raise BenchError(
            f"a recording of {frames:,} frames of {rows} x {columns}; {MOST_FRAMES:,} "
            f"frames or {MOST_VALUES:,} values can be played",
            fix="play a part of it",
            place=Path(recording.path).name,
        )
    for block in recording.blocks():
        if ending():
            raise BusyError("open-bench ends", fix="start it again")
        yield block
