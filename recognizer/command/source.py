"""A recording or a port -> touches, with the sensor that felt them and its calibration.

The overlay is what the option says, else what the recording or the URL of a simulated port
tells, else tabs. A calibration that a recording names by its hash is looked for beside it; without
one counts are read as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from encoded_objects.console.output import message, warning
from probe.calibration import Calibration, calibrated, calibration_hash, read_calibration
from probe.client.stream import Stream, name_of
from probe.errors import CalibrationError, RecordingError
from probe.frame import Frame
from probe.port.url import address_of
from probe.recording.layout import Origin
from probe.recording.read import Recording
from probe.sensor import Overlay, SensorType
from recognizer.touch.contacts import TouchImage, cut_touches, every_frame
from recognizer.touch.signal import Signal, signal_of

LEAST_N = 0.05  #: N over the lowest reading by which the strongest tactels must rise
_SLICE_S = 0.1
_LARGEST = 4 << 20  # bytes of a file that may be a calibration


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """What is read."""

    place: str  #: file or URL
    sensor: SensorType
    calibration: Calibration | None
    frames: int | None  #: in all; None: nobody knows
    together: int  #: frames of every touch where their writer says so; 0: force tells
    newest: bool  #: whether frames may be left out

    def touches(self, frames: Iterator[Frame]) -> Iterator[TouchImage]:
        """Yield the touches among frames."""
        if self.together:
            return every_frame(frames, self.together)
        return cut_touches(frames, trust=self._trust())

    def signal(self, touch: TouchImage) -> Signal:
        """Return what of a touch is worth fitting: newtons where there is a calibration."""
        if self.calibration is None:
            return signal_of(touch.counts)
        read = calibrated(touch.counts, self.calibration)
        trust = np.where(read.bad, 0.0, 1.0)
        return signal_of(read.values, trust=trust, least=LEAST_N, newtons=True)

    def _trust(self) -> NDArray[np.float64] | None:
        return None if self.calibration is None else np.where(self.calibration.bad, 0.0, 1.0)


def recorded(
    path: Path, *, overlay: str, calibration: Path | None, every: bool, live: bool
) -> tuple[Source, Callable[[Event], Iterator[Frame]]]:
    """Return a recording, and how its frames are read until an event ends it.

    Raises
    ------
    RecordingError
        It is none.
    CalibrationError
        The calibration is none, or another one than the recording names.
    """
    recording = Recording(path, live=live)
    origin = recording.origin
    together = 1 if every else _together(origin, path)
    source = Source(
        place=str(path),
        sensor=_sensor(overlay, _overlay_of(origin)),
        calibration=_calibration_for(origin, calibration, path.parent),
        frames=len(recording),
        together=together,
        newest=False,
    )

    def frames(interrupted: Event) -> Iterator[Frame]:
        for frame in recording.frames():
            if interrupted.is_set():
                return
            yield frame

    return source, frames


def at_port(url: str, *, overlay: str, calibration: Path | None, every: bool) -> Source:
    """Return what a port will give.

    Raises
    ------
    PortError
        The URL is none.
    RecordingError
        It is that of a recording that cannot be read.
    CalibrationError
        The calibration is none.
    """
    address = address_of(url)
    told, together = address.options.get("overlay", ""), 0
    known = None if calibration is None else read_calibration(calibration)
    if address.scheme == "file":
        path = Path(address.target)
        origin = Recording(path).origin
        told, together = _overlay_of(origin), _together(origin, path)
        known = _calibration_for(origin, calibration, path.parent)
    return Source(
        place=url,
        sensor=_sensor(overlay, told),
        calibration=known,
        frames=None,
        together=1 if every else together,
        newest=every and address.scheme != "file",
    )


@contextmanager
def listened(
    source: Source, interrupted: Event, number: int | None, calibration: Path | None
) -> Iterator[Iterator[Frame]]:
    """Yield the frames of a port until it ends or an event does; lets go of it afterwards.

    Raises
    ------
    PortError
        The probe is not there, or went away for good.
    CalibrationError
        The calibration is another sensor's.
    """
    with Stream(source.place, sensor=number) as stream:
        if calibration is not None:
            read_calibration(calibration, sensor=name_of(stream.ident(), source.place) or None)

        def frames() -> Iterator[Frame]:
            while not (stream.ended or interrupted.is_set()):
                waiting = stream.take(_SLICE_S)
                for notice in stream.client.notices():
                    message(notice)
                yield from waiting[-1:] if source.newest else waiting

        yield frames()


def _overlay_of(origin: Origin) -> str:
    """Return tab or pad where a recording tells; empty otherwise."""
    told = str(origin.more.get("overlay", "")) or origin.sensor.rpartition("/")[2]
    return told if told in ("tab", "pad") else ""


def _sensor(asked: str, told: str) -> SensorType:
    kind = cast(Literal["tab", "pad"], asked or told or "tab")
    return SensorType(overlay=Overlay(kind=kind))


def _together(origin: Origin, path: Path) -> int:
    """Return how many frames follow each other at one place; 0 if the recording does not tell."""
    told: Any = origin.more.get("frames_per_touch", 0)
    if not isinstance(told, int) or told < 0:
        raise RecordingError(
            f"its attribute frames_per_touch is {told!r}",
            fix="write a whole number there, or delete it",
            place=str(path),
        )
    return told


def _calibration_for(origin: Origin, given: Path | None, folder: Path) -> Calibration | None:
    """Return the calibration of a recording: the one given, or the one it names."""
    named = origin.calibration
    if given is None:
        return _found(named, folder) if named else None
    known = read_calibration(given, sensor=origin.sensor or None)
    if named and named != calibration_hash(known):
        raise CalibrationError(
            f"the recording was made with calibration {named[:12]}..., not with this one",
            fix="leave --calibration out: the right one is found beside the recording",
            place=str(given),
        )
    return known


def _found(named: str, folder: Path) -> Calibration | None:
    """Return the calibration of that hash in a folder; None, with a warning, if there is none."""
    for path in sorted(folder.glob("*.json")):
        try:
            small = path.stat().st_size <= _LARGEST
            if small and named.encode() in path.read_bytes():
                known = read_calibration(path)
                if calibration_hash(known) == named:
                    return known
        except (OSError, CalibrationError):  # not the one
            continue
    warning(
        f"the recording names calibration {named[:12]}..., which is not beside it: read as counts;"
        " give it by --calibration"
    )
    return None
