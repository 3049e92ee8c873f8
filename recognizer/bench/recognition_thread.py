"""Touch -> answer -> mosaic, in a thread of its own: the newest frame wins.

A frame is read when `ReadTrigger` says so; its answer is published at once, then the first answered
frame of a touch goes into the mosaic of its face (`face_mosaics`), the first one read into the
scan (`scan_mode`). Loads of a calibration are no touches, nor what is left of the last of them.
Thesis 4.3, 6.3.
"""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import EncodedObjectsError
from encoded_objects.base.sensor_type import SensorType
from probe.calibration import Calibration
from probe.errors import ProbeError
from probe.frame import Frame
from recognizer.bench.answers import answer_json
from recognizer.bench.broker import Broker
from recognizer.bench.face_mosaics import FaceMosaics
from recognizer.bench.read_trigger import Phase, ReadTrigger
from recognizer.bench.scan_mode import ScanMode
from recognizer.bench.touch_log import TouchLog
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.sensor_state import SensorState
from recognizer.touch.signal import Signal, signal_of


@dataclass(frozen=True, slots=True, eq=False)
class PendingFrame:
    """A frame with what belongs to it."""

    frame: Frame
    calibration: Calibration | None
    received_ms: float
    load: bool = False  #: of a calibration: nothing that is to be read
    recording: str = ""  #: that is replayed
    at_s: float = 0.0  #: when in it


class RecognitionThread:
    """The thread. `offer`, `reload` and `use_state` may be called from any other."""

    def __init__(self, database: str, sensor: SensorType, broker: Broker) -> None:
        self.database, self.sensor = database, sensor
        self.reader: Reader | None = None
        self._broker = broker
        self._news = threading.Condition()
        self._pending: PendingFrame | None = None
        self._stop = self._reload = False
        self._watch = ReadTrigger()
        self.touches = TouchLog(broker)
        self._answers = 0
        self.mosaics = FaceMosaics(sensor, broker)
        self.scan = ScanMode(sensor, broker)
        self._grown = self._fused = 0  #: touches that went into a mosaic, into a scan, last
        self._loaded = False  #: what is felt is still a load of a calibration
        self._state: SensorState | None = None
        self._thread = threading.Thread(target=self._run, name="reading", daemon=True)
        self._thread.start()

    def offer(self, pending: PendingFrame) -> None:
        """Put a frame in the place of the one that waits."""
        with self._news:
            self._pending = pending
            self._news.notify()

    def use_state(self, state: SensorState | None) -> None:
        """Read by what was learned of the sensor from now on; None: by its type alone.

        Raises
        ------
        SensorStateError
            It is a state of another sensor.
        """
        if self.reader is not None:
            self.reader = replace(self.reader, state=state)
        self._state = state

    def reload(self) -> None:
        """Read the database again."""
        with self._news:
            self._reload = True
            self._news.notify()

    def close(self) -> None:
        """End the thread."""
        with self._news:
            self._stop = True
            self._news.notify()
        self._thread.join()

    def _run(self) -> None:
        self._prepare()
        while True:
            with self._news:
                self._news.wait_for(lambda: self._pending or self._stop or self._reload)
                pending, self._pending = self._pending, None
                reload_, self._reload = self._reload, False
                if self._stop:
                    return
            if reload_:
                self._prepare()
            if pending is not None:
                self._look(pending)

    def _prepare(self) -> None:
        if not self.database:
            self._tell("off", cause="no database is open", fix="start with --database lab.db")
            return
        self._tell("preparing")
        try:
            self.reader = Reader(open_lab(self.database), self.sensor, state=self._state)
        except EncodedObjectsError as error:
            self.reader = None
            self._tell("off", cause=error.cause, fix=error.fix)
            return
        self._tell("ready")

    def _tell(self, state: str, **more: Any) -> None:
        self._broker.publish("reader", {"state": state, **more})

    def _look(self, pending: PendingFrame) -> None:
        signal = _signal(pending, self.reader, self.sensor)
        now_s = time.monotonic()
        self._loaded = pending.load or (self._loaded and signal.contact)
        contact = signal.contact and not self._loaded
        phase = self._watch.phase(signal.forces, contact=contact, now_s=now_s)
        self._follow(phase, pending)
        if phase not in ("read", "again") or self.reader is None:
            return
        if phase == "read":
            self.touches.read(pending.frame)
        answer = recognise(self.reader, signal, pending.frame.seq)
        done_s = time.monotonic()
        self._watch.read(signal.forces, answered=bool(answer), now_s=done_s)
        self._answers += 1
        self.touches.conclude(
            answer_json(answer, self.reader.lab, self.sensor)
            | {
                "read": self._answers,
                "read_ms": round(1e3 * (done_s - now_s), 1),
                "received_ms": pending.received_ms,
                "answered_ms": time.time() * 1e3,
            },
            answered=bool(answer),
        )
        number = self.touches.newest
        if phase == "read" and self._fused != number:
            self._fused = number
            self.scan.add(self.reader, signal, number)
        if answer and self._grown != number:
            self._grown = number
            self.mosaics.grow(answer, signal)

    def _follow(self, phase: Phase, pending: PendingFrame) -> None:
        """Begin, move and end records as the touch does."""
        if phase == "none":
            self.touches.lift()
        elif phase == "moving":
            self.touches.move()
        elif phase in ("felt", "read") and not self.touches.is_new():
            self.touches.begin(pending.frame, pending.received_ms, pending.recording, pending.at_s)


def _signal(pending: PendingFrame, reader: Reader | None, sensor: SensorType) -> Signal:
    """Return the signal as the reader has it; without a database the image alone."""
    counts: NDArray[np.float64] = pending.frame.counts.astype(np.float64)
    if reader is None:
        return signal_of(counts, sensor=sensor)
    try:
        return reader.signal(counts, calibration=pending.calibration)
    except ProbeError:  # another sensor's readings: beyond the board's range
        return reader.signal(counts)
