"""Frames -> answers, mosaics and one belief of a scan, in a thread of its own.

A touch is read as soon as it is steady, and again when it has changed, by the newest frame then:
the page wants an answer at once, so one steady frame is enough (`recognizer.touch.source`
averages many). Frames wait while one is read, so that a touch that came and went meanwhile is
read, too. A touch that was not answered is read again, and one that never comes to rest is
read after a while. Its answer is published at once; then the first answered frame of a touch goes
into the mosaic of its face, the first one read into the scan. Loads of a calibration are no
touches, nor what is left of the last of them. Thesis 4.3, 6.3.
"""

from __future__ import annotations

import math
import threading
import time
from collections import OrderedDict, deque
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import EncodedObjectsError
from encoded_objects.base.sensor_type import SensorType
from probe.calibration import Calibration
from probe.errors import ProbeError
from probe.frame import Frame
from recognizer.bench.answers import answer_json
from recognizer.bench.broker import Broker
from recognizer.bench.message import mosaic_message
from recognizer.bench.touch_log import TouchLog
from recognizer.scan.mosaic.mosaic import Mosaic, add_touch, no_touches
from recognizer.scan.mosaic.planar import PlacedTouch, decoded_place
from recognizer.scan.session import Scan
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Recognition
from recognizer.touch.sensor_state import SensorState
from recognizer.touch.signal import Signal, signal_of

Array = NDArray[np.float64]

STEADY = 0.15  #: share of the forces that may change from frame to frame; noise alone changes 0.1
CHANGED = 0.35  #: share by which a new touch differs from the one that was read, at equal strength
RESTLESS_S = 0.3  #: after so long a touch is read although it moves
AGAIN_S = 0.4  #: after so long a touch that was not answered is read again
FACES = 24  #: mosaics that are kept
MOSAIC_TOUCHES = 300  #: of one mosaic; more cost time and show nothing new
LIKELIEST = 4  #: places of a step of a scan that pages get
STEPS = 60  #: newest steps of a scan that are kept
WAITING = 1024  #: newest frames that wait to be read; a recording brings up to 512 at a time

Phase = Literal["none", "felt", "moving", "read", "again", "held"]
"""none: nothing is touched. felt: a touch has begun that was not read yet. moving: it differs from
what was read. read, again: read this frame; again: it was read and not answered. held: nothing is
to be done."""


@dataclass(slots=True)
class ReadTrigger:
    """When a touch is worth reading; a mutable value: the touch at hand."""

    _before: Array | None = None
    _read: Array | None = None
    _since_s: float = 0.0
    _read_s: float = 0.0
    _answered: bool = False

    def phase(self, forces: Array, *, contact: bool, now_s: float, newest: bool = True) -> Phase:
        """Return what a frame is, by its forces (rows, columns) over the background.

        `now_s` is any clock, s. What was read is read again by the newest frame alone.
        """
        before, self._before = self._before, forces if contact else None
        if not contact:
            self._read = None
            return "none"
        if before is None:
            self._since_s = now_s
            return "felt"
        changed = (
            self._read is None
            or _relative_difference(_normalized(forces), _normalized(self._read)) > CHANGED
        )
        if _relative_difference(forces, before) < STEADY:
            self._since_s = now_s
        elif now_s - self._since_s < RESTLESS_S:
            return "felt" if self._read is None else "moving" if changed else "held"
        if changed:
            return "read" if newest or self._read is None else "moving"
        due = newest and not self._answered and now_s - self._read_s > AGAIN_S
        return "again" if due else "held"

    def read(self, forces: Array, *, answered: bool, now_s: float) -> None:
        """Remember the frame that was read."""
        self._read, self._answered = forces, answered
        self._read_s = now_s


