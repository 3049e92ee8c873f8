"""Symbols as designed, on the lattice on which they are compared with what was printed.

Embossing -> one SymbolDesign for each label. Symbol frame: its centre, its own axes, mm. A
footprint is what stands higher than half a symbol's height above the face around it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Ring, Tiers
from generator.plane.polygon import points_inside
from generator.plane.rings import distance
from generator.solid.part import Embossing

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_GOLDEN = (5**0.5 - 1) / 2


@dataclass(frozen=True, slots=True)
class DesignLattice:
    """How finely symbols are compared, and what near their edges is left out."""

    step_mm: float = 0.05  #: between two places
    base_clear_mm: float = 0.3  #: from a foot, where the face around it is measured
    top_clear_mm: float = 0.2  #: from the edge of the top, where its height is measured


LATTICE = DesignLattice()


@dataclass(frozen=True, slots=True, eq=False)
class SymbolDesign:
    """A symbol as designed, on the lattice of its cell."""

    footprint: Mask  #: (m, m) at half height
    top: Mask  #: well inside of the top
    around: Mask  #: well outside of the foot
    heights: Floats  #: (m, m) mm
    height_mm: float


def symbol_designs(
    embossing: Embossing, lattice: DesignLattice
) -> tuple[Floats, list[SymbolDesign]]:
    """Return the lattice of a cell, (m * m, 2), and every label's design on it."""
    reach = max(float(np.abs(ring).max()) for tiers in embossing.tiers for ring in tiers.rings[0])
    half = embossing.pitch_mm / 2 if embossing.pitch_mm else reach + 2 * lattice.base_clear_mm
    count = int(half / lattice.step_mm)
    line = np.arange(-count, count + 1) * lattice.step_mm
    x, y = np.meshgrid(line, line)
    # Rows and columns are shifted by parts of a step, or all places along a straight edge would
    # fall on the same side of it.
    shift = (np.arange(len(line)) * _GOLDEN % 1 - 0.5) * lattice.step_mm
    x, y = x + shift[:, None], y + shift
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    side = (len(line), len(line))
    return points, [_symbol_design(tiers, points, side, lattice) for tiers in embossing.tiers]


def _symbol_design(
    tiers: Tiers, points: Floats, side: tuple[int, int], lattice: DesignLattice
) -> SymbolDesign:
    high = tiers.z_mm[-1]
    foot, top = tiers.rings[0], tiers.rings[-1]
    clear = distance(points, foot) > lattice.base_clear_mm
    heights = np.zeros(len(points))
    for level in np.linspace(0.0, high, 11):
        heights[points_inside(points, rings_at(tiers, float(level)))] = level
    return SymbolDesign(
        footprint=points_inside(points, rings_at(tiers, high / 2)).reshape(side),
        top=(points_inside(points, top) & (distance(points, top) > lattice.top_clear_mm)).reshape(
            side
        ),
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
    """Return how far the printed footprint's middle lies from the designed one's.

    What lies further from the foot, such as strings, is not counted.
    """
    printed = ((found > design.height_mm / 2) & ~design.around).ravel()
    if not printed.any():
        return np.zeros(2)
    moved: Floats = points[printed].mean(axis=0) - points[design.footprint.ravel()].mean(axis=0)
    return moved
