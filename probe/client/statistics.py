"""What a client counted so far."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ClientStatistics:
    """A snapshot; every count is since the client was opened."""

    frames: int = 0  #: handed on, or dropped as overrun
    rate: float = 0.0  #: frames a second, over the last 64 by the device's clock
    lost: int = 0  #: numbers that never came as a trusted frame
    failed: int = 0  #: blocks that are no packet: check sum, length, type, version, value
    doubtful: int = 0  #: frames whose check sum is right, but not their neighbour; not handed on
    reboots: int = 0  #: times the device started anew
    reopenings: int = 0  #: times the port went away and came back
    overruns: int = 0  #: trusted frames that the consumer was too slow to take
