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

#: Between two assembled panels, wherever they meet; glue and a filament printer's errors.
ASSEMBLY_GAP_MM = 0.14
GAP_IN_CLEARANCE = 0.5  #: share of the clearance of symbols that a panel's own edge may take
_GAP_STEPS_PER_MM = 500  # half the gap, measured in the face, is rounded up to one of these
_USUAL_GAP_INSET_MM = 0.1  # half the gap, in the face, that the layout counts at edges cut back
_REFLEX_LIMIT = 2.0  # a reflex edge's back reaches out at most so many walls (up to 307 degrees)
_RIGHT_RAD = math.pi / 2 + 1e-6  # angles up to this count as a right angle


@dataclass(frozen=True, slots=True)
class Mitre:
    """The side of a panel along one edge, from the top face down."""

    top_mm: float  #: inset of the top edge from the object's edge
    land_mm: float  #: height of the vertical land under the top edge, 0 for none
    back_mm: float  #: inset of the back edge; negative if it reaches out


def mitre(
    theta_rad: float, wall_mm: float, printer: Printer, gap_mm: float = ASSEMBLY_GAP_MM
) -> Mitre:
    """Return the side along an edge with interior dihedral angle `theta_rad`.

    It keeps half of `gap_mm` from the bisecting plane at every depth, and overhangs by at most
    `printer.overhang_max_rad`.
    """
    gap = _gap_inset_mm(theta_rad, gap_mm)
    land = 0.0 if theta_rad > _RIGHT_RAD else min(printer.layer_mm, wall_mm / 4)
    top = _top_inset_mm(theta_rad, wall_mm, printer, gap, gap)
    return Mitre(top, land, _back_inset_mm(theta_rad, wall_mm) + gap)


def top_inset_mm(
    theta_rad: float, wall_mm: float, printer: Printer, gap_mm: float = ASSEMBLY_GAP_MM
) -> float:
    """Return what the layout adds to the printer's clearance along an edge, mm.

    It is how far the top edge of a panel stands back from the object's edge. The gap counts only
    beyond a share of the clearance, so that panels and a whole body show the same symbols.
    """
    usual = _USUAL_GAP_INSET_MM
    whole = _top_inset_mm(theta_rad, wall_mm, printer, usual, 0.0)
    gap = _gap_inset_mm(theta_rad, gap_mm)
    top = _top_inset_mm(theta_rad, wall_mm, printer, gap, gap)
    return max(whole, top - GAP_IN_CLEARANCE * printer.edge_min_mm)


def symbol_clearance_mm(theta_rad: float, height_mm: float) -> float:
    """Return how far symbols keep from a reflex edge, so that those of both faces stay apart.

    Symbols `height_mm` high fill two layers of the void, which part where they meet its bisecting
    plane; 0 at a convex edge.
    """
    return max(0.0, -height_mm * _cotangent_of_half(theta_rad))


def _top_inset_mm(
    theta_rad: float, wall_mm: float, printer: Printer, gap_mm: float, least_mm: float
) -> float:
    """Return the inset of the top edge, with an inset for the gap, the least one at whole edges."""
    back = _back_inset_mm(theta_rad, wall_mm) + gap_mm
    steepest = math.tan(printer.overhang_max_rad)
    if theta_rad > _RIGHT_RAD:
        return max(least_mm, back - wall_mm * steepest)
    land = min(printer.layer_mm, wall_mm / 4)
    return max(back - (wall_mm - land) * steepest, land * _cotangent_of_half(theta_rad) + least_mm)


def _back_inset_mm(theta_rad: float, wall_mm: float) -> float:
    """Return where the bisecting plane meets the back; limited where it reaches far out."""
    return max(wall_mm * _cotangent_of_half(theta_rad), -_REFLEX_LIMIT * wall_mm)


def _gap_inset_mm(theta_rad: float, gap_mm: float) -> float:
    """Return how far inward half the gap is, measured in the face; rounded up to 0.01 mm."""
    exact = gap_mm / 2 / max(math.sin(theta_rad / 2), 1e-9)
    return math.ceil(exact * _GAP_STEPS_PER_MM - 1e-6) / _GAP_STEPS_PER_MM


def _cotangent_of_half(theta_rad: float) -> float:
    """Return cot(theta/2), finite at both ends of (0, 2 pi)."""
    return math.cos(theta_rad / 2) / max(math.sin(theta_rad / 2), 1e-9)
