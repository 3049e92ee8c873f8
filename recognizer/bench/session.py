"""One probe and all that is done with it. Every page sees and works the same session.

A thread takes the frames of the feed: it records them, calibrates with them, shows them, and
offers them to the reader. Requests come from other threads, one at a time.
"""

from __future__ import annotations

import datetime
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.calibration import calibration_hash, read_calibration, write_calibration
from probe.circuit import Electronics
from probe.errors import ProbeError
from probe.frame import Frame
from probe.port.url import address_of
from probe.recording.names import next_free
from probe.recording.read import Recording
from probe.recording.record import Recorder
from probe.sensor import SensorType
from recognizer.bench.bulletin import Bulletin
from recognizer.bench.errors import BenchError, BusyError
from recognizer.bench.feed import Feed, NoFeed, ProbeFeed
from recognizer.bench.files import listed, named
from recognizer.bench.guided import Guide, condition_told, forces_given
from recognizer.bench.meaning import Meaning, safe_values
from recognizer.bench.message import FramePicture
from recognizer.bench.reading import Offered, Reading
from recognizer.bench.replay import ReplayFeed
from recognizer.bench.simulated import SCHEME, TouchProbe

Array = NDArray[np.float64]

WAIT_S = 0.05  #: of the thread for a frame
STATUS_S = 0.25  #: between two reports
NOTICES = 40


