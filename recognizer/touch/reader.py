"""Counts of a sensor -> Recognition: one touch, or all touches of a recording."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from probe.frame import Frame
from probe.recording.read import Recording
from recognizer.errors import SensorStateError, TouchError
from recognizer.touch.prepare import PreparedLab
from recognizer.touch.recognise import recognise
from recognizer.touch.recognition import CHECKED, UNCHECKED, Recognition
from recognizer.touch.sensor_state import SensorState, invert_floating
from recognizer.touch.signal import Signal, signal_of
from recognizer.touch.source import source_of

if TYPE_CHECKING:
    from probe.calibration import Calibration

_LARGE = 1e100  #: no reading is as large, nor as small as 1 over it: squares stay in range


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Reader(PreparedLab):
    """Reads touches; prepared once for a lab and a sensor.

    Parameters
    ----------
    lab
        Of `open_lab`.
    sensor
        A type, its name or file; by default `fsr-16` with tabs.
    options
        How touches are read, and when an answer is given.
    state
        Of that very sensor, as `recognizer.sensor` learns it; None: nothing is known.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from encoded_objects import Reader, encode, open_lab, simulate
    >>> folder = tempfile.mkdtemp()
    >>> lab, cube = folder + "/lab.db", {"name": "Cube", "shape": {"cube": "40 mm"}}
    >>> _ = encode(cube, database=lab, folder=folder, formats=())
    >>> touch = simulate(lab + "#Cube/F1", x=20, y=19, theta=23, force=80)
    >>> reader = Reader(open_lab(lab))
    >>> answer = reader.read(next(touch.frames()).counts)
    >>> answer.object, answer.face, round(answer.x_mm), round(answer.y_mm)
    ('Cube', 'F1', 20, 19)
    >>> str(reader.read(np.zeros((16, 16)))).split("; ")[:2]
    ['not recognised: no contact', 'press the probe onto the object']
    """

    state: SensorState | None = None

    def __post_init__(self) -> None:
        PreparedLab.__post_init__(self)
        shape = (self.sensor.rows, self.sensor.columns)
        if not isinstance(self.state, SensorState | None):
            raise SensorStateError(
                f"{self.state!r} is no state of a sensor",
                fix="read its file first: recognizer.sensor.read_state(...)",
            )
        if self.state is not None and self.state.shape != shape:
            raise SensorStateError(
                f"what was learned of a sensor of {self.state.shape}, for one of {shape}",
                fix="give what was learned of this sensor, or leave it out",
                place=self.state.sensor,
            )

    def read(
        self,
        counts: ArrayLike | Frame,
        *,
        calibration: Calibration | None = None,
        trust: ArrayLike | None = None,
        seq: int = 0,
    ) -> Recognition:
        """Return the answer of one touch, which gets the number `seq`.

        Parameters
        ----------
        counts
            (rows, columns) readings that rise with force, as the sensor gives them, or a frame.
        calibration
            Of the sensor: turns counts into newtons.
        trust
            (rows, columns) 0 for bad tactels, 1 for good ones.

        Raises
        ------
        TouchError
            Of another shape than the sensor, or no numbers.
        """
        return self.answer(self.signal(counts, calibration=calibration, trust=trust), seq)

    @property
    def mounting(self) -> str:
        """Whether it is known how the sensor is mounted: `CHECKED` or `UNCHECKED`."""
        return UNCHECKED if self.state is None or self.state.mounting is None else CHECKED

    def answer(self, signal: Signal, seq: int = 0) -> Recognition:
        """Return the answer of a signal."""
        return replace(recognise(self, signal, seq), mounting=self.mounting)

    def signal(
        self,
        counts: ArrayLike | Frame,
        *,
        calibration: Calibration | None = None,
        trust: ArrayLike | None = None,
    ) -> Signal:
        """Return the signal of a touch: newtons where there is a calibration."""
        shape, sensor = (self.sensor.rows, self.sensor.columns), self.sensor
        try:
            image = counts.counts if isinstance(counts, Frame) else counts
            if np.iscomplexobj(image) or (trust is not None and np.iscomplexobj(trust)):
                raise TypeError("complex numbers")
            values = np.asarray(image, np.float64)
            known = None if trust is None else np.asarray(trust, np.float64)
        except (TypeError, ValueError) as error:
            raise TouchError(
                "an image that is no matrix of numbers",
                fix=f"give counts of {shape[0]} rows, {shape[1]} columns, or a Frame",
                place=sensor.name,
            ) from error
        if values.shape != shape or (known is not None and known.shape != shape):
            wrong = values.shape if known is None or values.shape != shape else known.shape
            raise TouchError(
                f"an image of shape {wrong}, of a sensor with {shape[0]} rows, {shape[1]} columns",
                fix="give its --sensor-type; in Python Reader(lab, sensor_type_named(...))",
                place=sensor.name,
            )
        if not (np.abs(values) < _LARGE).all():
            raise TouchError(
                f"readings that are NaN or of {_LARGE:.0e} and more",
                fix="set them to 0, and trust to 0 there",
                place=sensor.name,
            )
        values = np.where(np.abs(values) < 1 / _LARGE, 0.0, values)
        newtons = calibration is not None
        if calibration is not None:
            from probe.calibration.apply import calibrate_image

            found = calibrate_image(values, calibration)
            values = found.values
            known = np.where(found.bad, 0.0, 1.0) * (1.0 if known is None else known)
        state = self.state if self.state is not None and self.state.is_learned else None
        if sensor.wiring == "floating" and not newtons and not (state and state.floating):
            values = invert_floating(values)
        if state is not None:
            values = state.correct(values, newtons=newtons)
            known = np.where(state.masked, 0.0, 1.0) * (1.0 if known is None else known)
        signal = signal_of(
            values, trust=known, newtons=newtons, sensor=sensor, options=self.options
        )
        if state is None:
            return signal
        return replace(signal, forces=state.level(signal.forces, newtons=newtons), state=state)

    def read_all(
        self,
        recording: Recording | str | Path,
        *,
        every: bool = False,
        calibration: str | Path | None = None,
    ) -> Iterator[Recognition]:
        """Yield the answers of the touches of a recording or its file, as `recognize-object` does.

        A recording that names sensor type and overlay is read by those. With `every` each frame is
        a touch; otherwise force separates them. Without `calibration`, a file, the one that the
        recording names is looked for in its folder.

        Raises
        ------
        RecordingError, CalibrationError
            A file cannot be read.
        TouchError
            It is of another sensor.
        """
        opened = recording if isinstance(recording, Recording) else Recording(recording)
        given = None if calibration is None else Path(calibration)
        known = None if opened.origin.sensor_type else self.sensor
        source = source_of(opened, known, calibration=given, every=every)
        if source.notice:
            warnings.warn(source.notice, stacklevel=2)
        reader = self if source.sensor == self.sensor else replace(self, sensor=source.sensor)
        for touch in source.touches(opened.frames(), self.options):
            yield reader.read(touch.counts, calibration=source.calibration, seq=touch.seq)
