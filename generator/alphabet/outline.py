"""Glyph outlines: (placeholder types; the owner completes this module)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ring = NDArray[np.float64]  # (k, 2) mm in the symbol's axes, outer counter-clockwise, holes clockwise


@dataclass(frozen=True, slots=True)
class SymbolStyle:
    """How symbols are embossed."""

    pitch_mm: float = 7.0
    height_mm: float = 1.0
    stroke_mm: float = 1.4  #: width of the stroke at the top
    draft_rad: float = 0.17453292519943295  #: slope of the sides from the vertical
    chamfer_mm: float = 0.0  #: of the top edge; 0 for none


@dataclass(frozen=True, slots=True)
class Tiers:
    """A symbol as outlines at rising (emboss) or falling (engrave) heights; same ring count and
    vertex count on every tier, so that neighbouring tiers join by planar quadrilaterals."""

    z_mm: tuple[float, ...]  #: first 0.0 in the face
    rings: tuple[tuple[Ring, ...], ...]  #: [tier][ring]; ring 0 outer, others holes
