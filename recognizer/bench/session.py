"""One probe and all that is done with it. Every page sees and works the same session.

A thread takes the frames of the feed and hands them on (`frames`). Requests come from other
threads, one at a time.
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

from probe.calibration import read_calibration
from probe.circuit import Electronics
from probe.frame import Frame
from probe.port.url import address_of
from probe.recording.read import Recording
from probe.sensor import SensorType
from recognizer.bench.broker import Broker
from recognizer.bench.calibration_guide import CalibrationGuide, forces_given
from recognizer.bench.calibration_state import CalibrationState
from recognizer.bench.errors import BenchError, BusyError
from recognizer.bench.feed import Feed, NoFeed, ProbeFeed
from recognizer.bench.files import find_file, list_files
from recognizer.bench.frames import FrameHandler
from recognizer.bench.recognition_thread import RecognitionThread
from recognizer.bench.replay import ReplayFeed
from recognizer.bench.settings import SESSION
from recognizer.bench.simulated import SCHEME, TouchProbe

Array = NDArray[np.float64]


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
    broker
        Where everything is published.
    """

    def __init__(self, database: str, folder: Path, sensor: SensorType, broker: Broker) -> None:
        self.database, self.folder, self.sensor = database, folder, sensor
        self.recognition = RecognitionThread(database, sensor, broker)
        self.simulation: TouchProbe | None = None
        self._broker = broker
        self._turn = threading.RLock()
        self._feed: Feed = NoFeed()
        self._url = ""
        self._frames = FrameHandler(sensor, broker, self.recognition, self._note)
        self._notices: deque[tuple[int, float, str]] = deque(maxlen=SESSION.notices)
        self._noted = 0
        self._started_ms = time.time() * 1e3
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bench", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End everything in order; a recording is complete."""
        self._stop.set()
        self._thread.join()
        with self._turn:
            self._leave()
        self.recognition.close()

    # What the page asks for.

    def open(self, url: str, sensor: int | None = None) -> None:
        """Read another port.

        Raises
        ------
        BenchError, PortError, RecordingError, SensorTypeError
            When the URL cannot be read, names no recording, or one of another sensor type.
        """
        with self._turn:
            self._leave()
            if url.startswith(SCHEME):
                self.simulation = TouchProbe(url, self.database, self.sensor)
                self._feed = ProbeFeed(self.simulation.url, sensor)
            elif url.startswith("file:"):
                target = address_of(url).target
                recording = Recording(target)
                recording.sensor_type(self.sensor)  # of another shape: refused
                self._feed = ReplayFeed(url, recording)
            elif url:
                address_of(url)
                self._feed = ProbeFeed(url, sensor)
            self._url = url
            self._report()

    def replay(self, name: str) -> None:
        """Play a recording of the folder."""
        path = find_file(self.folder, name, ".h5")
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
            self._frames.state = CalibrationState()
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

    def use_database(self, database: str) -> None:
        """Read the objects of a database from now on."""
        with self._turn:
            self.database = self.recognition.database = database
            self.recognition.reload()
            self._note(f"objects are those of {database}")
            self._report()

    def touch_next(self) -> None:
        """Let the simulated probe make the step that the newest answer proposes.

        Raises
        ------
        BusyError
            It proposes none, or the probe is not simulated.
        """
        proposed = (self.recognition.touches.newest_answer() or {}).get("next")
        if not proposed:
            raise BusyError("no next touch is proposed", fix="touch the part first")
        self.simulated().step(
            proposed["dx_mm"], proposed["dy_mm"], proposed["turn_deg"], proposed["force_n"]
        )

    def bias(self, *, on: bool) -> None:
        """Take the bias of the unloaded sensor, or do without it."""
        with self._turn:
            self._note(self._frames.state.switch_bias(on=on))
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
                self._frames.end_recording()
            elif not isinstance(self._feed, ProbeFeed):
                raise BusyError("no probe is connected", fix="choose a port first")
            else:
                self._frames.start_recording(self.folder, self.sensor_name(), self._url)
            self._report()

    def calibrate(self, forces_n: list[float], seconds: float, *, simulated_board: bool) -> None:
        """Begin a calibration."""
        low, high = SESSION.calibration_s
        if not low <= seconds <= high:
            raise BenchError(f"{seconds:g} s for a load", fix=f"give {low:g} to {high:g} s")
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        board = Electronics() if simulated_board else None
        with self._turn:
            if not isinstance(self._feed, ProbeFeed):
                raise BusyError("no probe is connected", fix="choose a port first")
            forces = forces_given(forces_n)
            self._frames.guide = CalibrationGuide(self.sensor_name(), forces, seconds, board, now)
            self._report()

    @contextmanager
    def guide(self) -> Iterator[CalibrationGuide]:
        """Work on the calibration that is being made.

        Raises
        ------
        BusyError
            When none is.
        """
        with self._turn:
            if self._frames.guide is None:
                raise BusyError("no calibration is being made", fix="begin one first")
            yield self._frames.guide
            self._report()

    def finish_calibration(self) -> dict[str, Any]:
        """Fit the laws, write and use them; returns what they say of the sensor."""
        with self.guide() as guide:
            return self._frames.finish_calibration(guide, self.folder)

    def cancel_calibration(self) -> None:
        """Forget the calibration that is being made."""
        with self._turn:
            self._frames.guide = None
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
                path = find_file(self.folder, name, ".json")
                found = read_calibration(path, sensor=self.sensor_name() or None)
            self._note(self._frames.state.use(found, name))
            self._report()

    def newest(self) -> tuple[Frame, Array, str]:
        """Return the newest frame, what is shown of it, and its unit.

        Raises
        ------
        BusyError
            When none came yet.
        """
        with self._turn:
            return self._frames.newest()

    def as_json(self) -> dict[str, Any]:
        """Return the state for the page."""
        with self._turn:
            return {
                "port": self._url,
                "feed": self._feed.as_json(),
                "simulated": self.simulation is not None,
                **self._frames.as_json(),
                "recordings": list_files(self.folder, ".h5"),
                "calibrations": list_files(self.folder, ".json"),
                "notices": [
                    {"number": n, "at_ms": at_ms, "text": text} for n, at_ms, text in self._notices
                ],
                "pages": len(self._broker.subscribers),
                "started_ms": self._started_ms,
            }  # fmt: skip

    # What follows runs in the thread, or under its lock.

    def _run(self) -> None:
        due_s, wanted_s = 0.0, time.monotonic()
        while not self._stop.is_set():
            feed = self._feed
            frames = feed.take(SESSION.wait_s)
            now_s = time.monotonic()
            with self._turn:
                if self._broker.subscribers or self._frames.busy:
                    wanted_s = now_s
                feed.rest(wanted=now_s - wanted_s < SESSION.idle_s)
                if feed is self._feed:
                    self._frames.take(frames)
                    for notice in feed.notices():
                        self._note(notice)
                if now_s >= due_s:
                    due_s = now_s + SESSION.status_s
                    self._report()

    def _leave(self) -> None:
        """Let go of what is connected."""
        self._frames.leave()
        feed, self._feed = self._feed, NoFeed()
        feed.close()
        if self.simulation is not None:
            self.simulation.close()
            self.simulation = None
        self._url = ""

    def sensor_name(self) -> str:
        """Return device and sensor, as recordings name them; empty where nothing is connected."""
        feed = self._feed.as_json()
        if isinstance(self._feed, ReplayFeed):
            return str(feed["device"])
        device = feed.get("device", "")
        return f"{device}/{feed['sensor']}" if device else ""

    def _note(self, text: str) -> None:
        self._noted += 1
        self._notices.append((self._noted, time.time() * 1e3, text))

    def _report(self) -> None:
        self._broker.publish("status", self.as_json())