class ScanMode:
    """One belief of all touches since it was switched on; any thread may call. Thesis 6.3.

    Topic `scan`: whether it is on, what all touches say together, and a step for each touch: in how
    many places the probe may stand after it (the exponential of the belief's entropy), and the
    likeliest of them; and how many registered places would match as well by chance.
    """

    def __init__(self, sensor: SensorType, broker: Broker) -> None:
        self._sensor, self._broker = sensor, broker
        self._turn = threading.Lock()
        self._scan: Scan | None = None
        self._on = False
        self._steps: list[dict[str, Any]] = []
        self._answer: dict[str, Any] | None = None
        self._publish()

    def switch(self, *, on: bool) -> None:
        """Begin with no touches, or end."""
        with self._turn:
            self._scan, self._on = None, on
            self._steps, self._answer = [], None
            self._publish()

    def add(self, reader: Reader, signal: Signal, number: int) -> None:
        """Take a touch that was read, if touches are fused."""
        with self._turn:
            if not self._on:
                return
            if self._scan is None:
                self._scan = Scan(reader)
            scan = self._scan
            answer = scan.add(signal, seq=number)
            self._answer = answer_json(answer, reader.lab, self._sensor)
            places = scan.places
            entropy = -sum(one.share * math.log(one.share) for one in places if one.share > 0)
            self._steps.append({
                "touch": number,
                "places": round(math.exp(entropy), 2) if places else None,
                "likeliest": [
                    {"object": one.object, "face": one.face, "index": list(one.index),
                     "share": round(one.share, 4)}
                    for one in places[:LIKELIEST]
                ],
                "answered": bool(answer), "doubt": answer.doubt,
            })  # fmt: skip
            del self._steps[:-STEPS]
            self._publish()

    def _publish(self) -> None:
        scan = self._scan
        self._broker.publish("scan", {
            "on": self._on,
            "touches": 0 if scan is None else scan.touches,
            "changes": 0 if scan is None else scan.changes,
            "answer": self._answer, "steps": self._steps,
        })  # fmt: skip


class FaceMosaics:
    """A mosaic for each of the faces touched last; any thread may call."""

    def __init__(self, sensor: SensorType, broker: Broker) -> None:
        self._sensor, self._broker = sensor, broker
        self._turn = threading.Lock()
        self._mosaics: OrderedDict[tuple[str, str], Mosaic] = OrderedDict()

    def grow(self, answer: Recognition, signal: Signal) -> None:
        """Put an answered touch into the mosaic of its face, and publish it."""
        place = decoded_place(answer)
        if place is None or answer.object is None or answer.face is None:
            return
        key = (answer.object, answer.face)
        with self._turn:
            mosaic = self._mosaics.get(key) or no_touches(self._sensor)
        if len(mosaic) < MOSAIC_TOUCHES:
            mosaic = add_touch(mosaic, PlacedTouch(signal, decoded=place, seq=answer.seq))
        with self._turn:
            self._mosaics[key] = mosaic
            self._mosaics.move_to_end(key)
            while len(self._mosaics) > FACES:
                self._mosaics.popitem(last=False)
        of = {"object": key[0], "face": key[1], "touches": len(mosaic), "most": MOSAIC_TOUCHES}
        self._broker.publish("mosaic-of", of)
        self._broker.publish("mosaic", mosaic_message(mosaic.image, len(mosaic)))

    def clear(self) -> None:
        """Forget them."""
        with self._turn:
            self._mosaics.clear()
        self._broker.publish("mosaic-of", {"object": None, "face": None, "touches": 0})
        self._broker.publish("mosaic", mosaic_message(no_touches(self._sensor).image, 0))

    def touches(self, object_name: str) -> dict[str, int]:
        """Return how many touches the mosaics of an object's faces hold, by face."""
        with self._turn:
            return {
                face: len(one) for (held, face), one in self._mosaics.items() if held == object_name
            }

    def picture(self, object_name: str, face: str) -> bytes | None:
        """Return the mosaic of a face; None where it was not touched."""
        with self._turn:
            mosaic = self._mosaics.get((object_name, face))
        return None if mosaic is None else mosaic_message(mosaic.image, len(mosaic))


