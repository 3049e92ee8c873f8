"""Numbers that decide in the thesis's own way of reading, one frozen value a stage.

    EdgeResponseSettings     what a tactel feels beside an edge
    EdgeLineSettings         lines and where they meet
    HoughSettings            edge points -> segments
    SyntaxRules              segments -> edges -> corners
    EdgeFitSettings          edges -> edges that explain the readings
    EdgeSearchSettings       image -> edges, by all of these
    InkSettings              image -> ink
    Counting                 thinned ink -> end-points and vertices
    SkeletonSettings         both -> symbols
    Acceptance, Merging      symbols -> grid; touches -> image
    ThesisSettings           image -> answer
    RoundingSettings         below which numbers are equal

Lengths in mm, angles in rad, unless a field says otherwise. Thesis 4.3, 6.1-6.3, appendix 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

Conversion = Literal["likelihood", "good tuple", "exact"]
Placing = Literal["product", "bounded", "believed"]


@dataclass(frozen=True, slots=True)
class EdgeResponseSettings:
    """What a tactel feels beside an edge, and where that is tabulated."""

    step_mm: float = 0.05  #: between the distances of a table
    reach_mm: float = 6.0  #: beyond, responses are 0 or 1
    blurs_mm: tuple[float, ...] = (0.1, 0.4, 0.75)  #: standard deviations that are tabulated
    bulge: float = 0.59  #: F(c) / F(1) = c (1 + bulge (1 - c)) of a tip covered by the share c
    pad: float = 0.5  #: of its thickness: what a pad smears, standard deviation


@dataclass(frozen=True, slots=True)
class EdgeLineSettings:
    """Where straight edges meet."""

    parallel: float = 0.1  #: sine of the angle below which two meet nowhere in particular


@dataclass(frozen=True, slots=True)
class HoughSettings:
    """What makes a segment."""

    turn_rad: float = math.radians(35)  #: of a point's slope against the segment's normal
    near_mm: float = 0.7  #: of a point from the line
    gap_mm: float = 4.0  #: between points of one unbroken run
    least_points: int = 3
    least_mm: float = 2.0  #: length of a segment
    spread_mm: float = 0.2  #: standard deviation of a point across the line, at least
    longest: int = 12  #: segments at most
    directions: int = 24  #: of the coarse accumulator, round the whole circle
    coarse_mm: float = 1.6  #: cell of the coarse accumulator
    fine_mm: float = 0.1  #: cell at which refinement ends: as fine as the points are good
    around: int = 2  #: cells of the refined accumulator to each side of its middle
    starts: int = 4  #: cells of the coarse accumulator that are followed


@dataclass(frozen=True, slots=True)
class SyntaxRules:
    """When segments run on into each other, and when they turn."""

    straight_rad: float = math.radians(155)  #: angle from which two are one edge
    break_mm: float = 5.0  #: shorter segments are breaks
    across_mm: float = 1.0  #: from one's line to the other's ends, for being one edge
    apart_mm: float = 12.0  #: along the way, between their ends
    spread_mm: float = 0.2  #: standard deviation of a point across an edge, at least
    beyond_mm: float = 5.0  #: how far from its edges' seen parts a corner may lie


@dataclass(frozen=True, slots=True)
class EdgeFitSettings:
    """How edges are fitted."""

    rounds: int = 3  #: of pressure and edges in turns
    steps: int = 3  #: of the edges in each
    band_mm: float = 3.0  #: tactels so near to an edge tell where it is
    inner_mm: float = 1.2  #: tactels so far inside tell the pressure
    gain: float = 0.15  #: standard deviation of tactels' gains
    floor: float = 0.07  #: of noise and of tabs off their places, over the pressure
    farthest: float = 3.0  #: standard deviations, beyond which a reading counts ever less
    model_mm: float = 0.06  #: standard deviation of an edge that the model alone makes
    model_rad: float = math.radians(0.4)
    least_tactels: int = 12  #: from which the pressure is told
    scale_mm: float = 6.0  #: over which the pressure changes
    slope_mm: float = 0.16  #: step of derivatives: half the gap between two tabs
    damping: tuple[float, float] = (30.0, 0.3)  #: of angle (1/rad^2) and offset (1/mm^2)
    most: tuple[float, float] = (0.1, 0.5)  #: that a step may change angle (rad) and offset (mm)


@dataclass(frozen=True, slots=True)
class EdgeSearchSettings:
    """How edges are found."""

    median: bool = True  #: before slopes are taken: spikes go, edges stay
    doublings: int = 2  #: of the image before its slopes are taken; a mosaic is fine already
    steep: float = 0.3  #: of the steepest slopes, from which a sample can be an edge point
    hough: HoughSettings = field(default_factory=HoughSettings)
    rules: SyntaxRules = field(default_factory=SyntaxRules)
    fitting: EdgeFitSettings = field(default_factory=EdgeFitSettings)
    most: int = 3  #: edges that are fitted at once
    beyond: float = 0.15  #: of what is felt inside an edge, that may be felt beyond it
    firm: float = 0.25  #: of what is felt most, that must be felt inside an edge
    moved_mm: float = 2.0  #: by a fit, at the ends of what is seen; edges moved further are none
    off: float = 3.0  #: expected standard deviations that a fit may leave unexplained


@dataclass(frozen=True, slots=True)
class InkSettings:
    """Where anything is pressed at all."""

    faint: float = 0.15  #: of what the image feels most; below it nothing is pressed


@dataclass(frozen=True, slots=True)
class CountingSettings:
    """When a bend or a branch counts, in lattice units of the alphabet (reach x pitch)."""

    spur: float = 0.4  #: branches with a free end that are shorter are pruned
    hook: float = 0.3  #: of a free end, in which thinning may have bent the line
    bow: float = 0.16  #: how far a line may bow from a straight one
    turn_rad: float = math.radians(40)  #: from which a bend is a corner
    near: float = 0.5  #: vertices nearer together are one


@dataclass(frozen=True, slots=True)
class SkeletonSettings:
    """When ink is a symbol."""

    share: float = 0.58  #: of the strongest reading nearby, from which a sample is ink
    least_area: float = 0.3  #: of a symbol's stroke area; smaller specks are no symbols
    shape: float = 0.35  #: lattice units, rms, that the points may be off; inf: counts alone
    counting: CountingSettings = field(default_factory=CountingSettings)
    thick: int = 6  #: samples that a stroke is magnified to before it is thinned
    fine: int = 101  #: points along a symbol's box, by which the middle of a glyph is found

    @property
    def rim(self) -> int:
        """Samples around a component that belong to its blur."""
        return self.thick // 2


@dataclass(frozen=True, slots=True)
class AcceptanceSettings:
    """When a symbol is the neighbour that was expected."""

    off: float = 0.25  #: pitches from where it is expected
    turn_rad: float = math.radians(25)  #: of its axes against the grid's
    gap: float = 3.5  #: cells from the nearest member, beyond which the lattice expects nothing
    place_mm: float = 0.2  #: standard deviation of a symbol's place, at least
    axes_rad: float = math.radians(4)  #: of its axes


@dataclass(frozen=True, slots=True)
class MergingSettings:
    """How touches are laid on each other."""

    placing: Placing = "product"  #: by products around the step, around the pose, or as believed
    window_tactels: float = 0.75  #: how far a belief is searched around, both ways
    overlap: float = 0.5  #: least share of the sensor's width and height in common
    turn_rad: float = math.radians(3)  #: touches turned further against each other
    faint: float = 0.2  #: of the strongest reading; zones without more show nothing


@dataclass(frozen=True, slots=True)
class ThesisSettings:
    """How the stages work, and when an answer is given."""

    median: bool = True  #: where strokes are wide enough to survive it
    symbols: SkeletonSettings = field(default_factory=SkeletonSettings)
    acceptance: AcceptanceSettings = field(default_factory=AcceptanceSettings)
    conversion: Conversion = "likelihood"
    error: float = 0.02  #: probability that a symbol is read wrong (likelihood)
    strangers: float = 0.1  #: share of the symbols that the face may not hold
    rim_mm: float = 2.0  #: how far the probe's centre may lie beyond the face


@dataclass(frozen=True, slots=True)
class RoundingSettings:
    """Below which numbers are equal but for rounding; no tolerance of what is felt."""

    samples: float = 1e-6  #: samples beyond an image's rim; share of two touches' overlap
    lattice: float = 1e-9  #: lattice units of a glyph


EDGE_RESPONSE, EDGE_LINE = EdgeResponseSettings(), EdgeLineSettings()
EDGE_SEARCH, INK, ROUNDING = EdgeSearchSettings(), InkSettings(), RoundingSettings()
