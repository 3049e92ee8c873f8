"""What the bend of a round face does to symbols, and whether the printer still makes them.

At height z the moved facets of a convex face are wider by z / r and those of a hole's wall
narrower: foot and gaps between feet stay as they are, tops stretch or shrink around the face.
"""

from __future__ import annotations

import numpy as np

from generator.alphabet.outline import SymbolStyle, Tiers
from generator.alphabet.printable import gap_inside_mm
from generator.polyhedron.development import Development
from generator.printers import Printer


def least_facet_width(development: Development, height_mm: float) -> float:
    """Return the least width of a facet at a height, as a share of its width on the surface.

    Over 1 on a convex face, under 1 in a hole; 0 or less where facets vanish below that height.
    """
    d = development
    shares = []
    for points in (d.low, d.high):
        across = np.diff(points, axis=0)
        width = np.hypot(across[:, 0], across[:, 1])
        grown = np.linalg.norm(np.diff(d.bends, axis=0), axis=1) * height_mm
        with np.errstate(divide="ignore"):
            share = np.where(width > 0.0, grown / np.where(width > 0.0, width, 1.0), np.inf)
        shares.append(share.max())
    outward = _widens_outwards(d)
    return 1.0 if outward else 1.0 - float(max(shares))


def bend_problem(
    development: Development, tiers: tuple[Tiers, ...], style: SymbolStyle, printer: Printer
) -> str:
    """Return why a printer loses symbols on a face, "" where it does not."""
    share = least_facet_width(development, style.height_mm)
    if share <= 0.0:
        return f"symbols of {style.height_mm:g} mm meet in its middle"
    stroke = share * style.stroke_mm
    if stroke < printer.stroke_min_mm * (1 - 1e-9):
        return (
            f"its bend narrows strokes to {stroke:.2g} mm, {printer.name} needs "
            f"{printer.stroke_min_mm:g} mm"
        )
    gap = share * min(gap_inside_mm(shape) for shape in tiers)
    least = printer.gap_inside_mm
    if gap < least * (1 - 1e-9):
        return (
            f"its bend narrows gaps in a symbol to {gap:.3g} mm, {printer.name} needs {least:g} "
            "mm; a larger pitch helps"
        )
    return ""


def _widens_outwards(development: Development) -> bool:
    """Whether the facets widen as they rise."""
    d = development
    T = d.T_object_flat[0]
    across = T[:3, :2] @ (d.low[1] - d.low[0])
    return bool((d.bends[1] - d.bends[0]) @ across >= 0.0)
