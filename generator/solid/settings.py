"""How bodies, panels and their symbols are cut: every number that decides their form."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class EmbossingSettings:
    """Tolerances, gaps and sizes of solids."""

    # mitre.py
    assembly_gap_mm: float = 0.14
    """Between two assembled panels, wherever they meet; glue and a filament printer's errors."""
    gap_steps_per_mm: int = 500
    """Half the gap, measured in the face, is rounded up to one of these."""
    usual_gap_inset_mm: float = 0.1
    """Half the gap, in the face, that the layout counts at edges that are cut back."""
    gap_in_clearance: float = 0.5
    """Share of the clearance of symbols that a panel's own edge may take."""
    reflex_limit: float = 2.0
    """A reflex edge's back reaches out at most this many walls (angles up to 307 degrees)."""
    right_rad: float = math.pi / 2 + 1e-6
    """Angles up to this count as a right angle."""

    # fit.py
    fit_rounding_mm: float = 1e-6
    """A gap that is smaller by less is kept; rounding of 64-bit coordinates is far below."""
    fit_parallel: float = 1e-6
    """Faces whose normals differ by less have no bisecting plane (both of unit length)."""
    fit_edge_mm: float = 0.05
    """A cut that leaves a shorter edge is moved back: nothing shorter prints or keeps in STL."""
    fit_step_mm: float = 0.02
    """By which a cut is moved back at a time."""
    fit_steps: int = 12
    """Tries at that; the one with the longest shortest edge is taken where none is enough."""

    # inset.py
    flat_turn_rad: float = math.radians(15)
    """Neighbours that turn by less share one inset where theirs would push the corner far."""

    # marks.py, mark_name.py
    mark_sizes: tuple[float, ...] = (2.0, 1.5, 1.25, 1.0)
    """Lattice unit of a back's figures, in strokes; the smallest keeps a gap of one stroke."""
    mark_places: tuple[float, ...] = (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9)
    """Where along its edge a number may stand, best first."""
    name_apart: float = 2.0
    """Between a name and a number, in gaps of two figures: they are not read as one."""
    name_angles: int = 6
    """Directions of edges, upright ones first, in which a name may be read."""
    name_tries: int = 200
    """Places of a code that are tried where it takes the room of numbers."""
    mark_depth: float = 0.4
    """Of a figure, over its stroke: a fifth of the stroke is left as a floor."""

    # panels.py
    listed_marks: int = 3
    """Kinds of missing numbers that a warning lists in full."""

    # lattice.py
    on_lattice: float = 1e-6
    """A centre is on the lattice, and a square inside its facet, within this share of the pitch."""

    # closed.py
    planarity: float = 1e-9
    """Points may lie off their plane by this share of the part's size."""

    # polygon.py
    clipping_turns_rad: tuple[float, ...] = (0.0, 0.3, 1.1, 2.0)
    """By which an area is turned where its triangles do not come out right."""
    flat: float = 1e-6
    """Triangles thinner than this share of their longest side are taken for flat: the rounding of
    STL, 1e-6 mm at 20 mm, turns them over."""

    # triangulate.py
    bent_flat: float = 1e-5
    """As `flat`, for pieces of symbols on round faces."""

    # analytic.py
    least_analytic_facets: int = 3
    """Fewer facets than these do not tell an axis."""
    on_circle: float = 1e-6
    """Vertices that lie off their circle by less, as a share of the size, lie on it."""

    # bend.py
    bend_error_mm: float = 2e-6
    """Outlines of symbols in STEP lie this near to the round face: CAD programs keep 1e-4."""
    bend_degrees: tuple[int, int] = (2, 9)
    """Of their Bezier curves; the highest is for symbols at the tip of a cone."""
    bend_samples: int = 12
    """Points of a curve at which that is checked."""

    # cut.py
    nudge_mm: float = 0.005
    """Far below what prints or is felt, far above the rounding of STL."""


EMBOSS = EmbossingSettings()
