"""What is done with each frame of a sensor: recorded, calibrated with, shown, read.

Frames -> recording, calibration, the topic `frame`, the thread that recognises. The session
holds its lock around every call.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.calibration import calibration_hash, write_calibration
from probe.errors import ProbeError
from probe.frame import Frame
from probe.recording.files import next_free
from probe.recording.record import Recorder
from recognizer.bench.broker import Broker
from recognizer.bench.calibration import (
    CalibrationState,
    PageGuide,
    condition_json,
    values_or_counts,
)
from recognizer.bench.errors import BusyError
from recognizer.bench.message import FrameMessage
from recognizer.bench.reading import PendingFrame, RecognitionThread
from recognizer.sensor.wiring import Wiring

Array = NDArray[np.float64]


class FrameHandler:
    """Recorder, calibration and guide of the sensor that is read.

    Parameters
    ----------
    sensor
        What the probe is.
    broker, recognition
        Who gets every newest frame.
    note
        Called with what the operator should know.
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
        self._refused_shape: tuple[int, int] | None = None  # of frames that are not shown
        self._recorder: Recorder | None = None

    @property
    def busy(self) -> bool:
        """Whether frames are recorded or calibrated with."""
        return self._recorder is not None or self.guide is not None

    def take(self, frames: list[Frame]) -> None:
        """Take frames in their order; the last one is shown and read."""
        known = [frame for frame in frames if frame.counts.shape == self._sensor.shape]
        if len(known) < len(frames):
            rows, columns = frames[-1].counts.shape
            if self._refused_shape != (rows, columns):
                self._refused_shape = rows, columns
                self._note(
                    f"frames of {rows} x {columns} readings are not shown: this bench is for "
                    f"{self._sensor.name}; start it with their --sensor-type"
                )
            frames = known
        for frame in frames:
            if self._recorder is not None:
                self._record(self._recorder, frame)
        frames = [self.wiring.frame(frame, self._sensor.full) for frame in frames]
        for frame in frames:
            if self.guide is not None:
                self.guide.guide.take([frame])
            for notice in self.state.take(frame):
                self._note(notice)
        if not frames:
            return
        frame, received_ms = frames[-1], time.time() * 1e3
        values, newtons, wrong = values_or_counts(self.state, frame)
        if wrong:
            self._note(wrong)
        self._newest = frame
        bias = None if newtons else self.state.bias
        shown = FrameMessage(
            values, self._sensor, bias, newtons, frame.seq, frame.t_ns * 1e-9, received_ms
        )
        self._broker.publish("frame", shown)
        load = self.guide is not None
        recording, began_ns = self.replayed
        at_s = 1e-9 * (frame.t_ns - began_ns) if recording else 0.0
        calibration = self.state.calibration
        self._recognition.offer(
            PendingFrame(frame, calibration, received_ms, load, recording, at_s)
        )

    def newest(self) -> tuple[Frame, Array, str]:
        """Return the newest frame, what is shown of it, and its unit.

        Raises
        ------
        BusyError
            When none came yet.
        """
        if self._newest is None:
            raise BusyError("no frame came yet", fix="connect a probe first")
        values, newtons, _ = values_or_counts(self.state, self._newest)
        return self._newest, values, "N" if newtons else "counts"

    def start_recording(self, folder: Path, sensor_name: str, url: str) -> None:
        """Record from now on, unless that is so already."""
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
        """Fit the laws, write and use them; returns what they say of the sensor."""
        found = guide.calibration()
        folder.mkdir(parents=True, exist_ok=True)
        path = next_free(folder, "calibration", ".json")
        write_calibration(found, path)
        self.guide = None
        self._note(self.state.use(found, path.name))
        return {"name": path.name, **condition_json(found)}

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

    def _record(self, recorder: Recorder, frame: Frame) -> None:
        try:
            recorder.append(frame)
        except ProbeError as error:
            self._note(str(error))
            self._recorder = None
