"""Bytes in pieces of any size -> trusted frames, without a port and without a clock.

Packets -> trusted frames. A check sum of 16 bits passes one in 65,536 of the larger
corruptions, so a frame is held back until what follows agrees with it:

- the next packet continues its number, or what failed in between accounts for the numbers
  that are missing, by its blocks or by its bytes (a lost delimiter joins two packets);
- the next packet's time is later, by at most `_LONGEST_STEP_US` a frame;
- the next image has the same shape.

Bytes that get lost between the head of one frame and the tail of another leave a gap that
nothing accounts for; a damaged number or time disagrees with the next. After `probe.client` heard
nothing for a while, `settle` hands on what is held. A line without damage loses nothing by
this, a damaged one only frames next to bytes that vanished without a trace.

What is left: a corruption inside one packet that spares its number and time passes the check
sum once in 65,536, and must then leave the six upper bits of every 10-bit reading zero. Of
three million corrupted packets none was handed on.
Readings of 8 bits have no bits to spare: there it is a few of a million.

Number (u16) and time (u32, us) are unwrapped to whole numbers without end. When the device
restarts, its number restarts too, and the time goes on rising by the host's clock.
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass

from probe.frame import Frame
from probe.protocol import (
    Damage,
    FramePacket,
    IdentPacket,
    Packet,
    Splitter,
    StatisticsPacket,
    decode,
    frame_bytes,
)

_NUMBERS, _TIMES = 1 << 16, 1 << 32
_LONGEST_STEP_US = 1_000_000  #: longest time from frame to frame that is confirmed at once
_SLACK = 64  #: frames by which number and time may disagree


@dataclass(frozen=True, slots=True)
class ClientStatistics:
    """A snapshot; every count is since the client was opened."""

    frames: int = 0  #: handed on, or dropped as overrun
    rate: float = 0.0  #: frames a second, over the last 64 by the device's clock
    lost: int = 0  #: numbers that never came as a trusted frame
    failed: int = 0  #: blocks that are no packet: check sum, length, type, version, value
    doubtful: int = 0  #: frames whose check sum is right, but not their neighbour; not handed on
    reboots: int = 0  #: times the device restarted
    reopenings: int = 0  #: times the port went away and came back
    overruns: int = 0  #: trusted frames that the consumer was too slow to take


class FrameOrder:
    """State between packets. Call `take` for every packet, `fail` for every failed block."""

    def __init__(self) -> None:
        self.lost = 0
        self.doubtful = 0
        self.reboots = 0
        self.boot: int | None = None  #: the device's boot counter, once an ident came
        self._held: FramePacket | None = None
        self._failed = self._failed_bytes = 0  # blocks since the held frame, and their bytes
        self._last: FramePacket | None = None  # handed on
        self._seq = 0  # unwrapped, of the last
        self._t_us = 0
        self._heard_ns = 0  # host time of the last
        self._step_us = 0.0  # from frame to frame
        self._rebooted = False

    def fail(self, length: int) -> None:
        """Note a block of so many bytes that was no packet."""
        self._failed += 1
        self._failed_bytes += length

    def take(self, packet: Packet, now_ns: int) -> Frame | None:
        """Take the next packet, checked by itself; return the frame that it confirms, if it does.

        `now_ns` is the host's monotonic clock; only the pause at a reboot is measured by it.
        """
        held, failed = self._taken()
        self._held = packet if isinstance(packet, FramePacket) else None
        reboot = isinstance(packet, IdentPacket) and self._reboot(packet)
        if held is None:
            frame = None
        elif reboot or _agree(held, packet, failed):
            frame = self._trusted(held, now_ns)
        else:
            self.doubtful += 1
            frame = None
        if reboot:
            self._rebooted = self._last is not None
        return frame

    def settle(self, now_ns: int) -> Frame | None:
        """Return the held frame although nothing follows."""
        held, _ = self._taken()
        return None if held is None else self._trusted(held, now_ns)

    def _taken(self) -> tuple[FramePacket | None, int]:
        """Let go of the held frame; return it, and how many packets failed after it."""
        held, failed = self._held, self._failed
        if held is not None:
            rows, columns = held.counts.shape
            size = frame_bytes((rows, columns), byte_wide=held.byte_wide)
            failed = max(failed, round(self._failed_bytes / size))
        self._held, self._failed, self._failed_bytes = None, 0, 0
        return held, failed

    def _reboot(self, ident: IdentPacket) -> bool:
        restarted = self.boot is not None and ident.boot != self.boot
        self.boot = ident.boot
        self.reboots += restarted
        return restarted

    def _trusted(self, packet: FramePacket, now_ns: int) -> Frame:
        step_us = 0
        if self._last is None:
            self._seq, self._t_us = packet.seq, packet.t_us
        else:
            steps, step_us = _advance(self._last, packet, self._step_us)
            if self._rebooted or steps == 0:
                self.reboots += not self._rebooted
                self._seq = packet.seq
                if self._rebooted or step_us == 0:
                    step_us = max((now_ns - self._heard_ns) // 1000, 1)
            else:
                self._seq += steps
                self.lost += steps - 1
                self._step_us = step_us / steps
            self._t_us += step_us
        self._rebooted = False
        self._last, self._heard_ns = packet, now_ns
        return Frame(packet.counts, self._t_us * 1000, self._seq, packet.wrist)


def _agree(held: FramePacket, packet: Packet, failed: int) -> bool:
    steps = (packet.seq - held.seq) % _NUMBERS
    later_us = (packet.t_us - held.t_us) % _TIMES
    if isinstance(packet, FramePacket) and packet.counts.shape != held.counts.shape:
        return False
    return 1 <= steps <= 1 + failed and later_us <= steps * _LONGEST_STEP_US


def _advance(last: FramePacket, packet: FramePacket, step_us: float) -> tuple[int, int]:
    """Return how many frames and us `packet` comes after `last`.

    0 frames: the device's number went back; 0 us: its clock did. A pause longer than 65,536
    frames shows in the clock alone.
    """
    later_us = (packet.t_us - last.t_us) % _TIMES
    if later_us >= _TIMES // 2:
        return 0, 0
    steps = (packet.seq - last.seq) % _NUMBERS
    expected = later_us / step_us if step_us else 0.0
    if expected > _NUMBERS / 2:
        steps += _NUMBERS * max(round((expected - steps) / _NUMBERS), 0)
    return (steps if steps <= 2 * expected + _SLACK else 0), later_us


class Receiver:
    """The state of one conversation: splitter, order, and the descriptions of the device."""

    def __init__(self) -> None:
        self.ident: IdentPacket | None = None
        self.device: StatisticsPacket | None = None
        self.damages: dict[Damage, int] = dict.fromkeys(Damage, 0)
        self.packets = 0
        self.bytes = 0
        self.torn = False  #: whether the last block was no packet
        self.frames = 0
        self._order = FrameOrder()
        self._times_ns: deque[int] = deque(maxlen=64)
        self.reopened()

    def reopened(self) -> None:
        """Begin a new stream: its first block may be the tail of a packet."""
        self._splitter = Splitter()
        self._first = True

    def feed(self, data: bytes, now_ns: int) -> list[Frame]:
        """Return the frames that `data` completes and confirms."""
        frames = []
        self.bytes += len(data)
        for block in self._splitter.feed(data):
            packet = decode(block, self.ident.bits if self.ident else 10)
            first, self._first = self._first, False
            self.torn = isinstance(packet, Damage)
            if isinstance(packet, Damage):
                if not first:
                    self.damages[packet] += 1
                    self._order.fail(len(block))
                continue
            self.packets += 1
            if isinstance(packet, IdentPacket):
                self.ident = packet
            elif isinstance(packet, StatisticsPacket):
                self.device = packet
            frame = self._order.take(packet, now_ns)
            if frame is not None:
                frames.append(self._counted(frame))
        return frames

    def settle(self, now_ns: int) -> list[Frame]:
        """Return the frame that waits for a neighbour: the line is silent, none will come."""
        frame = self._order.settle(now_ns)
        return [] if frame is None else [self._counted(frame)]

    def counts(self) -> Counter[Damage | str]:
        """Return what came so far: damaged blocks by kind, packets, doubtful frames, bytes."""
        counted = Counter[Damage | str]()
        counted.update(self.damages)
        counted.update(packets=self.packets, doubtful=self._order.doubtful, bytes=self.bytes)
        return counted

    @property
    def reboots(self) -> int:
        """Times the device restarted."""
        return self._order.reboots

    def statistics(self, *, reopenings: int = 0, overruns: int = 0) -> ClientStatistics:
        """Return the counts so far."""
        span_ns = self._times_ns[-1] - self._times_ns[0] if len(self._times_ns) > 1 else 0
        return ClientStatistics(
            frames=self.frames,
            rate=(len(self._times_ns) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0,
            lost=self._order.lost,
            failed=sum(self.damages.values()),
            doubtful=self._order.doubtful,
            reboots=self._order.reboots,
            reopenings=reopenings,
            overruns=overruns,
        )

    def _counted(self, frame: Frame) -> Frame:
        self.frames += 1
        self._times_ns.append(frame.t_ns)
        return frame
