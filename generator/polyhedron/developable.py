"""Cylinder and cone faces: runs of narrow planar facets that unroll into the plane as one.

The solid stays a polyhedron: N facets stand for the round face, each a trapezoid between two
straight lines of it. Unrolled about these lines the facets fill one polygon of the plane, and
that unrolling changes no length on any facet. The face as a whole has the name, the frame
and the symbols of its first facet: the face frame of that facet is the plane into which all
of them unroll. The others are called F2.2, F2.3, ... Lengths in mm, angles in rad.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Developable:
    """One round face of a polyhedron."""

    kind: str  #: cylinder, cone
    facets: tuple[int, ...]  #: faces of the polyhedron; each lies to the right of the one before
    radius_mm: float  #: of the round face; of a cone the largest
    half_angle_rad: float  #: of a cone, between axis and side; 0 for a cylinder
    closed: bool  #: whether the last facet meets the first
    concave: bool  #: whether it is the wall of a hole
    chord_error_mm: float  #: greatest distance of the facets from the round face

    @property
    def carrier(self) -> int:
        """The facet under whose number the whole face is laid out and registered."""
        return self.facets[0]

    def definition(self) -> dict[str, Any]:
        """Return the face as plain values, for the database."""
        return {
            "kind": self.kind,
            "facets": list(self.facets),
            "radius_mm": round(self.radius_mm, 9),
            "half_angle_rad": round(self.half_angle_rad, 12),
            "closed": self.closed,
            "concave": self.concave,
            "chord_error_mm": round(self.chord_error_mm, 9),
        }


def developable_from(definition: dict[str, Any]) -> Developable:
    """Return the face that `Developable.definition` describes."""
    return Developable(**{**definition, "facets": tuple(definition["facets"])})
