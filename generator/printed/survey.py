"""Deposited against designed symbols, one by one, on one face.

A symbol's footprint stands higher than half its height above the face around it, as printed; it
is compared with the outline at half height after both are laid on each other (the distance of a
symbol from its place is given apart). Symbol frame: its centre, its own axes, mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Ring, Tiers
from generator.plane.polygon import distance, points_inside
from generator.printed.surface import PrintedSurface
from generator.solid.part import Embossing, turn

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_GOLDEN = (5**0.5 - 1) / 2


STEP_MM = 0.05  #: between two places at which symbols are compared
_BASE_CLEAR_MM = 0.3  # from a foot, where the face around it is measured
_TOP_CLEAR_MM = 0.2  # from the edge of the top, where its height is measured

# When a symbol survives, set by hand: symbols of 4.5 mm under the faults `bad` keep an overlap of
# 0.76 and more, and touches of such prints were named right in another simulation
# (docs/printed.md).
SURVIVES, DOUBTFUL, LOST = "survives", "doubtful", "lost"
_OVERLAP = 0.70  # least intersection over union of a symbol that survives
_OVERLAP_LEAST = 0.50  # below, a stroke is missing or a gap is closed
_AHEAD = 0.05  # of the overlap with the next symbol of the alphabet
_HEIGHT = 0.70  # of the designed height; one layer of four is within it
_HEIGHT_LEAST = 0.40
_MOVED_MM = 0.5  # in x and y, by which a symbol is searched around its place


@dataclass(frozen=True, slots=True, eq=False)
class SymbolDesign:
    """A symbol as designed, on the lattice of its cell."""

    footprint: Mask  #: (m, m) at half height
    top: Mask  #: well inside of the top
    around: Mask  #: well outside of the foot
    heights: Floats  #: (m, m) mm
    height_mm: float


def symbol_designs(
    embossing: Embossing, step_mm: float = STEP_MM
) -> tuple[Floats, list[SymbolDesign]]:
    """Return the lattice of a cell, (m * m, 2), and every label's design on it."""
    reach = max(float(np.abs(ring).max()) for tiers in embossing.tiers for ring in tiers.rings[0])
    half = embossing.pitch_mm / 2 if embossing.pitch_mm else reach + 2 * _BASE_CLEAR_MM
    count = int(half / step_mm)
    line = np.arange(-count, count + 1) * step_mm
    x, y = np.meshgrid(line, line)
    # Rows and columns are shifted by parts of a step, or all places along a straight edge would
    # fall on the same side of it.
    shift = (np.arange(len(line)) * _GOLDEN % 1 - 0.5) * step_mm
    x, y = x + shift[:, None], y + shift
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    side = (len(line), len(line))
    return points, [_symbol_design(tiers, points, side) for tiers in embossing.tiers]


def _symbol_design(tiers: Tiers, points: Floats, side: tuple[int, int]) -> SymbolDesign:
    high = tiers.z_mm[-1]
    foot, top = tiers.rings[0], tiers.rings[-1]
    clear = distance(points, foot) > _BASE_CLEAR_MM
    heights = np.zeros(len(points))
    for level in np.linspace(0.0, high, 11):
        heights[points_inside(points, rings_at(tiers, float(level)))] = level
    return SymbolDesign(
        footprint=points_inside(points, rings_at(tiers, high / 2)).reshape(side),
        top=(points_inside(points, top) & (distance(points, top) > _TOP_CLEAR_MM)).reshape(side),
        around=(clear & ~points_inside(points, foot)).reshape(side),
        heights=heights.reshape(side),
        height_mm=high,
    )


def rings_at(tiers: Tiers, z_mm: float) -> list[Ring]:
    """Return a symbol's outline at a height over the face; corners move on straight lines."""
    k = int(np.clip(np.searchsorted(tiers.z_mm, z_mm) - 1, 0, len(tiers.z_mm) - 2))
    share = (z_mm - tiers.z_mm[k]) / (tiers.z_mm[k + 1] - tiers.z_mm[k])
    return [a + share * (b - a) for a, b in zip(tiers.rings[k], tiers.rings[k + 1], strict=True)]


def over_face(found: Floats, design: SymbolDesign) -> tuple[Floats, float]:
    """Return heights over the face around a symbol as printed, and that face's own height."""
    around = found[design.around & np.isfinite(found)]
    base = float(np.median(around)) if len(around) else -np.inf
    return (found - base if np.isfinite(base) else np.full_like(found, -np.inf)), base


def footprint_shift(found: Floats, design: SymbolDesign, points: Floats) -> Floats:
    """Return how far the printed footprint's middle lies from the designed one's, (2,) mm.

    Plastic further from the foot, such as strings, does not count.
    """
    printed = ((found > design.height_mm / 2) & ~design.around).ravel()
    if not printed.any():
        return np.zeros(2)
    moved: Floats = points[printed].mean(axis=0) - points[design.footprint.ravel()].mean(axis=0)
    return moved


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
) -> list[SymbolTile]:
    """Return every symbol of a face as printed; surface in the frame of the embossing's facet."""
    points, designs = symbol_designs(embossing)
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
            moved = moved.clip(-_MOVED_MM, _MOVED_MM)
            found, base = over_face(sample(number, moved), design)
        printed = found > design.height_mm / 2
        rivals = [d for k, d in enumerate(designs) if k != label]
        pixel = STEP_MM**2
        top = found[design.top]
        height = float(np.median(top)) if len(top) and np.isfinite(base) else 0.0
        height = max(height, 0.0)
        overlap = _overlap(printed, design.footprint)
        rival = max((_best_overlap(printed, other) for other in rivals), default=0.0)
        check = SymbolCheck(
            part=part,
            face=face,
            name=embossing.names[number],
            label=label,
            overlap=overlap,
            rival_overlap=rival,
            area_mm2=float(design.footprint.sum()) * pixel,
            lost_mm2=float((design.footprint & ~printed).sum()) * pixel,
            widened_mm2=float((printed & ~design.footprint).sum()) * pixel,
            height_mm=height,
            designed_mm=design.height_mm,
            moved_mm=(float(moved[0]), float(moved[1])),
            verdict=_verdict(overlap, overlap - rival, height / design.height_mm),
        )
        tiles.append(SymbolTile(check, design.heights, found))
    return tiles


def _verdict(overlap: float, ahead: float, height: float) -> str:
    if overlap >= _OVERLAP and ahead >= _AHEAD and height >= _HEIGHT:
        return SURVIVES
    return LOST if overlap < _OVERLAP_LEAST or ahead <= 0 or height < _HEIGHT_LEAST else DOUBTFUL


def _overlap(a: Mask, b: Mask) -> float:
    union = float((a | b).sum())
    return float((a & b).sum()) / union if union else 0.0


def _best_overlap(printed: Mask, design: SymbolDesign) -> float:
    """Return the overlap where the middles of both lie on each other, or nearly so."""
    near = printed & ~design.around
    if not near.any():
        return 0.0
    most = round(_MOVED_MM / STEP_MM)
    at = [np.argwhere(mask).mean(axis=0) for mask in (near, design.footprint)]
    by = np.rint(at[1] - at[0]).astype(np.int64).clip(-most, most)
    return _overlap(np.roll(printed, by, axis=(0, 1)), design.footprint)
