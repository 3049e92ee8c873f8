"""Frames of a recording or of a port -> touches, each as one image. Thesis 4.2, 6.1.

A contact lasts from the frame in which readings rise over the background to the one in which
they are down again. What happens in it is told apart by the images: while they are alike it
is one touch, which is read once its force is steady, as the mean over the steady frames. The
way down to a steady touch and the way up again are therefore not read. Where nothing in a
contact is steady (a tap, or a file of images that do not follow each other in time) every
image that is unlike the one before is a touch of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.frame import Frame
from recognizer.touch.settings import DEFAULTS, ContactSettings, ReaderSettings
from recognizer.touch.signal import signal_of

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class TouchImage:
    """One image to be read, and where it is from."""

    seq: int  #: number of the touch's first frame
    t_ns: int  #: time of the first frame that was averaged
    frames: int  #: that were averaged
    counts: Array  #: (rows, columns) mean reading, ADC counts
    wrist: Array  #: (4,) mean reading of the wrist's transducers, ADC counts
    pose: Array | None  #: (4, 4) T_base_sensor of the frame in the middle, mm; None if not known


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
    settings: ReaderSettings = DEFAULTS,
    trust: Array | None = None,
    sensor: SensorType | None = None,
) -> Iterator[TouchImage]:
    """Yield the touches of a film, each as soon as it is told.

    Parameters
    ----------
    frames
        One after another as the sensor gave them.
    settings
        When something is touched, and when frames are one touch.
    trust
        (rows, columns) 0 for bad tactels of a calibration.
    sensor
        Type of the sensor; as `fsr-16` if not given.
    """
    contact = _Contact(settings.contacts)
    for frame in frames:
        counts = frame.counts.astype(np.float64)
        signal = signal_of(counts, trust=trust, sensor=sensor, settings=settings.signal)
        if signal.contact:
            image = signal.forces * signal.trust
            yield from contact.take(_ContactFrame(frame, image, float(image.sum())))
        else:
            yield from contact.end()
            contact = _Contact(settings.contacts)
    yield from contact.end()


@dataclass(frozen=True, slots=True, eq=False)
class _ContactFrame:
    """A frame in contact."""

    frame: Frame
    image: Array  # forces or counts over the background
    total: float  # of the image


@dataclass(slots=True)
class _Contact:
    """What is known of the contact that lasts."""

    settings: ContactSettings
    steady: bool = False  # whether a steady touch was found in it
    fragments: list[TouchImage] = field(default_factory=list)
    first: int = 0  # number of the first frame of what is alike
    last: Array | None = None  # image before
    read: Array | None = None  # image that was read last of what is alike
    group: list[_ContactFrame] = field(default_factory=list)  # frames that rest at one force
    best: list[_ContactFrame] = field(default_factory=list)  # longest group of what is alike

    def take(self, felt: _ContactFrame) -> Iterator[TouchImage]:
        """Add a frame; yield what is told by it."""
        if self.last is None or _correlation(self.last, felt.image) < self.settings.alike:
            yield from self._closed()
            self.first = felt.frame.seq
        self.last = felt.image
        if not self._rests(felt):
            self._keep_best()
            self.group = []
        self.group.append(felt)
        if len(self.group) == self.settings.enough:
            yield from self._steady(self.group)
            self.group = []

    def end(self) -> Iterator[TouchImage]:
        """Yield what is left when the contact ends."""
        yield from self._closed()
        if not self.steady:
            yield from self.fragments
        self.fragments = []

    def _closed(self) -> Iterator[TouchImage]:
        """End what is alike; where it was not read, read the longest rest in it."""
        self._keep_best()
        if self.read is None and len(self.best) >= self.settings.few:
            yield from self._steady(self.best)
        elif self.read is None and self.best and not self.steady:
            self.fragments.append(_average(_frames(self.best), self.first))
            if len(self.fragments) >= self.settings.fragments:
                yield from self.fragments
                self.fragments = []
        self.read, self.group, self.best = None, [], []

    def _steady(self, group: list[_ContactFrame]) -> Iterator[TouchImage]:
        """Read frames that rest, unless they show what was read before."""
        image = np.mean([felt.image for felt in group], axis=0)
        if self.read is None or _correlation(self.read, image) < self.settings.alike:
            seq = self.first if self.read is None else group[0].frame.seq
            yield _average(_frames(group), seq)
            self.read, self.steady, self.fragments = image, True, []

    def _rests(self, felt: _ContactFrame) -> bool:
        """Tell whether a frame has force and image of the group."""
        if not self.group:
            return True
        first = self.group[0]
        return (
            abs(felt.total - first.total) <= self.settings.steady * first.total
            and _correlation(first.image, felt.image) >= self.settings.still
        )

    def _keep_best(self) -> None:
        if _rank(self.group) > _rank(self.best):
            self.best = self.group


def _rank(group: list[_ContactFrame]) -> tuple[int, float]:
    return len(group), sum(felt.total for felt in group)


def _frames(group: list[_ContactFrame]) -> list[Frame]:
    return [felt.frame for felt in group]


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