class Session:
    """The bench's state.

    Parameters
    ----------
    database
        Of the objects; empty: none.
    folder
        For recordings and calibrations; made when something is written.
    sensor
        What the probe is.
    bulletin
        Where everything is told.
    """

    def __init__(self, database: str, folder: Path, sensor: SensorType, bulletin: Bulletin) -> None:
        self.database, self.folder, self.sensor = database, folder, sensor
        self.reading = Reading(database, sensor, bulletin)
        self.simulation: TouchProbe | None = None
        self._bulletin = bulletin
        self._turn = threading.RLock()
        self._feed: Feed = NoFeed()
        self._url = ""
        self._newest: Frame | None = None
        self._meaning = Meaning()
        self._recorder: Recorder | None = None
        self._guide: Guide | None = None
        self._notices: deque[tuple[int, str]] = deque(maxlen=NOTICES)
        self._told = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bench", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End everything in order; a recording is complete."""
        self._stop.set()
        self._thread.join()
        with self._turn:
            self._leave()
        self.reading.close()

    # What the page asks for.

    def open(self, url: str, sensor: int | None = None) -> None:
        """Read another port.

        Raises
        ------
        BenchError, PortError, RecordingError
            When the URL cannot be read, or names no recording.
        """
        with self._turn:
            self._leave()
            if url.startswith(SCHEME):
                self.simulation = TouchProbe(url, self.database, self.sensor)
                self._feed = ProbeFeed(self.simulation.url, sensor)
            elif url.startswith("file:"):
                target = address_of(url).target
                self._feed = ReplayFeed(url, Recording(target))
            elif url:
                address_of(url)
                self._feed = ProbeFeed(url, sensor)
            self._url = url
            self._report()

    def replay(self, name: str) -> None:
        """Play a recording of the folder."""
        path = named(self.folder, name, ".h5")
        self.open(f"file:{path}")

    def timeline(self) -> ReplayFeed:
        """Return the recording that is played.

        Raises
        ------
        BusyError
            When none is.
        """
        feed = self._feed
        if not isinstance(feed, ReplayFeed):
            raise BusyError("no recording is played", fix="choose a recording first")
        return feed

    def select(self, sensor: int) -> None:
        """Read another sensor of the board."""
        with self._turn:
            if not isinstance(self._feed, ProbeFeed):
                raise BusyError("no probe is connected", fix="choose a port first")
            self._feed.select(sensor)
            self._meaning = Meaning()
            self._report()

    def simulated(self) -> TouchProbe:
        """Return the simulated probe.

        Raises
        ------
        BusyError
            When another one is connected.
        """
        if self.simulation is None:
            raise BusyError(
                "the probe that is connected is not simulated",
                fix="choose the simulated probe to touch by a click",
            )
        return self.simulation

    def bias(self, *, on: bool) -> None:
        """Take the bias of the unloaded sensor, or do without it."""
        with self._turn:
            self._note(self._meaning.switch_bias(on=on))
            self._report()

    def record(self, *, on: bool) -> None:
        """Start or end a recording.

        Raises
        ------
        BusyError, RecordingError
            When there is nothing to record, or no place for it.
        """
        with self._turn:
            if not on:
                self._end_recording()
            elif self._recorder is None:
                if not isinstance(self._feed, ProbeFeed):
                    raise BusyError("no probe is connected", fix="choose a port first")
                self.folder.mkdir(parents=True, exist_ok=True)
                known = self._meaning.calibration
                path = next_free(self.folder, "touch", ".h5")
                self._recorder = Recorder(
                    path, sensor=self._sensor_name(), attributes={"url": self._url},
                    calibration=calibration_hash(known) if known else "",
                )  # fmt: skip
                self._note(f"recording {path.name}")
            self._report()

    def calibrate(self, forces_n: list[float], seconds: float, *, simulated_board: bool) -> None:
        """Begin a calibration."""
        if not 0.2 <= seconds <= 60:
            raise BenchError(f"{seconds:g} s for a load", fix="give 0.2 to 60 s")
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        board = Electronics() if simulated_board else None
        with self._turn:
            if not isinstance(self._feed, ProbeFeed):
                raise BusyError("no probe is connected", fix="choose a port first")
            forces = forces_given(forces_n)
            self._guide = Guide(self._sensor_name(), forces, seconds, board, now)
            self._report()

    @contextmanager
    def guide(self) -> Iterator[Guide]:
        """Work on the calibration that is being made.

        Raises
        ------
        BusyError
            When none is.
        """
        with self._turn:
            if self._guide is None:
                raise BusyError("no calibration is being made", fix="begin one first")
            yield self._guide
            self._report()

    def finish_calibration(self) -> dict[str, Any]:
        """Fit the laws, write and use them; returns what they say of the sensor."""
        with self.guide() as guide:
            found = guide.calibration()
            self.folder.mkdir(parents=True, exist_ok=True)
            path = next_free(self.folder, "calibration", ".json")
            write_calibration(found, path)
            self._guide = None
            self._note(self._meaning.use(found, path.name))
            return {"name": path.name, **condition_told(found)}

    def cancel_calibration(self) -> None:
        """Forget the calibration that is being made."""
        with self._turn:
            self._guide = None
            self._report()

    def use_calibration(self, name: str) -> None:
        """Read newtons by a calibration of the folder; counts if the name is empty.

        Raises
        ------
        CalibrationError
            When it is none, or another sensor's.
        """
        with self._turn:
            found = None
            if name:
                path = named(self.folder, name, ".json")
                found = read_calibration(path, sensor=self._sensor_name() or None)
            self._note(self._meaning.use(found, name))
            self._report()

    def newest(self) -> tuple[Frame, Array, str]:
        """Return the newest frame, what is shown of it, and its unit.

        Raises
        ------
        BusyError
            When none came yet.
        """
        with self._turn:
            if self._newest is None:
                raise BusyError("no frame came yet", fix="connect a probe first")
            values, newtons, _ = safe_values(self._meaning, self._newest)
            return self._newest, values, "N" if newtons else "counts"

    def told(self) -> dict[str, Any]:
        """Return the state for the page."""
        with self._turn:
            recorder, guide = self._recorder, self._guide
            return {
                "port": self._url,
                "feed": self._feed.told(),
                "simulated": self.simulation is not None,
                "recording": None if recorder is None
                else {"name": recorder.path.name, "frames": recorder.frames},
                "guide": None if guide is None else guide.told(),
                **self._meaning.told(),
                "recordings": listed(self.folder, ".h5"),
                "calibrations": listed(self.folder, ".json"),
                "notices": [{"number": n, "text": text} for n, text in self._notices],
                "pages": len(self._bulletin.readers),
            }  # fmt: skip

    # What follows runs in the thread, or under its lock.

    def _run(self) -> None:
        due_s = 0.0
        while not self._stop.is_set():
            feed = self._feed
            frames = feed.take(WAIT_S)
            with self._turn:
                if feed is self._feed:
                    self._take(frames)
                    for notice in feed.notices():
                        self._note(notice)
                now_s = time.monotonic()
                if now_s >= due_s:
                    due_s = now_s + STATUS_S
                    self._report()

    def _take(self, frames: list[Frame]) -> None:
        for frame in frames:
            if self._recorder is not None:
                self._record(frame)
            if self._guide is not None:
                self._guide.take(frame)
            for notice in self._meaning.take(frame):
                self._note(notice)
        if not frames:
            return
        frame, received_ms = frames[-1], time.time() * 1e3
        values, newtons, wrong = safe_values(self._meaning, frame)
        if wrong:
            self._note(wrong)
        self._newest = frame
        bias = None if newtons else self._meaning.bias
        self._bulletin.publish(
            "frame",
            FramePicture(values, self.sensor, bias, newtons, frame.seq, frame.t_ns * 1e-9,
                         received_ms),
        )  # fmt: skip
        self.reading.offer(Offered(frame, self._meaning.calibration, received_ms))

    def _record(self, frame: Frame) -> None:
        assert self._recorder is not None
        try:
            self._recorder.append(frame)
        except ProbeError as error:
            self._note(str(error))
            self._recorder = None

    def _leave(self) -> None:
        """Let go of what is connected."""
        self._end_recording()
        feed, self._feed = self._feed, NoFeed()
        feed.close()
        if self.simulation is not None:
            self.simulation.close()
            self.simulation = None
        self._url = ""
        self._newest = self._guide = None
        self._meaning = Meaning()

    def _end_recording(self) -> None:
        if self._recorder is not None:
            recorder, self._recorder = self._recorder, None
            recorder.close()
            files = ", ".join(file.name for file in recorder.files)
            self._note(f"{files}: {recorder.frames:,} frames")

    def _sensor_name(self) -> str:
        told = self._feed.told()
        if isinstance(self._feed, ReplayFeed):
            return str(told["device"])
        device = told.get("device", "")
        return f"{device}/{told['sensor']}" if device else ""

    def _note(self, text: str) -> None:
        self._told += 1
        self._notices.append((self._told, text))

    def _report(self) -> None:
        self._bulletin.publish("status", self.told())
