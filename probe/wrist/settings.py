"""Numbers that decide what a wrist's distances tell."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WristSettings:
    """From distances to a pose."""

    many: float = 6.0  #: standard deviations that do not happen
    least_sin_gamma: float = 0.02  #: below, 0.01 mm of error is more than half a degree


WRIST_READING = WristSettings()
