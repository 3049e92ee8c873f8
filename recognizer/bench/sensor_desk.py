"""What the page asks of the sensor itself: how it is mounted, and what touches tell of it.

Flips bring readings back to where the sensor has them, before anything else is done with a frame
but recording it. What is learned is kept in the folder, `NAME.state.json`, as `recognize-object
--learn` keeps it.
"""

from __future__ import annotations

import threading
from typing import Any

from encoded_objects.base.errors import EncodedObjectsError
from probe.recording.files import next_free
from recognizer.bench.desk import DeskSession
from recognizer.bench.errors import BusyError
from recognizer.bench.files import find_file, list_files
from recognizer.bench.settings import DESK
from recognizer.sensor.file import read_state, write_state
from recognizer.sensor.learn import learn_sensor
from recognizer.sensor.mounting import WORDS, FoundMounting, find_mounting, simplify_turns
from recognizer.sensor.settings import LEARNING
from recognizer.sensor.wiring import Wiring, wiring_named
from recognizer.sensor.words import state_words
from recognizer.touch.reader import Reader

STATE = ".state.json"


class SensorDesk:
    """Mounting and state of the sensor that a session reads."""

    def __init__(self, session: DeskSession) -> None:
        self._session = session
        self._share: float | None = None  #: of the learning that is done; None: nothing is learned
        self._name = self._words = ""  #: of the state that is read by

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
        with session.turn:
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
        found = find_mounting(self._reader(), frame.counts, (object_name, face), calibration=known)
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
        reader = self._reader()
        frames = session.recognition.touches.frames()[-DESK.most :]
        if len(frames) < LEARNING.least:
            raise BusyError(
                f"{len(frames)} touches were read, {LEARNING.least} are the least to learn from",
                fix="touch other places of registered faces first",
            )
        with session.turn:
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
        with session.turn:
            self._name, self._words = name, "" if state is None else state_words(state)
            session.note(f"read by {name}" if name else "read by the sensor's type alone")
            session.report()

    def as_json(self) -> dict[str, Any]:
        """Return what the pages show."""
        return {
            "flip": ",".join(self._session.frames.wiring.changes),
            "learning": self._share,
            "learned": {"name": self._name, "words": self._words} if self._name else None,
            "states": list_files(self._session.folder, STATE),
            "least": LEARNING.least,
        }

    def _reader(self) -> Reader:
        reader = self._session.recognition.reader
        if reader is None:
            raise BusyError("no database is read", fix="start with --database lab.db")
        return reader

    def _learn(self, reader: Reader, images: list[Any]) -> None:
        session = self._session

        def tell(share: float) -> None:
            self._share = round(share, 2)

        try:
            state = learn_sensor(
                reader, images, calibration=session.frames.state.calibration,
                name=session.sensor_name(), done=tell,
            )  # fmt: skip
            session.folder.mkdir(parents=True, exist_ok=True)
            path = next_free(session.folder, "sensor", STATE)
            write_state(state, path)
            self.use(path.name)
        except EncodedObjectsError as error:
            with session.turn:
                session.note(f"nothing was learned: {error.cause}")
        finally:
            self._share = None
