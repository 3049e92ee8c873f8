"""The pitch of symbols that a sensor type reads best.

Two things are wanted of a touch: several tactels on every symbol, and enough symbols on the
sensor. The pitch is the largest that shows `cells` of them on the matrix's area, but no larger
than `tactels` tactels to a symbol (`pad_tactels` under a pad, which blurs), which is as fine as
symbols need to be felt. `encode-object --sensor-type` takes it; for `fsr-16` it is the 5 mm that
`auto` takes anyway.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from probe.sensor import SensorType


@dataclass(frozen=True, slots=True)
class ProposalSettings:
    """What a touch should show."""

    tactels: float = 3.15
    """To a pitch. 5 mm of `fsr-16` (docs/pitches.md). Of 30 touches each of `flexitac-12x32`,
    typical and mismatch: at 6 mm 30 and 29 right amid faces, 17 and 12 at edges; at 8.5 mm,
    4.2 tactels, 30 and 30, 10 and 11."""
    pad_tactels: float = 4.41  #: 7 mm of `fsr-16`: at 5 mm 18 of 30 are right, at 7 mm 28
    cells: float = 11.7  #: on the matrix's area: about eight of them are seen whole
    grid_mm: float = 0.5  #: pitches are multiples of this
    least_mm: float = 3.0  #: finer strokes do not print


PROPOSAL = ProposalSettings()


def proposed_pitch_mm(sensor: SensorType, settings: ProposalSettings = PROPOSAL) -> float:
    """Return the pitch of symbols, mm.

    Examples
    --------
    >>> proposed_pitch_mm(SensorType())
    5.0
    """
    tactels = settings.pad_tactels if sensor.overlay.kind == "pad" else settings.tactels
    area = float(sensor.present().sum()) * math.prod(sensor.step_mm)
    most = min(tactels * max(sensor.step_mm), math.sqrt(area / settings.cells))
    steps = math.floor(most / settings.grid_mm + 1e-9)
    return max(settings.least_mm, steps * settings.grid_mm)
