"""A probe in software: frames in, the bytes of a real one out, commands obeyed.

It stands behind `sim:` and `file:`, for one reader of all ports. Frames leave when their time has
come, by the host's clock; a reader that is late makes the device wait, as the real one waits for
its line. Numbers or times that jump (a recording with lost frames) are announced by a statistics
packet: no byte got lost. The wire does not carry the pose of a recording; its times are in whole
microseconds, from 0 to 71 minutes at its first frame.

`sim:` alone shows a pattern: two fingers, round and about three tactels wide, run on circles
against each other and press and release; a row stays at zero, to show at once turned or mirrored
images.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.frame import MOST_HZ, Frame
from probe.port.address import Address, Port, number, refuse_unknown
from probe.port.commanded import CommandedProbe
from probe.protocol import FramePacket, IdentPacket, encode

_MOST_SPEED = 1e6  #: times as fast; 0 is as fast as it is read
_BATCH = 64  #: packets of one read at most
_LATE_S = 0.5  #: a reader later than that makes the device wait
_PAUSE_NS = 10_000_000  #: between the end of a recording and its repetition
_STEP_NS = 500_000_000  #: longest time between frames that needs no announcement


def open_recording(address: Address) -> Port:
    """Open a recording for replay; PortError when an option is no number, RecordingError."""
    from probe.recording.read import Recording

    refuse_unknown(address, ("speed", "loop"))
    speed = number(address, "speed", 1.0, most=_MOST_SPEED)
    again = number(address, "loop", 0.0, most=1.0) > 0
    recording = Recording(address.target)
    frames = endless_frames(recording.frames) if again else recording.frames()
    rows, columns = recording.shape
    # Recordings of other sensors may hold readings of up to 16 bits.
    ident = IdentPacket(seq=0, t_us=0, bits=16, settling_us=0.0, baud=0, name="replay",
                        rows=rows, columns=columns)  # fmt: skip
    return SoftwareProbe(address.url, frames, ident, speed=speed)


def endless_frames(opened: Callable[[], Iterator[Frame]]) -> Iterator[Frame]:
    """Yield the frames of a recording again and again, numbers and times rising on.

    A recording without frames ends at once.
    """
    seq = t_ns = 0
    last: Frame | None = None
    while True:
        first: Frame | None = None
        for frame in opened():
            first = first or frame
            last = replace(
                frame, seq=seq + frame.seq - first.seq, t_ns=t_ns + frame.t_ns - first.t_ns
            )
            yield last
        if first is None or last is None:
            return
        seq, t_ns = last.seq + 1, last.t_ns + _PAUSE_NS


class SoftwareProbe(CommandedProbe):
    """A `Port` to a probe that sends given frames.

    Their times say when they leave, their numbers are sent; at `speed` 1 in real time, at 0 as fast
    as they are read. With `bits` 10 in its ident, it obeys the commands for 8 and 10 bits.
    """

    def __init__(
        self, url: str, frames: Iterator[Frame], ident: IdentPacket, *, speed: float = 1.0
    ) -> None:
        super().__init__(url, ident, adjustable=ident.bits <= 10)
        self._frames = frames
        self._speed = speed
        self._next: Frame | None = None
        self._last: Frame | None = None
        self._origin_s = 0.0  # host time at which the device's clock would show zero

    def read(self, timeout_s: float) -> bytes:
        """Return the packets that are due, waiting at most `timeout_s` for the first.

        Raises EOFError after the last frame.
        """
        if replies := self.take_replies():
            return replies
        if not self.streaming and not self.wanted:
            time.sleep(timeout_s)
            return b""
        pause_s = self._due_s(self._peek()) - time.monotonic()
        if pause_s > 0:
            time.sleep(min(pause_s, timeout_s))
        return b"".join(self._ready(time.monotonic()))

    def begin(self) -> None:
        """Let the device's clock begin at zero."""
        self._origin_s = 0.0

    def now(self) -> tuple[int, int]:
        """Return number and time for a packet that is no frame."""
        if self._last is None:
            return 0, 0
        return (self._last.seq + 1) % 65536, self._last.t_ns // 1000 % 2**32

    def _due_s(self, frame: Frame) -> float:
        """Return the host time at which a frame leaves."""
        if not self._speed or not self.streaming:
            return 0.0
        now_s, shown_s = time.monotonic(), frame.t_ns * 1e-9 / self._speed
        late_s = now_s - (self._origin_s + shown_s)
        if not self._origin_s:
            self._origin_s = now_s - shown_s
        elif late_s > _LATE_S:
            self._origin_s += late_s
            self.waits += 1
        return self._origin_s + shown_s

    def _ready(self, now_s: float) -> Iterator[bytes]:
        for _ in range(_BATCH):
            if not (self.streaming or self.wanted):
                return
            try:
                frame = self._peek()
            except EOFError:
                return  # the next read says so
            if self._due_s(frame) > now_s:
                return
            if self._jumps(frame):
                yield encode(self.statistics())
            yield encode(self._packed(frame))
            self._last, self._next = frame, None
            self.wanted = max(self.wanted - 1, 0)
            self.sent += 1

    def _peek(self) -> Frame:
        if self._next is None:
            self._next = next(self._frames, None)
            if self._next is None:
                raise EOFError
        return self._next

    def _jumps(self, frame: Frame) -> bool:
        if self._last is None:
            return False
        steps, step_ns = frame.seq - self._last.seq, frame.t_ns - self._last.t_ns
        return steps != 1 or not 0 <= step_ns <= _STEP_NS

    def _packed(self, frame: Frame) -> FramePacket:
        counts, byte_wide = frame.counts, self.ident.bits == 8
        if byte_wide:
            counts = np.right_shift(counts, 2)
        return FramePacket(
            frame.seq % 65536, frame.t_ns // 1000 % 2**32, counts, frame.wrist, byte_wide
        )


