"""Numbers that decide whether a symbol can be made."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class OutlineSettings:
    """What an outline may have, and what a printer needs of it."""

    shortest_edge: float = 0.01  #: of the stroke: an edge shorter than this is refused as collapsed
    least_chamfer_mm: float = 0.01  #: a smaller one cannot be seen, and its sides would be slivers
    foot_margin: float = 0.005  #: of the pitch: free around the footprint, for triangulation


OUTLINE = OutlineSettings()
