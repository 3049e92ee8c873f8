"""Calibration, sensor and print of a session, as the page works them, under the session's lock.

Flips bring readings back to where the sensor has them, before anything else is done with a frame
but recording it. What is learned is kept in the folder, `NAME.state.json`, as `recognize-object
--learn` keeps it. A request that cannot be met is refused with a `BenchError`.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from encoded_objects.base.errors import EncodedObjectsError
from generator.database.as_built import AsBuilt
from probe.calibration import read_calibration
from probe.circuit import Electronics
from probe.recording.files import next_free
from recognizer.as_built.estimate import ENOUGH_TOUCHES, estimate_parts, keep_prints
from recognizer.as_built.touches import WIDE_SCALE, measure_prints
from recognizer.as_built.verdict import as_built_entry, as_built_sizes
from recognizer.bench.errors import BusyError
from recognizer.bench.files import find_file
from recognizer.bench.frames import PageGuide, page_guide
from recognizer.bench.session import STATE, Session
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
from recognizer.touch.sensor_state import SensorState, unknown_state
from recognizer.touch.source import TouchImage

MOST = 200  #: newest touches to learn from; `recognize-object --learn` takes as many


def begin_calibration(
    session: Session, forces_n: list[float], seconds: float, *, simulated_board: bool
) -> None:
    """Begin a calibration by loads that are read for some seconds each."""
    with session.changed():
        session.probe()
        board = Electronics() if simulated_board else None
        session.frames.guide = page_guide(session.sensor_name(), forces_n, seconds, board)


@contextmanager
def guide_of(session: Session) -> Iterator[PageGuide]:
    """Work on the calibration that is being made; refused if none is."""
    with session.changed():
        if session.frames.guide is None:
            raise BusyError("no calibration is being made", fix="begin one first")
        yield session.frames.guide


def finish_calibration(session: Session) -> dict[str, Any]:
    """Fit the laws, write and use them; returns what they say of the sensor."""
    with guide_of(session) as guide:
        return session.frames.finish_calibration(guide, session.folder)


def cancel_calibration(session: Session) -> None:
    """Forget the calibration that is being made."""
    with session.changed():
        session.frames.guide = None


def use_calibration(session: Session, name: str) -> None:
    """Read newtons by a calibration of the folder; counts if the name is empty.

    Raises CalibrationError: it is none, or another sensor's.
    """
    with session.changed():
        found = None
        if name:
            path = find_file(session.folder, name, ".json")
            found = read_calibration(path, sensor=session.sensor_name() or None)
        session.note(session.frames.state.use(found, name))


def flip_images(session: Session, changes: str) -> None:
    """Read images with changes undone, as `columns,values`; empty: as they come.

    Raises WiringError: a change that is none, or that does not fit the sensor.
    """
    wiring = wiring_named(changes)
    wiring.check(session.sensor.shape)
    with session.changed():
        session.frames.wiring = wiring
        session.note(f"images are flipped: {changes}" if changes else "images as they come")
    _use_state(session, session.recognition.state)


def check_mounting(session: Session, number: int, object_name: str, face: str) -> dict[str, Any]:
    """Say how the sensor is mounted, from a touch that was placed by hand on a face."""
    counts = session.recognition.touches.frame(number).counts
    known = session.frames.state.calibration
    found = find_mounting(_reader(session), counts, (object_name, face), calibration=known)
    if not isinstance(found, FoundMounting):
        return {"found": False, "words": str(found)}
    both = Wiring((*session.frames.wiring.changes, *found.wiring.changes))
    session.mounting = simplify_turns(both, session.sensor.shape).changes
    _use_state(session, session.recognition.state)
    return {
        "found": True,
        "as_drawn": not found.wiring.changes,
        "words": f"the sensor is mounted {WORDS[found.wiring.changes]}",
        "turn_deg": round(found.turn_deg, 1),
        "flip": ",".join(session.mounting),
    }


def _use_state(session: Session, state: SensorState | None) -> None:
    """Read by a state, checked where images are flipped as a touch by hand has shown."""
    shown = session.mounting is not None and session.mounting == session.frames.wiring.changes
    if state is None and shown:
        state = unknown_state(session.sensor, name=session.sensor_name())
    if state is not None:
        state = replace(state, mounting=session.mounting if shown else None)
    session.recognition.use_state(state)


def learn_from_touches(session: Session) -> None:
    """Learn the sensor from the touches of the session, in a thread; then read by it."""
    reader = _reader(session)
    frames = session.recognition.touches.frames()[-MOST:]
    if len(frames) < LEAST_TOUCHES:
        raise BusyError(
            f"{len(frames)} touches were read, {LEAST_TOUCHES} are the least to learn from",
            fix="touch other places of registered faces first",
        )
    with session.lock:
        if session.learning is not None:
            raise BusyError("the sensor is being learned already", fix="wait")
        session.learning = 0.0
    images = [frame.counts for frame in frames]
    threading.Thread(target=_learn, args=(session, reader, images), daemon=True).start()


def _learn(session: Session, reader: Reader, images: list[Any]) -> None:
    def report(share: float) -> None:
        session.learning = round(share, 2)

    try:
        state = learn_sensor(
            reader, images, calibration=session.frames.state.calibration,
            name=session.sensor_name(), done=report,
        )  # fmt: skip
        session.folder.mkdir(parents=True, exist_ok=True)
        path = next_free(session.folder, "sensor", STATE)
        checked = None if reader.state is None else reader.state.mounting
        write_state(replace(state, mounting=checked), path)
        use_learned(session, path.name)
    except EncodedObjectsError as error:
        with session.lock:
            session.note(f"nothing was learned: {error.cause}")
    finally:
        session.learning = None


def use_learned(session: Session, name: str) -> None:
    """Read by what was learned, a file of the folder; by the sensor's type if it is empty.

    Raises SensorStateError: the file is no state of this sensor.
    """
    state, learned = None, None
    if name:
        names = tuple(filter(None, (session.sensor_name(), session.sensor.name)))
        state = read_state(find_file(session.folder, name, STATE), sensors=names)
        learned = {"name": name, "words": state_words(state)}
        if state.mounting is not None:
            session.mounting = state.mounting
            session.frames.wiring = Wiring(state.mounting)
    _use_state(session, state)
    with session.changed():
        session.learned = learned
        session.note(f"read by {name}" if name else "read by the sensor's type alone")


class PrintController:
    """How the part that is touched was printed: the last estimate, which may be kept."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._lock = threading.Lock()
        self._found: tuple[AsBuilt, ...] = ()

    def estimate(self, after: int, material: str) -> dict[str, Any]:
        """Estimate the print from all touches after the one of a number.

        Raises AsBuiltError: the touches do not suffice.
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
        parts = []
        for found, verdict in estimates:
            entry = as_built_entry(found, verdict) | {"sizes": as_built_sizes(found)}
            del entry["covariance"]
            parts.append(entry)
        return {"object": prints[0].object, "touches": len(touches), "parts": parts, "few": few}

    def store(self) -> dict[str, Any]:
        """Keep the estimate in the database; later poses are corrected by it.

        Raises DatabaseError: the database cannot be written.
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
