"""Polyhedra to be encoded: named shapes, vertices and faces, files; as winged-edge models.

Thesis 6.3, figures 6.14 to 6.16.
"""

from generator.polyhedron.frame import (
    dihedral,
    edge_length,
    face_area,
    face_frame,
    face_normal,
    face_polygon,
    point_in_face,
    side_of_face,
    surface_area,
    volume,
)
from generator.polyhedron.shapes import SHAPES, thesis_name, vertex_names
from generator.polyhedron.winged import Face, Loop, Polyhedron, WingedEdge, polyhedron

__all__ = [
    "SHAPES",
    "Face",
    "Loop",
    "Polyhedron",
    "WingedEdge",
    "dihedral",
    "edge_length",
    "face_area",
    "face_frame",
    "face_normal",
    "face_polygon",
    "point_in_face",
    "polyhedron",
    "side_of_face",
    "surface_area",
    "thesis_name",
    "vertex_names",
    "volume",
]
