"""Bytes in pieces of any size -> trusted frames, without a port and without a clock."""

from __future__ import annotations

from collections import deque

from probe.client.order import FrameOrder
from probe.client.statistics import ClientStatistics
from probe.frame import Frame
from probe.protocol import (
    Damage,
    FramePacket,
    IdentPacket,
    Splitter,
    StatisticsPacket,
    decode,
)


class Receiver:
    """The state of one conversation: splitter, order, what the device said of itself."""

    def __init__(self) -> None:
        self.ident: IdentPacket | None = None
        self.device: StatisticsPacket | None = None
        self.damages: dict[Damage, int] = dict.fromkeys(Damage, 0)
        self.packets = 0
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
            if not isinstance(packet, FramePacket):
                self._note(packet)
            frame = self._order.take(packet, now_ns)
            if frame is not None:
                frames.append(self._counted(frame))
        return frames

    def settle(self, now_ns: int) -> list[Frame]:
        """Return the frame that waits for a neighbour: the line is silent, none will come."""
        frame = self._order.settle(now_ns) if self._order.holds else None
        return [] if frame is None else [self._counted(frame)]

    @property
    def reboots(self) -> int:
        """Times the device started anew."""
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

    def _note(self, packet: IdentPacket | StatisticsPacket) -> None:
        if isinstance(packet, IdentPacket):
            self.ident = packet
        else:
            self.device = packet

    def _counted(self, frame: Frame) -> Frame:
        self.frames += 1
        self._times_ns.append(frame.t_ns)
        return frame
