"""A recording or a port -> touches, each one image, with sensor and calibration. Thesis 4.2, 6.1.

The sensor is the one asked for, else that of the recording, else the usual one; the overlay too. A
calibration that a recording names by its hash is looked for in its folder; without one, counts are
read as they are.

A contact lasts from the frame in which readings rise over the background to the one in which they
are down again. Images that are alike are one touch; it is read once its force is steady, as the
mean over the steady frames, not on the way down or up. Where nothing in a contact is steady (a tap,
or a file of unrelated images) every image that is unlike the one before is a touch of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.foreign import foreign_bytes
from encoded_objects.base.sensor_type import SensorType
from probe.errors import CalibrationError, RecordingError
from probe.frame import Frame
from probe.recording.layout import RecordingOrigin
from probe.recording.read import Recording
from recognizer.touch.options import DEFAULTS, ReaderOptions
from recognizer.touch.signal import signal_of

if TYPE_CHECKING:
    from probe.calibration import Calibration

Array = NDArray[np.float64]

ALIKE = 0.6  #: correlation of images of one touch; of two places it is below 0.3
STEADY = 0.05  #: share by which sums may be off that of the first frame averaged
STILL = 0.9  #: correlation with it
FEW = 5  #: frames that make a touch steady
ENOUGH = 22  #: frames that are averaged, 0.1 s at 220 frames a second
FRAGMENTS = 64  #: unlike images without a steady one from which each is a touch
LARGEST = 4 << 20  #: bytes of a file that may be a calibration


@dataclass(frozen=True, slots=True, eq=False)
class TouchImage:
    """One image to be read, and its origin."""

    seq: int  #: number of the touch's first frame
    t_ns: int  #: time of the first frame that was averaged
    frames: int  #: that were averaged
    counts: Array  #: (rows, columns) mean reading, ADC counts
    wrist: Array  #: (4,) mean reading of the wrist's transducers, ADC counts
    pose: Array | None  #: (4, 4) T_base_sensor of the frame in the middle, mm; None if not known


@dataclass(frozen=True, slots=True, eq=False)
class TouchSource:
    """Where touches come from, and how they are read."""

    place: str  #: file or URL
    sensor: SensorType
    calibration: Calibration | None = None
    together: int = 0  #: frames of every touch where their writer says so; 0: force tells
    frames: int | None = None  #: in all; None: nobody knows
    newest: bool = False  #: whether frames may be left out
    notice: str = ""  #: what a person should know
    name: str = ""  #: of the sensor; empty: nobody knows

    def touches(
        self, frames: Iterable[Frame], options: ReaderOptions = DEFAULTS
    ) -> Iterator[TouchImage]:
        """Yield the touches among frames."""
        if self.together:
            return every_frame(frames, self.together)
        known = self.calibration
        trust = None if known is None else np.where(known.bad, 0.0, 1.0)
        return cut_touches(frames, options, trust, self.sensor)


def source_of(
    recording: Recording,
    sensor: SensorType | str | None = None,
    *,
    overlay: str = "",
    calibration: Path | None = None,
    every: bool = False,
) -> TouchSource:
    """Return the touches, sensor and calibration of a recording.

    Parameters
    ----------
    sensor
        Type, its name or file; None: the recording's. The overlay is the recording's where it names
        another.
    overlay
        `tab` or `pad`, whatever the recording names; empty: the recording's.
    calibration
        Of the sensor; None: the one that the recording names, if it lies in its folder.
    every
        Every frame is a touch.

    Raises
    ------
    RecordingError
        Its attributes make no sense.
    SensorTypeError
        No such type, one of another shape, or none is named.
    CalibrationError
        The calibration is none, or another one than the recording names.
    """
    origin, path = recording.origin, Path(recording.path)
    known, notice = _calibration_for(origin, calibration, path.parent)
    recorded = str(origin.more.get("overlay", "")) or origin.sensor.rpartition("/")[2]
    return TouchSource(
        place=str(path),
        sensor=recording.sensor_type(sensor).with_overlay(overlay or recorded),
        calibration=known,
        together=1 if every else _frames_per_touch(origin, path),
        frames=len(recording),
        notice=notice,
        name=origin.sensor,
    )


def _frames_per_touch(origin: RecordingOrigin, path: Path) -> int:
    """Return how many frames follow each other at one place; 0 if the recording does not say."""
    frames: Any = origin.more.get("frames_per_touch", 0)
    if not isinstance(frames, int) or frames < 0:
        raise RecordingError(
            f"its attribute frames_per_touch is {frames!r}",
            fix="write a whole number there, or delete it",
            place=str(path),
        )
    return frames


def _calibration_for(
    origin: RecordingOrigin, given: Path | None, folder: Path
) -> tuple[Calibration | None, str]:
    """Return the calibration given, or the one that a recording names, and a notice."""
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
            content = foreign_bytes(path, CalibrationError, most=LARGEST, fix="")
            if named.encode() in content:
                known = read_calibration(path)
                if calibration_hash(known) == named:
                    return known, ""
        except CalibrationError:  # not the one
            continue
    return None, (
        f"the recording names calibration {named[:12]}..., which is not beside it: read as counts;"
        " give it by --calibration"
    )


def every_frame(frames: Iterable[Frame], together: int = 1) -> Iterator[TouchImage]:
    """Yield a touch for every `together` frames, whether anything is touched or not."""
    held: list[Frame] = []
    for frame in frames:
        held.append(frame)
        if len(held) == together:
            yield _average(held, held[0].seq)
            held = []
    if held:
        yield _average(held, held[0].seq)


def cut_touches(
    frames: Iterable[Frame],
    options: ReaderOptions = DEFAULTS,
    trust: Array | None = None,
    sensor: SensorType | None = None,
) -> Iterator[TouchImage]:
    """Yield the touches of a film, each as soon as it is complete.

    `trust` (rows, columns) is 0 for bad tactels of a calibration; `sensor` is `fsr-16` if not
    given.
    """
    contact = _Contact()
    for frame in frames:
        counts = frame.counts.astype(np.float64)
        signal = signal_of(counts, trust=trust, sensor=sensor, options=options)
        if signal.contact:
            image = signal.forces * signal.trust
            yield from contact.take(_ContactFrame(frame, image, float(image.sum())))
        else:
            yield from contact.end()
            contact = _Contact()
    yield from contact.end()


@dataclass(frozen=True, slots=True, eq=False)
class _ContactFrame:
    """A frame in contact."""

    frame: Frame
    image: Array  # forces or counts over the background
    total: float  # of the image


@dataclass(slots=True)
class _Contact:
    """The contact that lasts."""

    steady: bool = False  # whether a steady touch was found in it
    fragments: list[TouchImage] = field(default_factory=list)
    first: int = 0  # number of the first frame of what is alike
    last: Array | None = None  # image before
    read: Array | None = None  # image that was read last of what is alike
    group: list[_ContactFrame] = field(default_factory=list)  # frames that rest at one force
    best: list[_ContactFrame] = field(default_factory=list)  # longest group of what is alike

    def take(self, now: _ContactFrame) -> Iterator[TouchImage]:
        """Add a frame; yield the touches that it completes."""
        if self.last is None or _correlation(self.last, now.image) < ALIKE:
            yield from self._closed()
            self.first = now.frame.seq
        self.last = now.image
        if not self._rests(now):
            self.best = max(self.best, self.group, key=_rank)
            self.group = []
        self.group.append(now)
        if len(self.group) == ENOUGH:
            yield from self._steady(self.group)
            self.group = []

    def end(self) -> Iterator[TouchImage]:
        """Yield the rest when the contact ends."""
        yield from self._closed()
        if not self.steady:
            yield from self.fragments
        self.fragments = []

    def _closed(self) -> Iterator[TouchImage]:
        """End a run of alike images; where it was not read, read the longest rest in it."""
        self.best = max(self.best, self.group, key=_rank)
        if self.read is None and len(self.best) >= FEW:
            yield from self._steady(self.best)
        elif self.read is None and self.best and not self.steady:
            self.fragments.append(_average([one.frame for one in self.best], self.first))
            if len(self.fragments) >= FRAGMENTS:
                yield from self.fragments
                self.fragments = []
        self.read, self.group, self.best = None, [], []

    def _steady(self, group: list[_ContactFrame]) -> Iterator[TouchImage]:
        """Read frames that rest, unless they show what was read before."""
        image = np.mean([now.image for now in group], axis=0)
        if self.read is None or _correlation(self.read, image) < ALIKE:
            seq = self.first if self.read is None else group[0].frame.seq
            yield _average([one.frame for one in group], seq)
            self.read, self.steady, self.fragments = image, True, []

    def _rests(self, now: _ContactFrame) -> bool:
        """Return whether a frame has force and image of the group."""
        if not self.group:
            return True
        first = self.group[0]
        return (
            abs(now.total - first.total) <= STEADY * first.total
            and _correlation(first.image, now.image) >= STILL
        )


def _rank(group: list[_ContactFrame]) -> tuple[int, float]:
    return len(group), sum(now.total for now in group)


def _average(frames: list[Frame], seq: int) -> TouchImage:
    middle = frames[len(frames) // 2]
    return TouchImage(
        seq=seq,
        t_ns=frames[0].t_ns,
        frames=len(frames),
        counts=np.mean([frame.counts for frame in frames], axis=0),
        wrist=np.mean([frame.wrist for frame in frames], axis=0),
        pose=middle.pose,
    )


def _correlation(a: Array, b: Array) -> float:
    """Return the correlation coefficient of two images; 1 if either is even."""
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a * a).sum() * (b * b).sum()))
    return float((a * b).sum()) / size if size > 0 else 1.0
