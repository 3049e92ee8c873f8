"""How models of files are read: every number that decides what solid comes out.

Shares are of the size, the diagonal of the bounding box.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ModelSettings:
    """Tolerances and limits of reading STL, OBJ and STEP."""

    # __init__.py
    largest_bytes: int = 64 * 2**20
    """Of a file: bounds the memory."""
    largest_mm: float = 1e4
    """Of the solid, as of a length in a spec."""

    # stl.py
    most_triangles: int = 500_000
    """Of a mesh: bounds time and memory."""
    most_part_triangles: int = 20_000_000
    """Of a part that was written; in binary STL they take 1 GB."""

    # obj.py
    most_polygons: int = 500_000
    """As `most_triangles`."""

    # soup.py
    weld: float = 1e-6
    """Points nearer than this share of the size are one point."""
    coarse_weld: float = 1e-5
    """As `weld`, tried where this makes no solid: notches as wide as a rounding of the program."""
    digits: float = 1e-6
    """Share of a coordinate that is noise: seven digits, in float32 as in ASCII STL (%e)."""
    largest_coordinate_mm: float = 1e6
    """No object is larger than this; larger numbers are garbage."""

    # merge.py
    coplanar: float = 1e-5
    """Coplanar points lie this near to a plane, as a share of the size."""
    coplanar_rad: float = 1e-3
    """Coplanar polygons turn by no more than this, besides the noise."""
    sliver: float = 8.0
    """A polygon thinner than this many times the noise has no direction."""
    most_faces: int = 100
    """After merging: of more, those that bend belong to curved surfaces, and stay blank."""

    # regions.py
    smooth_rad: float = 0.36
    """Facets of one curved surface meet at no more: circles of 18 sides and more."""
    bend: float = 0.5
    """Radius, as a share of the size, above which narrow faces are planar ones."""
    faint_rad: float = 0.02
    """Strips that meet at less belong to one curved surface of any radius."""
    strip: float = 0.05
    """Width of such a strip, as a share of the size."""

    # tee.py
    tee_noise: float = 4.0
    """A point this many times the noise beside an edge lies on it."""

    # step.py
    longest_s: float = 300.0
    """Of the CAD kernel's process, which is stopped then."""

    # kernel.py
    planar_mm: float = 1e-5
    """A spline surface this flat is a plane; kernel tolerances are smaller."""

    # strip.py
    same: float = 1e-6
    """Share of the size within which lines and circles are what they seem."""

    # curved.py
    blank_error_mm: float = 0.1
    """Chord error of faces that carry no symbols: half a printed layer."""
    interior_rad: float = 0.35
    """Between triangles of faces that carry no symbols."""
    coarser: tuple[float, ...] = (1.0, 2.0, 5.0, 10.0)
    """Times the chord errors, until there are few enough facets."""
    most_facets: int = 6000
    """Of a solid with round faces, or of a mesh after merging: bounds the time."""

    # facets.py
    facet_weld: float = 1e-5
    """Points of the kernel's facets nearer than this share of the size are one."""
    listed_blank: int = 12
    """Blank faces of one kind that a note names with their places."""


MODEL = ModelSettings()
