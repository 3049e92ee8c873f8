"""How the part at hand was printed, from the touches of the session: estimate, then keep it."""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import Any

from generator.database.as_built import AsBuilt
from probe.frame import Frame
from recognizer.as_built.keep import keep_prints
from recognizer.as_built.parts import estimate_parts
from recognizer.as_built.settings import ESTIMATE, WIDE_SCALE
from recognizer.as_built.touches import feel_prints
from recognizer.as_built.words import as_built_entry, as_built_sizes
from recognizer.bench.errors import BusyError
from recognizer.bench.session import Session
from recognizer.touch.reader import Reader
from recognizer.touch.source import TouchImage


class PrintCheck:
    """The estimate that was made last, which may be kept."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._turn = threading.Lock()
        self._found: tuple[AsBuilt, ...] = ()

    def estimate(self, after: int, material: str) -> dict[str, Any]:
        """Say how the part was printed that was touched since a touch.

        Raises
        ------
        BusyError
            Nothing is read.
        AsBuiltError
            The touches do not tell.
        """
        session = self._session
        reader = session.recognition.reader
        if reader is None:
            raise BusyError("no database is read", fix="start with --database lab.db")
        touches = [_image(frame) for frame in session.recognition.touches.frames(after)]
        with self._turn:
            self._found = ()
            known = session.frames.state.calibration
            felt = feel_prints(_for_prints(reader), touches, calibration=known)
            told, few = estimate_parts(felt, session.database, material)
            self._found = tuple(found for found, _ in told)
        parts = [
            {key: value for key, value in as_built_entry(found, verdict).items()
             if key != "covariance"} | {"sizes": as_built_sizes(found)}
            for found, verdict in told
        ]  # fmt: skip
        return {"object": felt[0].object, "touches": len(touches), "parts": parts, "few": few}

    def store(self) -> dict[str, Any]:
        """Keep the estimate in the database; later poses are corrected by it.

        Raises
        ------
        BusyError
            There is none.
        DatabaseError
            The database cannot be written.
        """
        with self._turn:
            if not self._found:
                raise BusyError("nothing was estimated", fix=f"touch {ESTIMATE.enough} places "
                                "all over the part, then estimate")  # fmt: skip
            printer = keep_prints(self._session.database, self._found)
            self._found = ()
        self._session.recognition.reload()
        return {"stored": True, "printer": printer.printer, "sizes": as_built_sizes(printer)}


@lru_cache(maxsize=1)
def _for_prints(reader: Reader) -> Reader:
    """Return a reader that reads prints which are far off, too."""
    return Reader(reader.lab, reader.sensor, WIDE_SCALE, state=reader.state)


def _image(frame: Frame) -> TouchImage:
    counts = frame.counts.astype(float)
    return TouchImage(frame.seq, frame.t_ns, 1, counts, frame.wrist.astype(float), frame.pose)
