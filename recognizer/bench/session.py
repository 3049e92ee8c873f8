"""One probe and all that is done with it; every page sees and works one session.

A thread takes the frames of the feed and hands them on (`frames`). Requests come from other
threads; whoever works on the session holds its lock.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import without_password
from encoded_objects.base.sensor_type import SensorType
from probe.frame import Frame
from probe.port.url import address_of
from probe.recording.read import Recording
from recognizer.bench.broker import Broker
from recognizer.bench.encode_object import end_all
from recognizer.bench.errors import BusyError
from recognizer.bench.feed import Feed, ProbeFeed, ReplayFeed
from recognizer.bench.files import find_file, list_files
from recognizer.bench.frames import CalibrationState, FrameHandler
from recognizer.bench.options import LAB
from recognizer.bench.reading import RecognitionThread
from recognizer.bench.simulated import TOUCH, TouchProbe, is_simulation
from recognizer.sensor.learn import LEAST_TOUCHES

Array = NDArray[np.float64]

STATE = ".state.json"  #: ending of the files of learned sensors
WAIT_S = 0.05  #: of the thread for a frame
STATUS_S = 0.25  #: between two reports
NOTICES = 40  #: that are kept for the page
IDLE_S = 5.0  #: without page, recording and calibration, after which the port is closed


class Session:
    """The bench's state, which is published at a broker.

    Objects are those of `database`; empty: none. The folder of recordings and calibrations is made
    when something is written.
    """

    def __init__(self, database: str, folder: Path, sensor: SensorType, broker: Broker) -> None:
        self.database, self.folder, self.sensor = database, folder, sensor
        self.recognition = RecognitionThread(database, sensor, broker)
        self.simulation: TouchProbe | None = None
        self._broker = broker
        self.lock = threading.RLock()
        self.feed: Feed = Feed()
        self._url = ""
        self.frames = FrameHandler(sensor, broker, self.recognition, self.note)
        self._notices: deque[tuple[int, float, str]] = deque(maxlen=NOTICES)
        self._noted = 0
        self._started_ms = time.time() * 1e3
        self.learning: float | None = None  #: share of the learning that is done; None: none is
        self.mounting: tuple[str, ...] | None = None  #: changes that a touch by hand has shown
        self.learned: dict[str, str] | None = None  #: name and words of the state in use
        self.ending = False  #: set by a signal: what reads a whole recording ends
        self._reading = threading.Lock()  #: of a whole recording
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bench", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Let what goes on come to an end; from a signal's handler, so that it takes no lock."""
        self.ending = True
        end_all()

    def close(self, longest_s: float = -1.0) -> None:
        """End everything in order; a recording is complete. Waits no longer for other threads."""
        patience_s = None if longest_s < 0 else longest_s
        self._stop.set()
        self._thread.join(patience_s)
        if self.lock.acquire(timeout=longest_s):
            self._leave()
            self.lock.release()
        self.recognition.close(patience_s)

    @contextmanager
    def changed(self) -> Iterator[None]:
        """Hold the lock, and publish the state after a change."""
        with self.lock:
            yield
            self.report()

    def open(self, url: str, sensor: int | None = None) -> None:
        """Read another port.

        Raises BenchError, PortError, RecordingError, SensorTypeError: the URL cannot be read, names
        no recording, or one of another sensor type.
        """
        replay = self._read_recording(url) if url.startswith("file:") else None
        with self.changed():
            self._leave()
            if is_simulation(url):
                self.simulation = TouchProbe(url, self.database, self.sensor)
                self.feed = ProbeFeed(self.simulation.url, sensor)
            elif replay is not None:
                self.feed = replay
                self.frames.replayed = (Path(replay.recording.path).name, replay.began_ns)
            elif url:
                address_of(url)
                self.feed = ProbeFeed(url, sensor)
            self._url = url

    def read_again(self) -> None:
        """Read the database again: something was registered, perhaps its first object."""
        if not self.database:
            self.use_database(LAB)
            self.open(TOUCH)
        self.recognition.reload()
        if self.simulation is not None:
            self.simulation.forget()

    def _read_recording(self, url: str) -> ReplayFeed:
        """Read a recording as a whole, one at a time; others work meanwhile."""
        if not self._reading.acquire(blocking=False):
            raise BusyError("another recording is being read", fix="wait for it")
        try:
            recording = Recording(address_of(url).target)
            recording.sensor_type(self.sensor)  # of another shape: refused
            return ReplayFeed(recording, lambda: self.ending)
        finally:
            self._reading.release()

    def replay(self, name: str) -> None:
        """Play a recording of the folder."""
        self.open(f"file:{find_file(self.folder, name, '.h5')}")

    def timeline(self) -> ReplayFeed:
        """Return the recording that is played; refused if none is."""
        feed = self.feed
        if not isinstance(feed, ReplayFeed):
            raise BusyError("no recording is played", fix="choose a recording first")
        return feed

    def probe(self) -> ProbeFeed:
        """Return the probe that is connected; refused if none is."""
        feed = self.feed
        if not isinstance(feed, ProbeFeed):
            raise BusyError("no probe is connected", fix="choose a port first")
        return feed

    def select(self, sensor: int) -> None:
        """Read another sensor of the board."""
        with self.changed():
            self.probe().select(sensor)
            self.frames.state = CalibrationState()

    def switch_bias(self, *, on: bool) -> None:
        """Take the bias of the unloaded sensor, or do without it."""
        with self.changed():
            self.note(self.frames.state.switch_bias(on=on))

    def simulated(self) -> TouchProbe:
        """Return the simulated probe; refused if another one is connected."""
        if self.simulation is None:
            raise BusyError(
                "the probe that is connected is not simulated",
                fix="choose the simulated probe to touch by a click",
            )
        return self.simulation

    def use_database(self, database: str) -> None:
        """Read the objects of a database from now on."""
        with self.changed():
            self.database = self.recognition.database = database
            self.recognition.reload()
            self.note(f"objects are those of {without_password(database)}")

    def touch_next(self) -> None:
        """Let the simulated probe make the step that the newest answer proposes."""
        proposed = (self.recognition.touches.newest_answer() or {}).get("next")
        if not proposed:
            raise BusyError("no next touch is proposed", fix="touch the part first")
        self.simulated().step(
            proposed["dx_mm"], proposed["dy_mm"], proposed["turn_deg"], proposed["force_n"]
        )

    def record(self, *, on: bool) -> None:
        """Start or end a recording.

        Raises BusyError, RecordingError: there is nothing to record, or no place for it.
        """
        with self.changed():
            if on:
                self.probe()
                self.frames.start_recording(self.folder, self.sensor_name(), self._url)
            else:
                self.frames.end_recording()

    def newest(self) -> tuple[Frame, Array, str]:
        """Return the newest frame, its readings, and their unit; refused if none came yet."""
        with self.lock:
            return self.frames.newest()

    def as_json(self) -> dict[str, Any]:
        """Return the state for the page."""
        with self.lock:
            return {
                "port": without_password(self._url),
                "feed": self.feed.as_json(),
                "simulated": self.simulation is not None,
                **self.frames.as_json(),
                "recordings": list_files(self.folder, ".h5"),
                "calibrations": [
                    name for name in list_files(self.folder, ".json") if not name.endswith(STATE)
                ],
                **self.sensor_json(),
                "notices": [
                    {"number": n, "at_ms": at_ms, "text": text} for n, at_ms, text in self._notices
                ],
                "pages": len(self._broker.subscribers),
                "started_ms": self._started_ms,
            }  # fmt: skip

    def sensor_json(self) -> dict[str, Any]:
        """Return mounting and learned state of the sensor for the page."""
        return {
            "flip": ",".join(self.frames.wiring.changes),
            "learning": self.learning,
            "learned": self.learned,
            "states": list_files(self.folder, STATE),
            "least": LEAST_TOUCHES,
        }

    def _run(self) -> None:
        due_s, wanted_s = 0.0, time.monotonic()
        while not self._stop.is_set():
            feed = self.feed
            frames = feed.take(WAIT_S)
            now_s = time.monotonic()
            with self.lock:
                if self._broker.subscribers or self.frames.busy:
                    wanted_s = now_s
                feed.rest(wanted=now_s - wanted_s < IDLE_S)
                if feed is self.feed:
                    self.frames.take(frames)
                    for notice in feed.notices():
                        self.note(notice)
                if now_s >= due_s:
                    due_s = now_s + STATUS_S
                    self.report()

    def _leave(self) -> None:
        """Close what is connected; how another sensor is mounted is not known."""
        self.mounting, state = None, self.recognition.state
        self.recognition.use_state(None if state is None else replace(state, mounting=None))
        self.frames.leave()
        feed, self.feed = self.feed, Feed()
        feed.close()
        if self.simulation is not None:
            self.simulation.close()
            self.simulation = None
        self._url = ""

    def sensor_name(self) -> str:
        """Return device and sensor, as recordings name them; empty where nothing is connected."""
        feed = self.feed.as_json()
        if isinstance(self.feed, ReplayFeed):
            return str(feed["device"])
        device = feed.get("device", "")
        return f"{device}/{feed['sensor']}" if device else ""

    def note(self, text: str) -> None:
        """Show the pages a notice."""
        self._noted += 1
        self._notices.append((self._noted, time.time() * 1e3, text))

    def report(self) -> None:
        """Publish the state."""
        self._broker.publish("status", self.as_json())
