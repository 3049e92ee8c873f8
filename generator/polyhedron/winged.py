"""Winged-edge polyhedra: vertices, planar faces with holes, edges with their links.

Face frame: origin at the face's first vertex, x along its first edge, z outward.
Lengths in mm, object frame. Thesis 6.3, figures 6.14 to 6.16.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Loop = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Face:
    """A planar face: its outer loop first, then its holes."""

    name: str
    loops: tuple[Loop, ...]  #: vertex numbers; outer counter-clockwise, holes clockwise, from outside


@dataclass(frozen=True, slots=True)
class WingedEdge:
    """An edge from `start` to `end` with the two faces it separates and its four neighbours.

    The left face holds the edge in the direction start -> end, the right one reversed.
    """

    start: int  #: vertex
    end: int  #: vertex
    left: int  #: face
    right: int  #: face
    left_previous: int  #: edge before this one around the left face
    left_next: int  #: edge after this one around the left face
    right_previous: int  #: edge before this one around the right face
    right_next: int  #: edge after this one around the right face


@dataclass(frozen=True, slots=True)
class Polyhedron:
    """A closed, oriented solid with planar faces."""

    kind: str  #: cube, box, tetrahedron, ..., polyhedron, file
    vertices: NDArray[np.float64]  #: (V, 3) mm, object frame, read-only
    faces: tuple[Face, ...]
    edges: tuple[WingedEdge, ...]
