"""Frames for the bench: what a feed is, and that of a probe that may go and come back.

A probe that is not there is tried again for as long as it is wanted.
"""

from __future__ import annotations

import time
from typing import Any, Protocol

from encoded_objects.base.errors import EncodedObjectsError
from probe.client.statistics import ClientStatistics
from probe.client.stream import Stream
from probe.frame import Frame
from probe.protocol import IdentPacket
from recognizer.bench.errors import BenchError
from recognizer.bench.settings import SESSION


class Feed(Protocol):
    """Where frames come from."""

    url: str

    def take(self, timeout_s: float) -> list[Frame]:
        """Return the frames that wait, or wait for one."""
        ...

    def as_json(self) -> dict[str, Any]:
        """Return the state for the page: state, cause, fix, and the time line if there is one."""
        ...

    def notices(self) -> list[str]:
        """Return what happened since the last call."""
        ...

    def rest(self, *, wanted: bool) -> None:
        """Stop frames that nobody wants, or let them come again."""
        ...

    def close(self) -> None:
        """Let go."""
        ...


class NoFeed:
    """Nothing is connected."""

    url = ""

    def take(self, timeout_s: float) -> list[Frame]:
        """Return nothing, after a while."""
        time.sleep(timeout_s)
        return []

    def as_json(self) -> dict[str, Any]:
        """Return that there is nothing."""
        return {"state": "none"}

    def notices(self) -> list[str]:
        """Return nothing."""
        return []

    def rest(self, *, wanted: bool) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


class ProbeFeed:
    """A probe behind a port."""

    def __init__(self, url: str, sensor: int | None = None) -> None:
        self.url = url
        self._sensor = sensor
        self._stream: Stream | None = None
        self._notices: list[str] = []
        self._state, self._cause, self._fix = "waiting", "", ""
        self._heard_s = self._tried_s = -1e9
        self._counts = ClientStatistics()
        self._closed = self._resting = False

    @property
    def ident(self) -> IdentPacket | None:
        """What the device said it is."""
        return None if self._stream is None else self._stream.client.ident

    def take(self, timeout_s: float) -> list[Frame]:
        """Return the frames that wait; opens the port, or tries it again."""
        began_s = time.monotonic()
        frames: list[Frame] = []
        if self._resting:
            time.sleep(timeout_s)
            return frames
        try:
            stream = self._opened(began_s)
            if stream is not None:
                frames = stream.take(timeout_s)
        except EncodedObjectsError as gone:
            self._lose(gone)
        self._judge(frames)
        if not frames:  # an ended stream does not wait
            time.sleep(max(0.0, min(timeout_s, began_s + timeout_s - time.monotonic())))
        return frames

    def as_json(self) -> dict[str, Any]:
        """Return the state, and what the client counted."""
        stream = self._stream
        if stream is not None:
            self._counts = stream.client.statistics()
        ident, counts = self.ident, self._counts
        return {
            "state": self._state,
            "cause": self._cause,
            "fix": self._fix,
            "device": "" if ident is None else ident.name,
            "sensor": None if ident is None else ident.sensor,
            "rate": round(counts.rate, 1) if self._state == "live" else 0.0,
            "frames": counts.frames,
            "lost": counts.lost,
            "damaged": counts.failed + counts.doubtful,
            "late": counts.overruns,
            "restarts": counts.reboots,
            "returns": counts.reopenings,
        }

    def notices(self) -> list[str]:
        """Return what happened since the last call."""
        stream = self._stream
        notices, self._notices = self._notices, []
        return notices + ([] if stream is None else stream.client.notices())

    def select(self, sensor: int) -> None:
        """Read another sensor of the board."""
        if not 0 <= sensor <= 7:
            raise BenchError(f"sensor {sensor}", fix="the board has sensors 0 to 7")
        self._sensor = sensor
        if self._stream is not None:
            self._stream.client.select_sensor(sensor)

    def rest(self, *, wanted: bool) -> None:
        """Let go of the port while nobody wants frames."""
        if wanted or self._resting:
            self._resting = not wanted
            return
        self._resting = True
        self._tried_s = -1e9
        if self._stream is not None:
            self._counts = self._stream.client.statistics()
            self._stream.__exit__(None, None, None)
            self._stream = None
        if self._state == "live":
            self._state = "waiting"

    def close(self) -> None:
        """Let go of the port."""
        self._closed = True
        if self._stream is not None:
            self._stream.__exit__(None, None, None)

    def _opened(self, now_s: float) -> Stream | None:
        if self._stream is None and not self._closed and now_s - self._tried_s > SESSION.retry_s:
            self._tried_s = now_s
            self._stream = Stream(self.url, sensor=self._sensor)
        return self._stream

    def _lose(self, gone: EncodedObjectsError) -> None:
        if self._stream is not None:
            self._counts = self._stream.client.statistics()
            self._stream.__exit__(None, None, None)
            self._stream = None
        if self._state == "live" or self._cause != gone.cause:
            self._notices.append(gone.cause)
        self._state, self._cause, self._fix = "gone", gone.cause, gone.fix

    def _judge(self, frames: list[Frame]) -> None:
        now_s = time.monotonic()
        if frames:
            self._heard_s = now_s
            if self._state == "gone":
                self._notices.append("the probe is back")
            self._state = "live"
            self._cause = self._fix = ""
        elif self._state == "live" and now_s - self._heard_s > SESSION.silent_s:
            self._notices.append("the probe is gone")
            self._state, self._fix = "gone", "plug it in again; it is looked for all the time"
            self._cause = "no frame comes any more"
