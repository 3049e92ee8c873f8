"""What was deposited against what was designed, symbol by symbol, on one face.

PrintedSurface + Embossing -> one SymbolCheck for each symbol. A symbol's footprint is what
stands higher than half its height above the face around it, as printed; it is compared with
the outline at half height after both are laid on each other (how far a symbol stands from its
place is told apart). Symbol frame: its centre, its own axes, mm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generator.printed.surface import PrintedSurface
from generator.printed.symbol_design import (
    LATTICE,
    DesignLattice,
    SymbolDesign,
    footprint_shift,
    over_face,
    symbol_designs,
)
from generator.solid.emboss import turn
from generator.solid.part import Embossing

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

SURVIVES, DOUBTFUL, LOST = "survives", "doubtful", "lost"


@dataclass(frozen=True, slots=True)
class SurveyLimits:
    """When a symbol survives.

    Set by hand: symbols of 4.5 mm under the faults `bad` keep an overlap of 0.76 and more, and
    touches of such prints were named right in another simulation (docs/printed.md).
    """

    overlap: float = 0.70  #: least intersection over union of a symbol that survives
    overlap_least: float = 0.50  #: below, a stroke is missing or a gap is closed
    ahead: float = 0.05  #: of the overlap with the next symbol of the alphabet
    height: float = 0.70  #: of the designed height; one layer of four is within it
    height_least: float = 0.40
    moved_mm: float = 0.5  #: in x and y, by which a symbol is looked for beside its place
    lattice: DesignLattice = LATTICE  #: on which symbols are compared


LIMITS = SurveyLimits()


@dataclass(frozen=True, slots=True)
class SymbolCheck:
    """One symbol as printed."""

    part: str
    face: str
    name: str  #: "r12c34"
    label: int
    overlap: float  #: intersection over union of the footprints
    rival_overlap: float  #: with the likest other symbol of the alphabet; 0 without one
    area_mm2: float  #: of the footprint as designed
    lost_mm2: float  #: designed, not printed
    widened_mm2: float  #: printed, not designed
    height_mm: float  #: over the face around it
    designed_mm: float
    moved_mm: tuple[float, float]  #: its middle from where it should stand, symbol frame
    verdict: str  #: survives, doubtful or lost


@dataclass(frozen=True, slots=True, eq=False)
class SymbolTile:
    """Two pictures of one symbol, on the same lattice; row 0 has the lowest y."""

    check: SymbolCheck
    designed: Floats  #: (m, m) mm over the face
    deposited: Floats  #: (m, m)


def survey_face(
    surface: PrintedSurface,
    embossing: Embossing,
    *,
    part: str = "",
    face: str = "",
    limits: SurveyLimits = LIMITS,
) -> list[SymbolTile]:
    """Return every symbol of a face as printed.

    Parameters
    ----------
    surface
        In the frame of the embossing's facet.
    embossing
        The symbols as designed.
    part, face
        Their names.
    """
    points, designs = symbol_designs(embossing, limits.lattice)
    R = turn(embossing.rotation_rad)
    side = designs[0].footprint.shape if designs else (0, 0)

    def sample(number: int, moved: Floats) -> Floats:
        at = embossing.centres_mm[number] + (points + moved) @ R.T
        return surface.heights_mm(at).reshape(side)

    tiles = []
    for number, label in enumerate(embossing.labels.tolist()):
        design = designs[label]
        found, base = over_face(sample(number, np.zeros(2)), design)
        moved = np.zeros(2)
        for _ in range(2):  # the first shift changes what lies in the cell
            moved = moved + footprint_shift(found, design, points)
            moved = moved.clip(-limits.moved_mm, limits.moved_mm)
            found, base = over_face(sample(number, moved), design)
        printed = found > design.height_mm / 2
        rivals = [d for k, d in enumerate(designs) if k != label]
        pixel = limits.lattice.step_mm**2
        top = found[design.top]
        height = float(np.median(top)) if len(top) and np.isfinite(base) else 0.0
        check = SymbolCheck(
            part=part,
            face=face,
            name=embossing.names[number],
            label=label,
            overlap=_overlap(printed, design.footprint),
            rival_overlap=max((_best_overlap(printed, r, limits) for r in rivals), default=0.0),
            area_mm2=float(design.footprint.sum()) * pixel,
            lost_mm2=float((design.footprint & ~printed).sum()) * pixel,
            widened_mm2=float((printed & ~design.footprint).sum()) * pixel,
            height_mm=max(height, 0.0),
            designed_mm=design.height_mm,
            moved_mm=(float(moved[0]), float(moved[1])),
            verdict="",
        )
        tiles.append(SymbolTile(_judge(check, limits), design.heights, found))
    return tiles


def _judge(check: SymbolCheck, limits: SurveyLimits) -> SymbolCheck:
    ahead = check.overlap - check.rival_overlap
    height = check.height_mm / check.designed_mm
    verdict = DOUBTFUL
    if check.overlap >= limits.overlap and ahead >= limits.ahead and height >= limits.height:
        verdict = SURVIVES
    elif check.overlap < limits.overlap_least or ahead <= 0 or height < limits.height_least:
        verdict = LOST
    return replace(check, verdict=verdict)


def _overlap(a: Mask, b: Mask) -> float:
    union = float((a | b).sum())
    return float((a & b).sum()) / union if union else 0.0


def _best_overlap(printed: Mask, design: SymbolDesign, limits: SurveyLimits) -> float:
    """Return the overlap where the middles of both lie on each other, or nearly so."""
    near = printed & ~design.around
    if not near.any():
        return 0.0
    most = round(limits.moved_mm / limits.lattice.step_mm)
    at = [np.argwhere(mask).mean(axis=0) for mask in (near, design.footprint)]
    by = np.rint(at[1] - at[0]).astype(np.int64).clip(-most, most)
    return _overlap(np.roll(printed, by, axis=(0, 1)), design.footprint)
