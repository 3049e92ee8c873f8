"""A recording as a port: the frames of a file, packed as the probe would send them.

What the wire does not carry (the pose) is read by `probe.recording` alone. Times are those
of the recording, in whole microseconds, from 0 to 71 minutes at its first frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from probe.frame import Frame
from probe.port.address import Address, Port, number, refuse_unknown
from probe.port.software import SoftwareProbe
from probe.protocol import IdentPacket

_PAUSE_NS = 10_000_000  #: between the end of a recording and its repetition


def open_recording(address: Address) -> Port:
    """Open a recording for replay.

    Raises
    ------
    PortError
        When an option is no number.
    RecordingError
        When the file is no recording.
    """
    from probe.recording.read import Recording

    refuse_unknown(address, ("speed", "loop"))
    speed = number(address, "speed", 1.0)
    again = number(address, "loop", 0.0) > 0
    frames, (rows, columns) = Recording(address.target).frames(), Recording(address.target).shape
    if again:
        frames = endless_frames(lambda: Recording(address.target).frames())
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
