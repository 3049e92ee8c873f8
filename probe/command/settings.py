"""Numbers that decide how long the commands wait, and what they take for steady."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ProbeCommandSettings:
    """`probe-sensor` at a terminal."""

    answer_s: float = 0.5  #: a probe that was asked for its statistics answers within that
    slice_s: float = 0.1  #: longest wait for frames between two looks at the keyboard
    silent_s: float = 5.0  #: without a frame for so long, the host's clock ends a recording too
    pictures_hz: int = 15  #: of the live view
    hold: float = 0.98  #: of the scale of the live view is left after each frame shown


COMMAND = ProbeCommandSettings()
