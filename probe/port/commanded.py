"""The device's side of the protocol, where there is no device that knows it.

Commands go in; their wishes are kept here, and the answers to them packed. The subclass reads.
"""

from __future__ import annotations

from dataclasses import replace

from probe.protocol import Command, IdentPacket, Packet, StatisticsPacket, encode


class CommandedProbe:
    """The state that commands give a probe.

    `ident` describes it. With `bits` 10 and `adjustable`, it obeys the
    commands for 8 and 10 bits.
    """

    def __init__(self, url: str, ident: IdentPacket, *, adjustable: bool = False) -> None:
        self.url = url  #: opens this port again
        self.ident = ident
        self.streaming = False
        self.wanted = 0  #: single frames that were asked for
        self.sent = self.waits = self.errors = 0
        self._adjustable = adjustable
        self._replies: list[bytes] = []

    def write(self, data: bytes) -> None:
        """Obey the commands, one byte each."""
        for command in (data[i : i + 1] for i in range(len(data))):
            self._obey(command)

    def close(self) -> None:
        """Stop sending."""
        self.streaming = False

    def take_replies(self) -> bytes:
        """Return the answers that wait to be read."""
        replies, self._replies = b"".join(self._replies), []
        return replies

    def begin(self) -> None:
        """Begin a stream; called when one is started that does not run."""

    def now(self) -> tuple[int, int]:
        """Return number and time for a packet that is no frame."""
        raise NotImplementedError

    def statistics(self) -> Packet:
        """Return the counts of the device."""
        seq, t_us = self.now()
        errors = min(self.errors, 65535)
        return StatisticsPacket(seq, t_us, self.sent, self.waits, errors, t_us // 1000)

    def _obey(self, command: bytes) -> None:
        if command == Command.START:
            if not self.streaming:
                self.begin()
            self.streaming = True
        elif command == Command.STOP:
            self.streaming = False
        elif command == Command.ONE:
            self.wanted += 1
        elif command == Command.IDENT:
            seq, t_us = self.now()
            self._replies.append(encode(replace(self.ident, seq=seq, t_us=t_us)))
        elif command == Command.STATISTICS:
            self._replies.append(encode(self.statistics()))
        elif command in b"01234567":
            self.ident = replace(self.ident, sensor=int(command))
        elif command in b"ab":
            if self._adjustable:
                self.ident = replace(self.ident, bits=10 if command == b"a" else 8)
        else:
            self.errors += 1
