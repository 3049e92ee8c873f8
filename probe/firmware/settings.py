"""Numbers that decide how long an emulated board is waited for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class EmulatorSettings:
    """An emulated board behind a pseudo-terminal."""

    answer_s: float = 20.0  #: within which it answers: a busy machine may take its time
    end_s: float = 5.0  #: within which it ends


EMULATOR = EmulatorSettings()