_RATE_HZ = 100.0  #: frames of a simulated probe
_ROUND_S = 4.0  #: one round of the test pattern
_STEPS = 400  #: images of one round
_FINGER = 1.6  #: radius of a finger, tactels
_WAY_X = 5 / 16  #: share of the columns that a finger goes to either side ...
_WAY_Y = 4 / 16  #: ... and of the rows


def open_simulation(address: Address) -> Port:
    """Open a simulated probe; PortError when an option is unknown."""
    rate = number(address, "rate", _RATE_HZ, least=0.1, most=MOST_HZ)
    sensor = choose_sensor_type(address.options.get("sensor_type"), "", None, address.url)
    if address.target:
        from probe.simulate.source import frames_of

        frames = frames_of(address.target, address.options)
    else:
        refuse_unknown(address, ("rate", "sensor_type"))
        frames = moving_pattern(rate, sensor)
    ident = IdentPacket(seq=0, t_us=0, bits=max(sensor.bits, 10), settling_us=0.0, baud=0,
                        name="sim", rows=sensor.rows, columns=sensor.columns)  # fmt: skip
    return SoftwareProbe(address.url, frames, ident)


def moving_pattern(rate: float, sensor: SensorType) -> Iterator[Frame]:
    """Yield the frames of the pattern without end, numbered from 0, `rate` a second."""
    images = [_image(2 * math.pi * step / _STEPS, sensor) for step in range(_STEPS)]
    for seq in count():
        image = images[int(seq / rate / _ROUND_S * _STEPS) % _STEPS]
        yield Frame(image, round(seq * 1e9 / rate), seq, _wrist(image))


def _image(phase: float, sensor: SensorType) -> NDArray[np.uint16]:
    y, x = np.mgrid[: sensor.rows, : sensor.columns]
    force = np.zeros(sensor.shape)
    middle_y, middle_x = (sensor.rows - 3) / 2, (sensor.columns - 1) / 2
    way_y, way_x = _WAY_Y * sensor.rows, _WAY_X * sensor.columns
    for turn, press in ((phase, 0.9), (-phase + math.pi / 3, 0.5)):
        centre = middle_y + way_y * math.sin(turn), middle_x + way_x * math.cos(turn)
        away = (y - centre[0]) ** 2 + (x - centre[1]) ** 2
        force += press * (0.6 + 0.4 * math.sin(2 * turn)) * np.exp(-away / (2 * _FINGER**2))
    force[-1] = 0
    force[~sensor.present()] = 0
    image = np.round(sensor.full * np.minimum(force, 1)).astype(np.uint16)
    image.setflags(write=False)
    return image


def _wrist(image: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return the readings (4,) of the transducers: the mean of each quarter."""
    rows, columns = image.shape[0] // 2, image.shape[1] // 2
    quarters = [image[y, x].mean() for y in (slice(rows), slice(rows, None))
                for x in (slice(columns), slice(columns, None))]  # fmt: skip
    wrist = np.array(quarters).astype(np.uint16)
    wrist.setflags(write=False)
    return wrist
