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
    surface_areas,
    volume,
)
from generator.polyhedron.shapes import SHAPES
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
    "polyhedron",
    "surface_areas",
    "volume",
]
