"""What counts as a solid, and how round shapes are divided: every number that decides it.

Shares are of the size, the diagonal of the bounding box.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PolyhedronSettings:
    """Tolerances of a polyhedron and limits of named shapes."""

    # check_faces.py
    planarity: float = 1e-4
    """Most a vertex may lie off its face's plane, as a share of the size: more is no rounding."""
    closeness: float = 1e-6
    """Two points, or a point and an edge, nearer than this share touch: a float32's rounding."""

    # winged.py
    least_volume: float = 1e-7
    """Least volume of a solid, as a share of the cube of its size."""
    noted_move: float = 2e-7
    """Vertices moved farther than this share of the size are reported."""

    # front.py
    touching: float = 1e-6
    """Nearer than this share of the size, nothing is in front of a face."""
    facing: float = -0.01
    """Cosine between faces that look at each other, at most: those at right angles do not."""
    negligible: float = 1e-6
    """Share of a face's area below which it is not covered."""

    # flatten.py
    planar_exactly: float = 2e-15
    """Vertices this near to their planes, as a share of the size, stay as they are."""
    dense_equations: int = 3000
    """Of flattening; more are solved as a sparse system."""
    planar_enough: float = 1e-10
    """As `planar_exactly`, where there are more equations: a tenth of what parts allow."""
    most_equations: int = 30000
    """Of flattening; beyond this the coordinates are left as given: bounds the time."""
    flatten_steps: int = 6
    """Steps of flattening at most."""

    # shapes.py
    shortest_mm: float = 1.0
    """Shortest length of a named shape."""
    longest_mm: float = 5000.0
    """Longest length of a named shape."""
    length_ratio: float = 200.0
    """Most a length may exceed another one of the same solid."""
    most_sides: int = 64
    """Of a prism or pyramid."""

    # round.py
    chord_error_mm: float = 0.02
    """Of a round face's facets: a tenth of a printed layer; also of round faces that are read."""
    facets: tuple[int, int] = (24, 240)
    """Fewest and most to a full circle; also of round faces that are read."""


SOLID = PolyhedronSettings()