@dataclass(frozen=True, slots=True, eq=False)
class PendingFrame:
    """A frame that waits to be read."""

    frame: Frame
    calibration: Calibration | None
    received_ms: float
    load: bool = False  #: of a calibration, which is not read
    recording: str = ""  #: that is replayed
    at_s: float = 0.0  #: when in it


class RecognitionThread:
    """Reads frames; `offer`, `reload` and `use_state` may be called from any thread."""

    def __init__(self, database: str, sensor: SensorType, broker: Broker) -> None:
        self.database, self.sensor = database, sensor
        self.reader: Reader | None = None
        self._broker = broker
        self._news = threading.Condition()
        self._pending: deque[PendingFrame] = deque(maxlen=WAITING)
        self._stop = self._reload = False
        self._trigger = ReadTrigger()
        self.touches = TouchLog(broker)
        self._answers = 0
        self.mosaics = FaceMosaics(sensor, broker)
        self.scan = ScanMode(sensor, broker)
        self._grown = self._fused = 0  #: touches that went into a mosaic, into a scan, last
        self._loaded = False  #: a load of a calibration is still on
        self.state: SensorState | None = None  #: in use
        self._thread = threading.Thread(target=self._run, name="reading", daemon=True)
        self._thread.start()

    def offer(self, pending: PendingFrame) -> None:
        """Let a frame wait behind others."""
        with self._news:
            self._pending.append(pending)
            self._news.notify()

    def use_state(self, state: SensorState | None) -> None:
        """Read by what was learned of the sensor from now on; None: by its type alone.

        Raises SensorStateError: it is a state of another sensor.
        """
        if self.reader is not None:
            self.reader = replace(self.reader, state=state)
        self.state = state

    def reload(self) -> None:
        """Read the database again."""
        with self._news:
            self._reload = True
            self._news.notify()

    def close(self, longest_s: float | None = None) -> None:
        """End the thread; wait no longer than that for it."""
        with self._news:
            self._stop = True
            self._news.notify()
        self._thread.join(longest_s)

    def _run(self) -> None:
        self._prepare()
        while True:
            with self._news:
                self._news.wait_for(lambda: self._pending or self._stop or self._reload)
                pending = self._pending.popleft() if self._pending else None
                newest = not self._pending
                reload_, self._reload = self._reload, False
                if self._stop:
                    return
            if reload_:
                self._prepare()
            if pending is not None:
                self._read(pending, newest=newest)

    def _prepare(self) -> None:
        if not self.database:
            self._publish("off", cause="no database is open", fix="start with --database lab.db")
            return
        self._publish("preparing")
        try:
            self.reader = Reader(open_lab(self.database), self.sensor, state=self.state)
        except EncodedObjectsError as error:
            self.reader = None
            self._publish("off", cause=error.cause, fix=error.fix)
            return
        self._publish("ready")

    def _publish(self, state: str, **more: Any) -> None:
        self._broker.publish("reader", {"state": state, **more})

    def _read(self, pending: PendingFrame, *, newest: bool) -> None:
        signal = _signal(pending, self.reader, self.sensor)
        now_s = time.monotonic()
        self._loaded = pending.load or (self._loaded and signal.contact)
        contact = signal.contact and not self._loaded
        phase = self._trigger.phase(signal.forces, contact=contact, now_s=now_s, newest=newest)
        self._follow(phase, pending)
        if phase not in ("read", "again") or self.reader is None:
            return
        if phase == "read":
            self.touches.read(pending.frame)
        answer = self.reader.answer(signal, pending.frame.seq)
        done_s = time.monotonic()
        self._trigger.read(signal.forces, answered=bool(answer), now_s=done_s)
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


def _relative_difference(a: Array, b: Array) -> float:
    return float(np.abs(a - b).sum() / max(float(np.maximum(a, b).sum()), 1e-12))


def _normalized(forces: Array) -> Array:
    return np.asarray(forces / max(float(forces.sum()), 1e-9))
