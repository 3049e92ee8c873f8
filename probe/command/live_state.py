"""The state of the live view, which the keys change.

Frame after frame goes in; the newest is shown, less the bias and through the median if so
chosen, in newtons if there is a calibration. Images and recordings get the next free name.
"""

from __future__ import annotations

import datetime
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import MissingExtraError, require
from encoded_objects.base.files import staged_file
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.calibration import Calibration, calibrate_image, calibration_hash, drift_of
from probe.calibration.load import BIAS_FRAMES
from probe.frame import Frame, median_filter
from probe.recording.files import next_free
from probe.recording.record import Recorder

Image = NDArray[np.float64]

_HOLD = 0.98  #: share of the scale that is left after each frame shown
_LEAST = {"counts": 32.0, "N": 0.2}  # scale of a sensor at rest


@dataclass(slots=True)
class LiveState:
    """A mutable value: one view, one operator."""

    url: str
    folder: Path
    calibration: Calibration | None = None
    sensor: SensorType | None = None  #: None: as the first frame tells
    frame: Frame | None = None  #: newest
    paused: bool = False
    median: bool = False
    bias: Image | None = None  #: counts; None: not taken
    scale: float = 0.0  #: reading of the brightest colour
    notice: str = ""
    recorder: Recorder | None = None
    _resting: list[NDArray[np.uint16]] | None = field(default=None)

    @property
    def unit(self) -> str:
        """N with a calibration, else counts."""
        return "counts" if self.calibration is None else "N"

    @property
    def taking_bias(self) -> bool:
        """Whether frames are being gathered for the bias."""
        return self._resting is not None

    def take(self, frames: list[Frame]) -> None:
        """Take the next frames: record them, and show the last.

        Raises RecordingError: the disk is full, the recording is closed; SensorTypeError: the first
        frame is of another shape than the type.
        """
        if frames and self.frame is None:
            rows, columns = frames[0].counts.shape
            self.sensor = choose_sensor_type(self.sensor, "", (rows, columns), self.url)
        for frame in frames:
            if self.recorder is not None:
                self.recorder.append(frame)
            if self._resting is not None:
                self._resting.append(frame.counts)
                if len(self._resting) == BIAS_FRAMES:
                    self._settle_bias()
        if frames and not self.paused:
            self.frame = frames[-1]

    def image(self) -> Image | None:
        """Return the image that is shown, (rows, columns); None before the first frame."""
        if self.frame is None:
            return None
        if self.calibration is not None:
            image = calibrate_image(self.frame, self.calibration).values
        else:
            image = self.frame.counts.astype(np.float64)
            if self.bias is not None:
                image = np.maximum(image - self.bias, 0.0)
        if self.median:
            image = median_filter(image)
        if not self.paused:
            self.scale = max(float(image.max()), self.scale * _HOLD, _LEAST[self.unit])
        return image

    def toggle_bias(self) -> None:
        """Begin to take the bias, or do without it."""
        if self.bias is None and self._resting is None:
            self._resting = []
            self.notice = "taking the bias: keep the sensor unloaded"
        else:
            self.drop_bias()
            self.notice = "bias off"

    def drop_bias(self) -> None:
        """Do without a bias: it was another sensor's, or is not wanted."""
        self.bias = self._resting = None

    def toggle_recording(self, sensor: str) -> None:
        """Start a recording, or end it."""
        if self.recorder is not None:
            self.end_recording()
            return
        known = self.calibration
        path = next_free(self.folder, "live", ".h5")
        self.recorder = Recorder(
            path, sensor=sensor, sensor_type=self.sensor,
            calibration=calibration_hash(known) if known else "",
            attributes={"url": self.url}
        )  # fmt: skip
        self.notice = f"recording {path.name}"

    def end_recording(self) -> None:
        """End the recording if there is one; its file is complete."""
        if self.recorder is not None:
            recorder, self.recorder = self.recorder, None
            recorder.close()
            files = ", ".join(file.name for file in recorder.files)
            self.notice = f"{files}: {recorder.frames:,} frames"

    def save(self) -> None:
        """Save the image that is shown, and its counts as an array."""
        image = self.image()
        if image is None or self.frame is None:
            return
        try:
            require("matplotlib", extra="report", purpose="a picture")
        except MissingExtraError as error:
            self.notice = str(error)
            return
        from probe.plot.frame import frame_picture

        picture = next_free(self.folder, "image", ".png")
        title = f"frame {self.frame.seq}" + (", median of 3x3" if self.median else "")
        if self.bias is not None:
            title += ", less bias"
        array = picture.with_suffix(".npy")
        with staged_file(picture) as draft:
            frame_picture(image, draft, unit=self.unit, title=title, sensor=self.sensor)
        with staged_file(array) as draft:
            np.save(draft, self.frame.counts)
        self.notice = f"saved {picture.name} and .npy"

    def age(self) -> str:
        """Return how old the calibration is, in words."""
        if self.calibration is None:
            return "none"
        try:
            made = datetime.datetime.fromisoformat(self.calibration.made)
        except ValueError:
            return self.calibration.made or "not dated"
        now = datetime.datetime.now(made.tzinfo)
        days = (now - made).total_seconds() / 86400
        return f"{days:.0f} days old" if days >= 2 else f"{24 * days:.0f} h old"

    def _settle_bias(self) -> None:
        frames, self._resting = np.stack(self._resting or []), None
        self.bias = frames.mean(axis=0)
        self.notice = f"bias of {BIAS_FRAMES} frames is off the image"
        if self.calibration is not None:
            self.bias = None  # a calibration has its own
            drift = drift_of(self.calibration, frames)
            self.notice = drift.warning or "the bias is that of the calibration"
