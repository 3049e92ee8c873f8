"""What is done with each frame of a sensor: recorded, calibrated with, shown, read.

Frames -> recording, calibration, the topic `frame`, the thread that recognises. The session holds
its lock around every call. A new calibration is made by the guide of `probe.calibration`, whose
steps the page shows. Thesis 4.2.
"""

from __future__ import annotations

import datetime
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.calibration import (
    Calibration,
    Condition,
    calibrate_image,
    calibration_from,
    calibration_hash,
    drift_of,
    even_load,
    write_calibration,
)
from probe.calibration.guide import CalibrationGuide
from probe.calibration.load import BIAS_FRAMES
from probe.circuit import Electronics
from probe.errors import ProbeError
from probe.frame import Frame
from probe.recording.files import next_free
from probe.recording.record import Recorder
from recognizer.bench.broker import Broker
from recognizer.bench.errors import BenchError, BusyError
from recognizer.bench.message import FrameMessage
from recognizer.bench.reading import PendingFrame, RecognitionThread
from recognizer.sensor.wiring import Wiring

Array = NDArray[np.float64]

MOST_LOADS = 12
LOAD_S = (0.2, 60.0)  #: to read one load of a calibration


@dataclass(slots=True)
class CalibrationState:
    """A mutable value: calibration and bias of the sensor that is read."""

    calibration: Calibration | None = None
    name: str = ""  #: of its file
    warning: str = ""  #: that it does not hold any more
    bias: Array | None = None  #: (rows, columns) counts; None: not taken
    _resting: list[NDArray[np.uint16]] | None = None

    def take(self, frame: Frame) -> list[str]:
        """Take a frame while the bias is being taken; returns notices."""
        if self._resting is None:
            return []
        self._resting.append(frame.counts)
        if len(self._resting) < BIAS_FRAMES:
            return []
        frames, self._resting = np.stack(self._resting), None
        self.bias = frames.mean(axis=0)
        notices = [f"the bias is the mean of {BIAS_FRAMES} frames"]
        if self.calibration is not None:
            self.warning = drift_of(self.calibration, frames).warning
            notices.append(self.warning or "the calibration still holds")
        return notices

    def values(self, frame: Frame) -> tuple[Array, bool, str]:
        """Return readings (rows, columns), whether they are newtons, and a notice.

        A calibration that does not fit the frame is switched off.
        """
        notice = ""
        if self.calibration is not None:
            try:
                return calibrate_image(frame, self.calibration).values, True, ""
            except ProbeError as error:
                self.use(None)
                notice = f"calibration off: {error.cause}"
        return frame.counts.astype(np.float64), False, notice

    def switch_bias(self, *, on: bool) -> str:
        """Begin to take the bias, or do without it; returns a notice."""
        self.bias, self._resting = None, [] if on else None
        return "taking the bias: keep the sensor unloaded" if on else "bias off"

    def use(self, calibration: Calibration | None, name: str = "") -> str:
        """Read newtons from now on, or counts; returns a notice."""
        self.calibration, self.name, self.warning = calibration, name, ""
        return f"readings are newtons by {name}" if calibration else "readings are counts"

    def as_json(self) -> dict[str, Any]:
        """Return both for the page."""
        known = self.calibration
        taken = "none" if self.bias is None else "taken"
        return {
            "bias": taken if self._resting is None else "taking",
            "calibration": None if known is None else {
                "name": self.name,
                "made": known.made,
                "age": _age(known.made),
                "bad": int(known.bad.sum()),
                "warning": self.warning,
            },
        }  # fmt: skip


@dataclass(slots=True)
class PageGuide:
    """A mutable value: a calibration that is being made."""

    sensor: str
    guide: CalibrationGuide
    board: Electronics | None

    def read(self) -> None:
        """Read the load that is on the sensor now; refused where none is asked for."""
        if self.guide.done or self.guide.reading:
            raise BusyError("no load is asked for now", fix="wait, or finish the calibration")
        self.guide.read()

    def calibration(self) -> Calibration:
        """Return the laws.

        Raises BusyError, CalibrationError: loads are missing, or do not determine the laws.
        """
        if not self.guide.done:
            raise BusyError("loads are missing", fix="read every load first")
        rest, *taken = self.guide.taken
        loads = [
            even_load(counts, force, name=f"{force:g} N")
            for counts, force in zip(taken, self.guide.forces_n, strict=True)
        ]
        made = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        return calibration_from(rest, loads, sensor=self.sensor, made=made, board=self.board)

    def as_json(self) -> dict[str, Any]:
        """Return the step for the page."""
        guide = self.guide
        ask = "Unload the sensor." if guide.step == 0 else f"Put {guide.newtons:g} N on, evenly."
        return {
            "step": guide.step,
            "steps": guide.steps,
            "newtons": guide.newtons,
            "ask": "Every load was read." if guide.done else ask,
            "reading": guide.reading,
            "done": guide.done,
            "felt": list(guide.described),
        }


def page_guide(
    sensor: str, forces_n: list[float], seconds: float, board: Electronics | None
) -> PageGuide:
    """Return the guide for loads that are read for some seconds each.

    Raises BenchError: loads or seconds that are none.
    """
    low, high = LOAD_S
    if not low <= seconds <= high:
        raise BenchError(f"{seconds:g} s for a load", fix=f"give {low:g} to {high:g} s")
    sound = all(math.isfinite(force) and 0 < force <= 10_000 for force in forces_n)
    if not sound or not 1 <= len(forces_n) <= MOST_LOADS:
        raise BenchError(
            f"loads {forces_n}", fix=f"give 1 to {MOST_LOADS} forces above 0 N, rising"
        )
    return PageGuide(sensor, CalibrationGuide(forces_n, seconds), board)


