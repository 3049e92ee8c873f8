"""The pitch of symbols that a sensor type reads best.

Two things are wanted of a touch: several tactels on every symbol, and enough symbols on the
sensor. The pitch is the largest that shows `cells` of them on the matrix's area, but no larger
than `tactels` tactels to a symbol, which is as fine as symbols need to be felt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from probe.sensor import SensorType


@dataclass(frozen=True, slots=True)
class ProposalSettings:
    """What a touch should show. Chosen so that `fsr-16` gets the 7 mm of profile `one-touch`."""

    tactels: float = 4.41  #: to a pitch: more do not help (7 mm of `fsr-16`)
    cells: float = 11.7  #: on the matrix's area: about eight of them are seen whole
    grid_mm: float = 0.5  #: pitches are multiples of this
    least_mm: float = 3.0  #: finer strokes do not print


PROPOSAL = ProposalSettings()


def proposed_pitch_mm(sensor: SensorType, settings: ProposalSettings = PROPOSAL) -> float:
    """Return the pitch of symbols, mm.

    Examples
    --------
    >>> proposed_pitch_mm(SensorType())
    7.0
    """
    area = float(sensor.present().sum()) * sensor.pitch_mm**2
    most = min(settings.tactels * sensor.pitch_mm, math.sqrt(area / settings.cells))
    steps = math.floor(most / settings.grid_mm + 1e-9)
    return max(settings.least_mm, steps * settings.grid_mm)
