"""Winged-edge polyhedra: vertices, planar faces with holes, edges with their links.

Face frame: origin at the face's first vertex, x along its first edge, z outward.
Lengths in mm, object frame. Vertices, faces and edges are numbered from 0; the names of
faces count from 1 (`F1`). Thesis 6.3, figures 6.14 to 6.16.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.errors import ShapeError
from generator.plane.polygon import signed_volume
from generator.polyhedron.check import (
    Loops,
    Surface,
    crossing_problems,
    directed_edges,
    edge_problems,
    face_problems,
    number_problems,
    raise_problems,
)
from generator.polyhedron.flatten import flatten_faces

LEAST_VOLUME = 1e-7  #: least volume of a solid, as a share of the cube of its size
NOTED_MOVE = 2e-7  #: vertices moved farther than this share of the size are reported

Loop = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Face:
    """A planar face: its outer loop first, then its holes."""

    name: str
    loops: tuple[
        Loop, ...
    ]  #: vertex numbers; outer counter-clockwise, holes clockwise, from outside


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
class Developable:
    """One round face of a polyhedron: a run of narrow planar facets, trapezoids or triangles.

    Unrolled about the lines between them the facets fill one polygon of the plane, and unrolling
    changes no length on any facet. The whole face has the name, the frame and the symbols of its
    first facet: the plane of that one is where all unroll to. The others are F2.2, F2.3, ...
    """

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


@dataclass(frozen=True, slots=True, eq=False)
class Polyhedron:
    """A closed, oriented solid with planar faces."""

    kind: str  #: cube, box, tetrahedron, ..., polyhedron, file
    vertices: NDArray[np.float64]  #: (V, 3) mm, object frame, read-only
    faces: tuple[Face, ...]
    edges: tuple[WingedEdge, ...]
    notes: tuple[str, ...] = ()  #: what was changed to make the solid, for the person to read
    surfaces: tuple[Developable, ...] = ()  #: round faces, each a run of `faces`
    #: faces without symbols: they stand for a surface that does not unroll, or are held or bored
    blank: tuple[int, ...] = ()

    @property
    def euler_characteristic(self) -> int:
        """V - E + F - (loops - faces)."""
        loops = sum(len(face.loops) for face in self.faces)
        return len(self.vertices) - len(self.edges) + 2 * len(self.faces) - loops

    @property
    def genus(self) -> int:
        """Number of through holes: 0 for a cube, 1 for a frame."""
        return 1 - self.euler_characteristic // 2


def developable_from(definition: dict[str, Any]) -> Developable:
    """Return the face that `Developable.definition` describes."""
    return Developable(**{**definition, "facets": tuple(definition["facets"])})


FaceLike = Face | Sequence[int] | Sequence[Sequence[int]]


def polyhedron(kind: str, vertices: ArrayLike, faces: Sequence[FaceLike]) -> Polyhedron:
    """Build a winged-edge polyhedron and prove that it is a solid.

    `kind` says where it comes from: `cube`, ..., `polyhedron`, `file`. Vertices (V, 3) mm, object
    frame, are copied. A face is a loop of vertex numbers (from 0), a list of loops (the outer one
    first, then holes), or a `Face`; counter-clockwise seen from outside, holes clockwise. Faces
    without a name are called F1, F2, ...

    A solid given inside out is turned, and vertices that lie off their faces' planes by a rounding
    are moved onto them; `notes` says so. Raises `ShapeError` with everything that is wrong, face by
    face (`check`).

    >>> corner = [(0, 0, 0), (30, 0, 0), (0, 30, 0), (0, 0, 30)]
    >>> solid = polyhedron("polyhedron", corner, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
    >>> len(solid.edges), solid.euler_characteristic, solid.faces[2].name
    (6, 2, 'F3')
    """
    points = _points(vertices)
    named = [_face(number, face) for number, face in enumerate(faces, start=1)]
    surface = Surface(points, tuple(f.name for f in named), tuple(f.loops for f in named))
    raise_problems(number_problems(surface))
    raise_problems(face_problems(surface) + edge_problems(surface))

    notes = []
    volume = signed_volume(points, surface.faces)
    if abs(volume) <= LEAST_VOLUME * surface.size**3:
        raise ShapeError(
            f"the solid is flat: its volume is {abs(volume):.2g} mm^3",
            fix="give it a thickness",
        )
    loops_of = surface.faces
    if volume < 0:
        loops_of = tuple(
            tuple((loop[0], *loop[:0:-1]) for loop in loops) for loops in surface.faces
        )
        notes.append("all faces pointed inward and were turned outward")
    points, moved = flatten_faces(points, loops_of)
    if moved > NOTED_MOVE * surface.size:
        notes.append(f"vertices were moved by up to {moved:.2g} mm to make every face planar")
    raise_problems(crossing_problems(Surface(points, surface.names, loops_of)))

    points.flags.writeable = False
    out = tuple(Face(name, loops) for name, loops in zip(surface.names, loops_of, strict=True))
    return Polyhedron(kind, points, out, winged_edges(loops_of), tuple(notes))


def winged_edges(faces: Sequence[Loops]) -> tuple[WingedEdge, ...]:
    """Return the edges of a closed surface with all their links, as they are met, face by face.

    An edge's left face is the one that meets it first.
    """
    number: dict[tuple[int, int], int] = {}  # directed edge -> edge
    face_of: dict[tuple[int, int], int] = {}
    previous: dict[tuple[int, int], tuple[int, int]] = {}
    following: dict[tuple[int, int], tuple[int, int]] = {}
    order: list[tuple[int, int]] = []
    for face, loops in enumerate(faces):
        for loop in loops:
            run = list(directed_edges([loop]))
            for before, edge, after in zip([run[-1], *run], run, [*run[1:], run[0]], strict=False):
                previous[edge], following[edge], face_of[edge] = before, after, face
                if edge not in number:
                    number[edge] = number[edge[::-1]] = len(order)
                    order.append(edge)
    return tuple(
        WingedEdge(
            start=edge[0],
            end=edge[1],
            left=face_of[edge],
            right=face_of[edge[::-1]],
            left_previous=number[previous[edge]],
            left_next=number[following[edge]],
            right_previous=number[previous[edge[::-1]]],
            right_next=number[following[edge[::-1]]],
        )
        for edge in order
    )


def _points(vertices: ArrayLike) -> NDArray[np.float64]:
    fix = "give each vertex as three lengths [x, y, z]"
    try:
        points = np.array(vertices, dtype=np.float64)
    except (TypeError, ValueError):
        raise ShapeError("the vertices are not all triples of numbers", fix=fix) from None
    if points.ndim != 2 or points.shape[1] != 3:
        shape = " x ".join(map(str, points.shape))
        raise ShapeError(f"the vertices form an array of {shape}, not n x 3", fix=fix)
    return points


def _face(number: int, face: FaceLike) -> Face:
    if isinstance(face, Face):
        return face
    name = f"F{number}"
    try:
        entries: list[Any] = list(face)
        nested = bool(entries) and not any(isinstance(entry, int | np.integer) for entry in entries)
        loops = entries if nested else [entries]
        return Face(name, tuple(tuple(_index(v) for v in loop) for loop in loops))
    except TypeError:
        raise ShapeError(
            f"a face is a list of vertex numbers, not {face!r}",
            fix="write it as [0, 1, 2], and with a hole as [[0, 1, 2], [3, 4, 5]]",
            place=f"face {name}",
        ) from None


def _index(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError
    return int(value)