class FrameHandler:
    """Recorder, calibration and guide of the sensor that is read.

    Every newest frame goes to the broker and to recognition; `note` gets notices for the operator.
    """

    def __init__(
        self,
        sensor: SensorType,
        broker: Broker,
        recognition: RecognitionThread,
        note: Callable[[str], None],
    ) -> None:
        self.guide: PageGuide | None = None
        self.state = CalibrationState()
        self.replayed = ("", 0)  #: recording that the frames are of, and its first time (ns)
        self.wiring = Wiring()  #: of images as they come; recordings keep these
        self._sensor, self._broker, self._recognition = sensor, broker, recognition
        self._note = note
        self._newest: Frame | None = None
        self._refused_shape: tuple[int, ...] | None = None  # of frames that are not shown
        self._recorder: Recorder | None = None

    @property
    def busy(self) -> bool:
        """Whether frames are recorded or calibrated with."""
        return self._recorder is not None or self.guide is not None

    def take(self, frames: list[Frame]) -> None:
        """Take frames in their order; the last one is shown, and all wait to be read."""
        known = [frame for frame in frames if frame.counts.shape == self._sensor.shape]
        if len(known) < len(frames) and self._refused_shape != frames[-1].counts.shape:
            self._refused_shape = frames[-1].counts.shape
            rows, columns = self._refused_shape
            self._note(
                f"frames of {rows} x {columns} readings are not shown: this bench is for "
                f"{self._sensor.name}; start it with their --sensor-type"
            )
        if not known:
            return
        received_ms = time.time() * 1e3
        recording, began_ns = self.replayed
        for came in known:
            self._record(came)
            frame = self.wiring.frame(came, self._sensor.full)
            if self.guide is not None:
                self.guide.guide.take([frame])
            for notice in self.state.take(frame):
                self._note(notice)
            at_s = 1e-9 * (frame.t_ns - began_ns) if recording else 0.0
            load = self.guide is not None
            self._recognition.offer(
                PendingFrame(frame, self.state.calibration, received_ms, load, recording, at_s)
            )
        values, newtons, notice = self.state.values(frame)
        if notice:
            self._note(notice)
        self._newest = frame
        bias = None if newtons else self.state.bias
        shown = FrameMessage(
            values, self._sensor, bias, newtons, frame.seq, frame.t_ns * 1e-9, received_ms
        )
        self._broker.publish("frame", shown.as_bytes)

    def newest(self) -> tuple[Frame, Array, str]:
        """Return the newest frame, its readings, and their unit; refused if none came yet."""
        if self._newest is None:
            raise BusyError("no frame came yet", fix="connect a probe first")
        values, newtons, _ = self.state.values(self._newest)
        return self._newest, values, "N" if newtons else "counts"

    def start_recording(self, folder: Path, sensor_name: str, url: str) -> None:
        """Record from now on, unless frames are recorded already."""
        if self._recorder is not None:
            return
        folder.mkdir(parents=True, exist_ok=True)
        known = self.state.calibration
        path = next_free(folder, "touch", ".h5")
        self._recorder = Recorder(
            path, sensor=sensor_name, sensor_type=self._sensor, attributes={"url": url},
            calibration=calibration_hash(known) if known else "",
        )  # fmt: skip
        self._note(f"recording {path.name}")

    def end_recording(self) -> None:
        """Complete the recording, if there is one."""
        if self._recorder is not None:
            recorder, self._recorder = self._recorder, None
            recorder.close()
            files = ", ".join(file.name for file in recorder.files)
            self._note(f"{files}: {recorder.frames:,} frames")

    def finish_calibration(self, guide: PageGuide, folder: Path) -> dict[str, Any]:
        """Fit the laws, write and use them; returns unsound tactels, scatter and loads."""
        found = guide.calibration()
        folder.mkdir(parents=True, exist_ok=True)
        path = next_free(folder, "calibration", ".json")
        write_calibration(found, path)
        self.guide = None
        self._note(self.state.use(found, path.name))
        return {
            "name": path.name,
            "bad": int(found.bad.sum()),
            "tactels": int(found.bad.size),
            "scatter": round(found.scatter, 2),
            "repeat": round(found.repeat, 4),
            "loads": list(found.loads),
            "condition": [
                "".join(Condition(int(v)).letter for v in row) for row in found.condition
            ],
        }

    def leave(self) -> None:
        """Forget the sensor; its recording is complete."""
        self.end_recording()
        self._newest = self.guide = None
        self.replayed = ("", 0)
        self.state = CalibrationState()

    def as_json(self) -> dict[str, Any]:
        """Return the state for the page."""
        recorder, guide = self._recorder, self.guide
        return {
            "recording": None if recorder is None
            else {"name": recorder.path.name, "frames": recorder.frames},
            "guide": None if guide is None else guide.as_json(),
            **self.state.as_json(),
        }  # fmt: skip

    def _record(self, frame: Frame) -> None:
        try:
            if self._recorder is not None:
                self._recorder.append(frame)
        except ProbeError as error:
            self._note(str(error))
            self._recorder = None


def _age(made: str) -> str:
    try:
        then = datetime.datetime.fromisoformat(made)
    except ValueError:
        return made or "not dated"
    days = (datetime.datetime.now(then.tzinfo) - then).total_seconds() / 86400
    if days >= 2:
        return f"{days:.0f} days"
    return f"{24 * days:.0f} h" if days >= 0.1 else "fresh"
