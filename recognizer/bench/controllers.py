"""What the page asks of calibration, sensor and print; each works on the session under its lock.

Flips bring readings back to where the sensor has them, before anything else is done with a frame
but recording it. What is learned is kept in the folder, `NAME.state.json`, as `recognize-object
--learn` keeps it.
"""

from __future__ import annotations

import datetime
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from encoded_objects.base.errors import EncodedObjectsError
from generator.database.as_built import AsBuilt
from probe.calibration import read_calibration
from probe.circuit import Electronics
from probe.recording.files import next_free
from recognizer.as_built.estimate import ENOUGH_TOUCHES, estimate_parts, keep_prints
from recognizer.as_built.touches import WIDE_SCALE, measure_prints
from recognizer.as_built.verdict import as_built_entry, as_built_sizes
from recognizer.bench.calibration import PageGuide, page_guide
from recognizer.bench.errors import BenchError, BusyError
from recognizer.bench.feed import ProbeFeed
from recognizer.bench.files import find_file, list_files
from recognizer.sensor.file import read_state, state_words, write_state
from recognizer.sensor.learn import LEAST_TOUCHES, learn_sensor
from recognizer.sensor.wiring import (
    WORDS,
    FoundMounting,
    Wiring,
    find_mounting,
    simplify_turns,
    wiring_named,
)
from recognizer.touch.reader import Reader
from recognizer.touch.source import TouchImage

if TYPE_CHECKING:
    from recognizer.bench.session import Session

STATE = ".state.json"
LOAD_S = (0.2, 60.0)  #: to read one load of a calibration
MOST = 200  #: newest touches to learn from; `recognize-object --learn` takes as many


class CalibrationController:
    """The calibration of the sensor that a session reads."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def bias(self, *, on: bool) -> None:
        """Take the bias of the unloaded sensor, or do without it."""
        session = self._session
        with session.lock:
            session.note(session.frames.state.switch_bias(on=on))
            session.report()

    def begin(self, forces_n: list[float], seconds: float, *, simulated_board: bool) -> None:
        """Begin a calibration.

        Raises
        ------
        BenchError, BusyError
            Loads or times that are none, or no probe.
        """
        low, high = LOAD_S
        if not low <= seconds <= high:
            raise BenchError(f"{seconds:g} s for a load", fix=f"give {low:g} to {high:g} s")
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        board = Electronics() if simulated_board else None
        session = self._session
        with session.lock:
            if not isinstance(session.feed, ProbeFeed):
                raise BusyError("no probe is connected", fix="choose a port first")
            name = session.sensor_name()
            session.frames.guide = page_guide(name, forces_n, seconds, board, now)
            session.report()

    @contextmanager
    def guide(self) -> Iterator[PageGuide]:
        """Work on the calibration that is being made.

        Raises
        ------
        BusyError
            None is being made.
        """
        session = self._session
        with session.lock:
            if session.frames.guide is None:
                raise BusyError("no calibration is being made", fix="begin one first")
            yield session.frames.guide
            session.report()

    def finish(self) -> dict[str, Any]:
        """Fit the laws, write and use them; returns what they say of the sensor."""
        with self.guide() as guide:
            return self._session.frames.finish_calibration(guide, self._session.folder)

    def cancel(self) -> None:
        """Forget the calibration that is being made."""
        session = self._session
        with session.lock:
            session.frames.guide = None
            session.report()

    def use(self, name: str) -> None:
        """Read newtons by a calibration of the folder; counts if the name is empty.

        Raises
        ------
        CalibrationError
            It is none, or another sensor's.
        """
        session = self._session
        with session.lock:
            found = None
            if name:
                path = find_file(session.folder, name, ".json")
                found = read_calibration(path, sensor=session.sensor_name() or None)
            session.note(session.frames.state.use(found, name))
            session.report()


class SensorController:
    """Mounting and learned state of the sensor that a session reads."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._share: float | None = None  #: of the learning that is done; None: nothing is learned
        self._name = self._text = ""  #: of the state in use

    def flip(self, changes: str) -> None:
        """Read images with changes undone, as `columns,values`; empty: as they come.

        Raises
        ------
        WiringError
            A change that is none, or that does not fit the sensor.
        """
        session = self._session
        wiring = wiring_named(changes)
        wiring.check(session.sensor.shape)
        with session.lock:
            session.frames.wiring = wiring
            session.note(f"images are flipped: {changes}" if changes else "images as they come")
            session.report()

    def mounting(self, number: int, object_name: str, face: str) -> dict[str, Any]:
        """Say how the sensor is mounted, from a touch that was placed by hand on a face.

        Raises
        ------
        BusyError, UnknownError
            Nothing can be read, or there is no such touch.
        """
        session = self._session
        frame = session.recognition.touches.frame(number)
        known = session.frames.state.calibration
        found = find_mounting(
            _reader(session), frame.counts, (object_name, face), calibration=known
        )
        if not isinstance(found, FoundMounting):
            return {"found": False, "words": str(found)}
        both = simplify_turns(
            Wiring((*session.frames.wiring.changes, *found.wiring.changes)), session.sensor.shape
        )
        return {
            "found": True,
            "as_drawn": not found.wiring.changes,
            "words": f"the sensor is mounted {WORDS[found.wiring.changes]}",
            "turn_deg": round(found.turn_deg, 1),
            "flip": ",".join(both.changes),
        }

    def learn(self) -> None:
        """Learn the sensor from the touches of the session, in a thread; then read by it.

        Raises
        ------
        BusyError
            There are too few touches, no reader, or it is being done.
        """
        session = self._session
        reader = _reader(session)
        frames = session.recognition.touches.frames()[-MOST:]
        if len(frames) < LEAST_TOUCHES:
            raise BusyError(
                f"{len(frames)} touches were read, {LEAST_TOUCHES} are the least to learn from",
                fix="touch other places of registered faces first",
            )
        with session.lock:
            if self._share is not None:
                raise BusyError("the sensor is being learned already", fix="wait")
            self._share = 0.0
        images = [frame.counts for frame in frames]
        threading.Thread(target=self._learn, args=(reader, images), daemon=True).start()

    def use(self, name: str) -> None:
        """Read by what was learned, a file of the folder; by the sensor's type if it is empty.

        Raises
        ------
        SensorStateError
            The file is no state of this sensor.
        """
        session = self._session
        state = None
        if name:
            names = tuple(filter(None, (session.sensor_name(), session.sensor.name)))
            state = read_state(find_file(session.folder, name, STATE), sensors=names)
        session.recognition.use_state(state)
        with session.lock:
            self._name, self._text = name, "" if state is None else state_words(state)
            session.note(f"read by {name}" if name else "read by the sensor's type alone")
            session.report()

    def as_json(self) -> dict[str, Any]:
        """Return what the pages show."""
        return {
            "flip": ",".join(self._session.frames.wiring.changes),
            "learning": self._share,
            "learned": {"name": self._name, "words": self._text} if self._name else None,
            "states": list_files(self._session.folder, STATE),
            "least": LEAST_TOUCHES,
        }

    def _learn(self, reader: Reader, images: list[Any]) -> None:
        session = self._session

        def report(share: float) -> None:
            self._share = round(share, 2)

        try:
            state = learn_sensor(
                reader, images, calibration=session.frames.state.calibration,
                name=session.sensor_name(), done=report,
            )  # fmt: skip
            session.folder.mkdir(parents=True, exist_ok=True)
            path = next_free(session.folder, "sensor", STATE)
            write_state(state, path)
            self.use(path.name)
        except EncodedObjectsError as error:
            with session.lock:
                session.note(f"nothing was learned: {error.cause}")
        finally:
            self._share = None


