"""Numbers that decide when a client waits, gives up and starts anew."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ClientSettings:
    """The thread that reads a port."""

    buffer: int = 2048  #: frames, about 2 MB and 20 s
    silence_s: float = 0.5  #: after so long without a packet the stream is started again
    answer_s: float = 5.0  #: a probe that has a boot loader answers within that
    slice_s: float = 0.05  #: longest wait for bytes; a frame without successor is held so long
    gather_s: float = 0.006  #: pause after few bytes, so that each byte does not wake the thread
    few: int = 4096  #: bytes of one read, below which that pause is made
    notices: int = 256  #: kept for whoever asks
    waiting: int = 2048  #: frames between the threads; beyond, the client counts overruns
    ident_s: float = 2.0  #: for which a stream waits for the description of the probe
    longest_step_us: int = 1_000_000  #: longest time from frame to frame that is confirmed at once
    slack: int = 64  #: frames by which number and time may disagree


CLIENT = ClientSettings()
