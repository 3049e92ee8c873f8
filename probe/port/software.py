"""A probe in software: frames in, the bytes of a real one out, commands obeyed.

It stands behind `sim:` and `file:`, so that what reads them is what reads a real line. Frames
leave when their time has come, by the host's clock; a reader that is late makes the device
wait, as the real one waits for its line. Numbers or times that jump (a recording with lost
frames) are announced by a statistics packet, so that the client sees that no byte got lost.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from probe.frame import Frame
from probe.port.settings import PORT
from probe.protocol import (
    Command,
    FramePacket,
    IdentPacket,
    Packet,
    StatisticsPacket,
    encode,
)


class SoftwareProbe:
    """A `Port` to a probe that sends given frames.

    Parameters
    ----------
    url
        What opens it again.
    frames
        In order; their times say when they leave, their numbers are sent.
    ident
        What it says of itself. With `bits` 10, it obeys the commands for 8 and 10 bits.
    speed
        1: in real time; 0: as fast as it is read.
    """

    def __init__(
        self, url: str, frames: Iterator[Frame], ident: IdentPacket, *, speed: float = 1.0
    ) -> None:
        self._url = url
        self._frames = frames
        self._ident = ident
        self._adjustable = ident.bits <= 10
        self._speed = speed
        self._replies: list[bytes] = []
        self._streaming = False
        self._wanted = 0  # single frames that were asked for
        self._next: Frame | None = None
        self._last: Frame | None = None
        self._origin_s = 0.0  # host time at which the device's clock would show zero
        self._sent = self._waits = self._errors = 0

    @property
    def url(self) -> str:
        """The URL that opens this port again."""
        return self._url

    @property
    def streaming(self) -> bool:
        """Whether frames were asked for."""
        return self._streaming

    def write(self, data: bytes) -> None:
        """Obey the commands, one byte each."""
        for command in (data[i : i + 1] for i in range(len(data))):
            self._obey(command)

    def read(self, timeout_s: float) -> bytes:
        """Return the packets that are due, waiting at most `timeout_s` for the first.

        Raises
        ------
        EOFError
            After the last frame.
        """
        if self._replies:
            replies, self._replies = b"".join(self._replies), []
            return replies
        if not self._streaming and not self._wanted:
            time.sleep(timeout_s)
            return b""
        pause_s = self._due_s(self._peek()) - time.monotonic()
        if pause_s > 0:
            time.sleep(min(pause_s, timeout_s))
        return b"".join(self._ready(time.monotonic()))

    def close(self) -> None:
        """Stop sending."""
        self._streaming = False

    def _obey(self, command: bytes) -> None:
        if command == Command.START:
            if not self._streaming:
                self._origin_s = 0.0
            self._streaming = True
        elif command == Command.STOP:
            self._streaming = False
        elif command == Command.ONE:
            self._wanted += 1
        elif command == Command.IDENT:
            self._replies.append(encode(self._named()))
        elif command == Command.STATISTICS:
            self._replies.append(encode(self._statistics()))
        elif command in b"01234567":
            self._ident = replace(self._ident, sensor=int(command))
        elif command in b"ab":
            if self._adjustable:
                self._ident = replace(self._ident, bits=10 if command == b"a" else 8)
        else:
            self._errors += 1

    def _due_s(self, frame: Frame) -> float:
        """Return the host time at which a frame leaves."""
        if not self._speed or not self._streaming:
            return 0.0
        now_s, shown_s = time.monotonic(), frame.t_ns * 1e-9 / self._speed
        late_s = now_s - (self._origin_s + shown_s)
        if not self._origin_s:
            self._origin_s = now_s - shown_s
        elif late_s > PORT.late_s:
            self._origin_s += late_s
            self._waits += 1
        return self._origin_s + shown_s

    def _ready(self, now_s: float) -> Iterator[bytes]:
        for _ in range(PORT.batch):
            if not (self._streaming or self._wanted):
                return
            try:
                frame = self._peek()
            except EOFError:
                return  # the next read says so
            if self._due_s(frame) > now_s:
                return
            if self._jumps(frame):
                yield encode(self._statistics())
            yield encode(self._packed(frame))
            self._last, self._next = frame, None
            self._wanted = max(self._wanted - 1, 0)
            self._sent += 1

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
        return steps != 1 or not 0 <= step_ns <= PORT.step_ns

    def _now(self) -> tuple[int, int]:
        """Return number and time for a packet that is no frame."""
        if self._last is None:
            return 0, 0
        return (self._last.seq + 1) % 65536, self._last.t_ns // 1000 % 2**32

    def _named(self) -> Packet:
        seq, t_us = self._now()
        return replace(self._ident, seq=seq, t_us=t_us)

    def _statistics(self) -> Packet:
        seq, t_us = self._now()
        errors = min(self._errors, 65535)
        return StatisticsPacket(seq, t_us, self._sent, self._waits, errors, t_us // 1000)

    def _packed(self, frame: Frame) -> FramePacket:
        counts, byte_wide = frame.counts, self._ident.bits == 8
        if byte_wide:
            counts = np.right_shift(counts, 2)
        return FramePacket(
            frame.seq % 65536, frame.t_ns // 1000 % 2**32, counts, frame.wrist, byte_wide
        )
