"""How large an object is: its box along the object's axes, round faces as round as they print."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from generator.polyhedron import Polyhedron
from generator.solid.part import Part


def outer_size_mm(polyhedron: Polyhedron, parts: Sequence[Part]) -> NDArray[np.float64]:
    """Return the lengths of the box (3,) mm.

    The facets that stand for a round face leave it by their chord error (a can of 60 mm measures
    59.96 mm between their corners); where it goes all around, its circles count in their place.
    """
    closed = {face.name: (part, face) for part in parts for face in part.analytic if face.closed}
    kept = np.ones(len(polyhedron.vertices), bool)
    points = []
    for surface in polyhedron.surfaces:
        found = closed.get(polyhedron.faces[surface.carrier].name)
        if found is None:
            continue
        part, face = found
        for facet in surface.facets:
            kept[[v for loop in polyhedron.faces[facet].loops for v in loop]] = False
        T = part.T_object_part @ face.T_part_axis
        axis = T[:3, 2]
        across = np.sqrt(np.maximum(0.0, 1.0 - axis**2))  # of a circle of radius 1, along x, y, z
        for rim in (face.low, face.high):
            centre = T[:3, 3] + rim.height_mm * axis
            points += [centre - rim.radius_mm * across, centre + rim.radius_mm * across]
    return np.asarray(np.ptp([*polyhedron.vertices[kept], *points], axis=0))
