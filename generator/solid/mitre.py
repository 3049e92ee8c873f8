"""The mitre between two panels: how far a panel's edge stands back at each depth.

A panel of thickness `wall` ends in the plane that bisects the interior dihedral angle
theta: at depth t that plane lies t cot(theta/2) inward from the edge (outward where theta is
over pi). Lying on its back, the side overhangs by 90 degrees - theta/2 from the vertical.
Where the printer cannot do that, the outer edge is cut back instead: the side then rises
at the printer's limit from the mitred back edge. Lengths in mm, angles in rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from generator.printers import Printer
from generator.solid.settings import EMBOSS


@dataclass(frozen=True, slots=True)
class Mitre:
    """The side of a panel along one edge, from the top face down."""

    top_mm: float  #: inset of the top edge from the object's edge
    land_mm: float  #: height of the vertical land under the top edge, 0 for none
    back_mm: float  #: inset of the back edge; negative if it reaches out


def mitre(
    theta_rad: float, wall_mm: float, printer: Printer, gap_mm: float = EMBOSS.assembly_gap_mm
) -> Mitre:
    """Return the side along an edge with interior dihedral angle `theta_rad`.

    The side stays on its own side of the bisecting plane at every depth, and overhangs by
    at most `printer.overhang_max_rad`.
    """
    slope = _cotangent_of_half(theta_rad)
    back = max(wall_mm * slope, -EMBOSS.reflex_limit * wall_mm) + gap_mm
    steepest = math.tan(printer.overhang_max_rad)
    if theta_rad > EMBOSS.right_rad:
        return Mitre(max(0.0, back - wall_mm * steepest), 0.0, back)
    land = min(printer.layer_mm, wall_mm / 4)
    top = max(back - (wall_mm - land) * steepest, land * slope)
    return Mitre(top, land, back)


def top_inset_mm(theta_rad: float, wall_mm: float, printer: Printer) -> float:
    """Return how far a panel's top edge stands back from the object's edge, mm.

    What the layout adds to the printer's clearance along an edge with interior dihedral
    angle `theta_rad` (rad) and panels `wall_mm` thick; 0 where the edge is whole.
    """
    return mitre(theta_rad, wall_mm, printer).top_mm


def symbol_clearance_mm(theta_rad: float, height_mm: float) -> float:
    """Return how far symbols keep from a reflex edge so that those of both faces stay apart.

    Symbols `height_mm` high on the two faces fill two layers of the void, which part where
    they meet its bisecting plane; 0 at a convex edge.
    """
    return max(0.0, -height_mm * _cotangent_of_half(theta_rad))


def _cotangent_of_half(theta_rad: float) -> float:
    """Return cot(theta/2), finite at both ends of (0, 2 pi)."""
    return math.cos(theta_rad / 2) / max(math.sin(theta_rad / 2), 1e-9)
