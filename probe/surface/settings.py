"""Numbers that decide how surfaces are tabulated, and what is rounding."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SurfaceSettings:
    """Outlines, symbols and templates."""

    same_point: float = 1e-9  #: share of the size below which points are one and edges are none
    on_edge: float = 1e-12  #: share of the size that counts as on an edge
    overlap: float = 1e-12
    """Share of the size by which sides overlap, so that rounding leaves no gap."""
    far_mm: float = 1e9  #: support of an edge that is not there
    bins: int = 192  #: of a template, along a side of a cell
    pairs: int = 1 << 25  #: of bins and triangles at most
    beside_bin: float = 1e-6
    """By which a triangle's stretch over bins is taken too long, of a bin; rounding is 1e-12."""


SURFACE = SurfaceSettings()
