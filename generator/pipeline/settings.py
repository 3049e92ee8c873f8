"""Numbers that decide which array `auto` takes, and when work is shared out."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ChoiceSettings:
    """Which array and how many processes."""

    larger: int = 4  #: sizes tried beyond `large`
    few: int = 16  #: fewer tasks are done in this process, where nobody asked for others


CHOICE = ChoiceSettings()
