"""What the page asks of calibrations: bias, a new one load by load, one of the folder."""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from probe.calibration import read_calibration
from probe.circuit import Electronics
from recognizer.bench.calibration_guide import PageGuide, page_guide
from recognizer.bench.desk import DeskSession
from recognizer.bench.errors import BenchError, BusyError
from recognizer.bench.feed import ProbeFeed
from recognizer.bench.files import find_file
from recognizer.bench.settings import SESSION


class CalibrationDesk:
    """The calibration of the sensor that a session reads."""

    def __init__(self, session: DeskSession) -> None:
        self._session = session

    def bias(self, *, on: bool) -> None:
        """Take the bias of the unloaded sensor, or do without it."""
        session = self._session
        with session.turn:
            session.note(session.frames.state.switch_bias(on=on))
            session.report()

    def begin(self, forces_n: list[float], seconds: float, *, simulated_board: bool) -> None:
        """Begin a calibration.

        Raises
        ------
        BenchError, BusyError
            For loads or times that are none, or without a probe.
        """
        low, high = SESSION.calibration_s
        if not low <= seconds <= high:
            raise BenchError(f"{seconds:g} s for a load", fix=f"give {low:g} to {high:g} s")
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        board = Electronics() if simulated_board else None
        session = self._session
        with session.turn:
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
            When none is.
        """
        session = self._session
        with session.turn:
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
        with session.turn:
            session.frames.guide = None
            session.report()

    def use(self, name: str) -> None:
        """Read newtons by a calibration of the folder; counts if the name is empty.

        Raises
        ------
        CalibrationError
            When it is none, or another sensor's.
        """
        session = self._session
        with session.turn:
            found = None
            if name:
                path = find_file(session.folder, name, ".json")
                found = read_calibration(path, sensor=session.sensor_name() or None)
            session.note(session.frames.state.use(found, name))
            session.report()
