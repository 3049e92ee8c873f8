"""Numbers that decide how written parts are touched in simulation.

Lengths in mm, angles in rad, forces in N, times in s, unless a field says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FaceAroundSettings:
    """What belongs to the surface under a touch of a registered face."""

    deepest_mm: float = 8.0  #: symbols of other faces that stay farther below are left out
    beside_mm: float = 40.0  #: and those farther beside the face's box
    up: float = 0.999  #: cosine from which a face lies up
    flat: float = 1e-9  #: share of the size that is rounding
    around_mm: float = 24.0
    """Of a touch of a round face: what lies farther is not under the sensor."""


@dataclass(frozen=True, slots=True)
class TouchDrawSettings:
    """Where a touch is set down."""

    tries: int = 16_000  #: draws for one touch: a region that fills 0.1 % of its box is still found
    at_once: int = 16  #: draws
    grid: int = 64  #: places each way among which the inmost of a region is taken


@dataclass(frozen=True, slots=True)
class SimulatedScanSettings:
    """A scan by an arm over a face."""

    face_at_mm: tuple[float, float, float] = (300.0, 0.0, 100.0)
    """Robot's base: the middle of the region, within reach."""
    face_turn_rad: float = 0.2  #: of the face about the base's z, so that no axes agree by chance
    least_cover: float = 0.5  #: over the face, of the best place's: with less the sensor slips off
    lift_mm: float = 10.0
    """Between two touches; the way decides on which side of its play a joint is."""
    gap_mm: float = 3.0  #: from where an approach begins to the surface


@dataclass(frozen=True, slots=True)
class SimulatedPortSettings:
    """A part that is touched again and again behind a port."""

    levels: int = 16  #: of the force while it rises and falls: each is one contact
    tries: int = 64  #: directions tried for the next step, places tried that hold no sensor


FACE_AROUND = FaceAroundSettings()
TOUCH_DRAW = TouchDrawSettings()
SIMULATED_SCAN = SimulatedScanSettings()
SIMULATED_PORT = SimulatedPortSettings()
