"""Numbers that decide how ports wait, and what the software ones show."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PortSettings:
    """Serial lines, recordings, and probes of software."""

    baud: int = 1_000_000  #: where the address names none
    write_timeout_s: float = 1.0  #: a line that takes no byte for so long is broken
    pause_ns: int = 10_000_000  #: between the end of a recording and its repetition
    batch: int = 64  #: packets of one read at most
    late_s: float = 0.5  #: a reader later than that makes the device wait
    step_ns: int = 500_000_000  #: longest time between frames that needs no announcement
    rate_hz: float = 100.0  #: frames of a simulated probe
    marked_images: int = 4  #: markers an image apart by which it is known where images begin
    pause_least_s: float = 0.5e-3  #: quiet line that counts as a pause between images
    pauses: int = 8  #: the last ones that are remembered
    pattern_s: float = 4.0  #: one round of the test pattern
    pattern_steps: int = 400  #: images of one round
    finger: float = 1.6  #: radius of a finger, tactels
    way_x: float = 5 / 16  #: share of the columns that a finger goes to either side ...
    way_y: float = 4 / 16  #: ... and of the rows


PORT = PortSettings()
