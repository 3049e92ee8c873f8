"""Touch -> answer -> mosaic, in a thread of its own: the newest frame wins.

A frame is read when `ReadTrigger` says so; its answer is published at once, then the first answered
frame of a touch goes into the mosaic of its face. Thesis 4.3, 6.3.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.errors import EncodedObjectsError
from probe.calibration import Calibration, calibrate_image
from probe.errors import ProbeError
from probe.frame import Frame
from probe.sensor import SensorType
from recognizer.bench.answers import answer_json
from recognizer.bench.broker import Broker
from recognizer.bench.message import MosaicMessage, mosaic_message
from recognizer.bench.read_trigger import Phase, ReadTrigger
from recognizer.bench.settings import RECOGNITION
from recognizer.bench.touch_log import TouchLog
from recognizer.scan.mosaic.grow import add_touch
from recognizer.scan.mosaic.mosaic import Mosaic, no_touches
from recognizer.scan.mosaic.touch import PlacedTouch, decoded_place
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.recognition import Recognition
from recognizer.touch.signal import Signal, signal_of


@dataclass(frozen=True, slots=True, eq=False)
class PendingFrame:
    """A frame with what belongs to it."""

    frame: Frame
    calibration: Calibration | None
    received_ms: float
    load: bool = False  #: of a calibration: nothing that is to be read


class RecognitionThread:
    """The thread. `offer`, `reload` and `clear` may be called from any other."""

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
        self._mosaics: OrderedDict[tuple[str, str], Mosaic] = OrderedDict()
        self._grown = 0  #: touch that went into a mosaic last
        self._thread = threading.Thread(target=self._run, name="reading", daemon=True)
        self._thread.start()

    def offer(self, pending: PendingFrame) -> None:
        """Put a frame in the place of the one that waits."""
        with self._news:
            self._pending = pending
            self._news.notify()

    def reload(self) -> None:
        """Read the database again."""
        with self._news:
            self._reload = True
            self._news.notify()

    def clear(self) -> None:
        """Forget the mosaics."""
        with self._news:
            self._mosaics.clear()
        image = no_touches(self.sensor).image
        self._broker.publish("mosaic-of", {"object": None, "face": None, "touches": 0})
        self._broker.publish("mosaic", mosaic_message(image, 0))

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
            self.reader = Reader(open_lab(self.database), self.sensor)
        except EncodedObjectsError as error:
            self.reader = None
            self._tell("off", cause=error.cause, fix=error.fix)
            return
        self._tell("ready")

    def _tell(self, state: str, **more: Any) -> None:
        self._broker.publish("reader", {"state": state, **more})

    def _look(self, pending: PendingFrame) -> None:
        signal = _signal(pending, self.sensor)
        now_s = time.monotonic()
        contact = signal.contact and not pending.load
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
        if answer and self._grown != self.touches.newest:
            self._grow(answer, signal)

    def _follow(self, phase: Phase, pending: PendingFrame) -> None:
        """Begin, move and end records as the touch does."""
        if phase == "none":
            self.touches.lift()
        elif phase == "moving":
            self.touches.move()
        elif phase in ("felt", "read") and not self.touches.is_new():
            self.touches.begin(pending.frame, pending.received_ms)

    def _grow(self, answer: Recognition, signal: Signal) -> None:
        place = decoded_place(answer)
        if place is None or answer.object is None or answer.face is None:
            return
        self._grown = self.touches.newest
        key = (answer.object, answer.face)
        with self._news:
            mosaic = self._mosaics.get(key) or no_touches(self.sensor)
        if len(mosaic) < RECOGNITION.touches:
            mosaic = add_touch(mosaic, PlacedTouch(signal, decoded=place, seq=answer.seq))
        with self._news:
            self._mosaics[key] = mosaic
            self._mosaics.move_to_end(key)
            while len(self._mosaics) > RECOGNITION.faces:
                self._mosaics.popitem(last=False)
        self._broker.publish(
            "mosaic-of",
            {"object": key[0], "face": key[1], "touches": len(mosaic), "most": RECOGNITION.touches},
        )
        self._broker.publish("mosaic", self.picture(mosaic))

    def mosaics(self, object_name: str) -> dict[str, Mosaic]:
        """Return the mosaics of an object's faces."""
        with self._news:
            return {face: one for (held, face), one in self._mosaics.items() if held == object_name}

    def picture(self, mosaic: Mosaic) -> MosaicMessage:
        """Return a mosaic for the pages."""
        return mosaic_message(mosaic.image, len(mosaic))


def _signal(pending: PendingFrame, sensor: SensorType) -> Signal:
    counts: NDArray[np.float64] = pending.frame.counts.astype(np.float64)
    if pending.calibration is None:
        return signal_of(counts, sensor=sensor)
    try:
        found = calibrate_image(counts, pending.calibration)
    except ProbeError:  # another sensor's readings: beyond the board's range
        return signal_of(counts, sensor=sensor)
    trust = 1.0 - found.bad.astype(np.float64)
    return signal_of(found.values, trust=trust, floor=0.0, newtons=True, sensor=sensor)
