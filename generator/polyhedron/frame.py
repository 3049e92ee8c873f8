"""Measures of a polyhedron: face frames, areas, edge lengths, dihedral angles, volume.

Face frame: origin at the face's first vertex, x along its first edge, z outward (Newell
normal). A face is non-convex or holed as it likes. mm, mm^2, mm^3, radians. Thesis 6.3.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from generator.plane.polygon import area_vector, face_vector, signed_area, signed_volume
from generator.polyhedron.check import face_axes, flat_loops
from generator.polyhedron.winged import Polyhedron

Matrix = NDArray[np.float64]


def face_frame(polyhedron: Polyhedron, face: int) -> Matrix:
    """Return `T_object_face` (4, 4): takes points of the face frame into the object frame."""
    loops = polyhedron.faces[face].loops
    x, y, z = face_axes(polyhedron.vertices, loops)
    T_object_face = np.eye(4)
    T_object_face[:3, :3] = np.column_stack([x, y, z])
    T_object_face[:3, 3] = polyhedron.vertices[loops[0][0]]
    return T_object_face


def face_polygon(polyhedron: Polyhedron, face: int) -> tuple[Matrix, ...]:
    """Return the loops of a face in its own frame: (k, 2) mm each, the outer one first."""
    loops = polyhedron.faces[face].loops
    x, y, _ = face_axes(polyhedron.vertices, loops)
    return flat_loops(polyhedron.vertices, loops, x, y)


def face_area(polyhedron: Polyhedron, face: int) -> float:
    """Return the area of a face without its holes, mm^2."""
    return sum(signed_area(loop) for loop in face_polygon(polyhedron, face))


def surface_areas(polyhedron: Polyhedron) -> dict[int, float]:
    """Return the areas (mm^2) of flat faces by number, of round ones (all facets) by carrier."""
    areas = {face: face_area(polyhedron, face) for face in range(len(polyhedron.faces))}
    for surface in polyhedron.surfaces:
        areas[surface.carrier] = sum(areas.pop(facet) for facet in surface.facets)
    return areas


def face_normal(polyhedron: Polyhedron, face: int) -> Matrix:
    """Return the outward unit normal of a face (3,), object frame: Newell's, over all corners."""
    normal = area_vector(polyhedron.vertices[list(polyhedron.faces[face].loops[0])])
    return normal / math.sqrt(float(normal @ normal))


def face_vectors(polyhedron: Polyhedron) -> Matrix:
    """Return the outward normal of each face times its area, (F, 3) mm^2, as `face_vector` sums."""
    vertices = polyhedron.vertices
    loops = ([vertices[list(loop)] for loop in face.loops] for face in polyhedron.faces)
    return np.array([face_vector(face) for face in loops])


def edge_length(polyhedron: Polyhedron, edge: int) -> float:
    """Return the length of an edge, mm."""
    link = polyhedron.edges[edge]
    return math.dist(polyhedron.vertices[link.start], polyhedron.vertices[link.end])


def dihedral(polyhedron: Polyhedron, edge: int) -> float:
    """Return the angle inside the solid between the faces of an edge, in (0, 2 pi).

    Below pi at a convex edge, above pi at a reflex one. By atan2, exact for nearly flat edges and
    knife edges, where acos fails.
    """
    link = polyhedron.edges[edge]
    left, right = face_normal(polyhedron, link.left), face_normal(polyhedron, link.right)
    along = polyhedron.vertices[link.end] - polyhedron.vertices[link.start]
    # Signed by the edge's direction: the turn of the surface across the edge is pi - angle.
    (a, b, c), (d, e, f) = left, right
    cross = np.array([b * f - c * e, c * d - a * f, a * e - b * d])
    sine = float(along @ cross) / math.sqrt(float(along @ along))
    angle = math.atan2(sine, -float(left @ right))
    return angle if angle > 0.0 else angle + 2.0 * math.pi


def volume(polyhedron: Polyhedron) -> float:
    """Return the volume, mm^3."""
    return signed_volume(polyhedron.vertices, [face.loops for face in polyhedron.faces])


def size(polyhedron: Polyhedron) -> float:
    """Return the diagonal of the bounding box, mm: the length that tolerances scale with."""
    return float(np.linalg.norm(np.ptp(polyhedron.vertices, axis=0)))
