"""A recording -> touches, with the sensor that felt them and its calibration.

The sensor is what is asked for, else what the recording tells, else the usual one; so is the
overlay. A calibration that a recording names by its hash is looked for beside it; without one
counts are read as they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from probe.errors import CalibrationError, RecordingError
from probe.frame import Frame
from probe.recording.layout import RecordingOrigin
from probe.recording.read import Recording
from recognizer.touch.contacts import TouchImage, cut_touches, every_frame
from recognizer.touch.settings import DEFAULTS, ReaderSettings

if TYPE_CHECKING:
    from probe.calibration import Calibration

LARGEST = 4 << 20  #: bytes of a file that may be a calibration


@dataclass(frozen=True, slots=True, eq=False)
class TouchSource:
    """What is read."""

    place: str  #: file or URL
    sensor: SensorType
    calibration: Calibration | None = None
    together: int = 0  #: frames of every touch where their writer says so; 0: force tells
    frames: int | None = None  #: in all; None: nobody knows
    newest: bool = False  #: whether frames may be left out
    notice: str = ""  #: what a person should know
    name: str = ""  #: of the sensor; empty: nobody knows

    def touches(
        self, frames: Iterable[Frame], settings: ReaderSettings = DEFAULTS
    ) -> Iterator[TouchImage]:
        """Yield the touches among frames."""
        if self.together:
            return every_frame(frames, self.together)
        known = self.calibration
        trust = None if known is None else np.where(known.bad, 0.0, 1.0)
        return cut_touches(frames, settings, trust, self.sensor)


def source_of(
    recording: Recording,
    sensor: SensorType | str | None = None,
    *,
    overlay: str = "",
    calibration: Path | None = None,
    every: bool = False,
) -> TouchSource:
    """Return what a recording holds.

    Parameters
    ----------
    sensor
        Type, its name or file, that is taken to have felt it; None: the one that it tells. The
        overlay is the recording's where it tells another.
    overlay
        `tab` or `pad`, whatever the recording tells; empty: as it tells.
    calibration
        The sensor's; None: the one that the recording names, if it stands beside it.
    every
        Every frame is a touch.

    Raises
    ------
    RecordingError
        It says what makes no sense.
    SensorTypeError
        No such type, one of another shape, or nothing tells.
    CalibrationError
        The calibration is none, or another one than the recording names.
    """
    origin, path = recording.origin, Path(recording.path)
    known, notice = _calibration_for(origin, calibration, path.parent)
    told = str(origin.more.get("overlay", "")) or origin.sensor.rpartition("/")[2]
    return TouchSource(
        place=str(path),
        sensor=recording.sensor_type(sensor).with_overlay(overlay or told),
        calibration=known,
        together=1 if every else _frames_per_touch(origin, path),
        frames=len(recording),
        notice=notice,
        name=origin.sensor,
    )


def _frames_per_touch(origin: RecordingOrigin, path: Path) -> int:
    """Return how many frames follow each other at one place; 0 if the recording does not tell."""
    told: Any = origin.more.get("frames_per_touch", 0)
    if not isinstance(told, int) or told < 0:
        raise RecordingError(
            f"its attribute frames_per_touch is {told!r}",
            fix="write a whole number there, or delete it",
            place=str(path),
        )
    return told


def _calibration_for(
    origin: RecordingOrigin, given: Path | None, folder: Path
) -> tuple[Calibration | None, str]:
    """Return the calibration of a recording, the one given or the one it names, and a notice."""
    named = origin.calibration
    if given is None:
        return _calibration_in(folder, named) if named else (None, "")
    from probe.calibration import calibration_hash, read_calibration

    known = read_calibration(given, sensor=origin.sensor or None)
    if named and named != calibration_hash(known):
        raise CalibrationError(
            f"the recording was made with calibration {named[:12]}..., not with this one",
            fix="leave --calibration out: the right one is found beside the recording",
            place=str(given),
        )
    return known, ""


def _calibration_in(folder: Path, named: str) -> tuple[Calibration | None, str]:
    """Return the calibration of that hash in a folder; None, with a notice, if there is none."""
    from probe.calibration import calibration_hash, read_calibration

    for path in sorted(folder.glob("*.json")):
        try:
            small = path.stat().st_size <= LARGEST
            if small and named.encode() in path.read_bytes():
                known = read_calibration(path)
                if calibration_hash(known) == named:
                    return known, ""
        except (OSError, CalibrationError):  # not the one
            continue
    return None, (
        f"the recording names calibration {named[:12]}..., which is not beside it: read as counts;"
        " give it by --calibration"
    )
