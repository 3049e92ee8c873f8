"""Numbers that decide which array `auto` takes, and when work is shared out."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ChoiceSettings:
    """Which array and how many processes."""

    larger: int = 4  #: sizes tried beyond `large`
    finer_shares: tuple[float, ...] = (0.9, 0.8)
    """Pitches tried where faces stay blank, over that which the sensor proposes: 4.5 and 4 mm."""
    first: float = 0.5  #: of an array's room that its first objects may fill
    few: int = 16  #: fewer tasks are done in this process, where nobody asked for others


CHOICE = ChoiceSettings()