class PrintController:
    """How the part that is touched was printed: the last estimate, which may be kept."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._lock = threading.Lock()
        self._found: tuple[AsBuilt, ...] = ()

    def estimate(self, after: int, material: str) -> dict[str, Any]:
        """Estimate the print from all touches after the one of a number.

        Raises
        ------
        BusyError
            Nothing is read.
        AsBuiltError
            The touches do not suffice.
        """
        session = self._session
        known = _reader(session)
        reader = Reader(known.lab, known.sensor, WIDE_SCALE, state=known.state)
        touches = [
            TouchImage(frame.seq, frame.t_ns, 1, frame.counts.astype(float),
                       frame.wrist.astype(float), frame.pose)
            for frame in session.recognition.touches.frames(after)
        ]  # fmt: skip
        with self._lock:
            self._found = ()
            prints = measure_prints(reader, touches, calibration=session.frames.state.calibration)
            estimates, few = estimate_parts(prints, session.database, material)
            self._found = tuple(found for found, _ in estimates)
        parts = [
            {key: value for key, value in as_built_entry(found, verdict).items()
             if key != "covariance"} | {"sizes": as_built_sizes(found)}
            for found, verdict in estimates
        ]  # fmt: skip
        return {"object": prints[0].object, "touches": len(touches), "parts": parts, "few": few}

    def store(self) -> dict[str, Any]:
        """Keep the estimate in the database; later poses are corrected by it.

        Raises
        ------
        BusyError
            There is none.
        DatabaseError
            The database cannot be written.
        """
        with self._lock:
            if not self._found:
                raise BusyError("nothing was estimated", fix=f"touch {ENOUGH_TOUCHES} places "
                                "all over the part, then estimate")  # fmt: skip
            printer = keep_prints(self._session.database, self._found)
            self._found = ()
        self._session.recognition.reload()
        return {"stored": True, "printer": printer.printer, "sizes": as_built_sizes(printer)}


def _reader(session: Session) -> Reader:
    reader = session.recognition.reader
    if reader is None:
        raise BusyError("no database is read", fix="start with --database lab.db")
    return reader
