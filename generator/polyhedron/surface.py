"""Faces before they are a solid, and how what is wrong with them is said.

Vertices (V, 3) mm and faces as tuples of loops (outer counter-clockwise seen from outside,
holes clockwise). Every tolerance is a share of the size. Thesis 6.3.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.plane.polygon import area_vector, plane_axes

Loops = tuple[tuple[int, ...], ...]
Vertices = NDArray[np.float64]

LISTED = 8  #: problems spelled out in one message


@dataclass(frozen=True, slots=True)
class FaceProblem:
    """One thing that is wrong, where, and what to do about it."""

    place: str  #: name of a face, or "" for the solid as a whole
    cause: str
    fix: str

    def __str__(self) -> str:
        head = f"face {self.place}: " if self.place else ""
        return f"{head}{self.cause}; {self.fix}"


@dataclass(frozen=True, slots=True)
class Surface:
    """Faces to be checked: their names, and their loops of vertex numbers."""

    vertices: Vertices  #: (V, 3) mm
    names: tuple[str, ...]
    faces: tuple[Loops, ...]

    @property
    def size(self) -> float:
        """Diagonal of the bounding box, mm."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    def vertex(self, number: int) -> str:
        """Return how a message calls a vertex: its number, from 0, and its coordinates."""
        x, y, z = self.vertices[number]
        return f"vertex {number} ({x:.6g}, {y:.6g}, {z:.6g})"


def raise_problems(problems: Sequence[FaceProblem]) -> None:
    """Raise one `ShapeError` that holds all problems; nothing if there are none."""
    if not problems:
        return
    if len(problems) == 1:
        (one,) = problems
        raise ShapeError(one.cause, fix=one.fix, place=f"face {one.place}" if one.place else "")
    lines = [f"\n  {problem}" for problem in problems[:LISTED]]
    if len(problems) > LISTED:
        lines.append(f"\n  and {len(problems) - LISTED} more")
    raise ShapeError(
        f"the polyhedron has {len(problems)} problems:" + "".join(lines),
        fix="correct them and try again",
    )


def directed_edges(loops: Iterable[Sequence[int]]) -> Iterable[tuple[int, int]]:
    """Yield the edges (start, end) of all loops of a face, in order."""
    for loop in loops:
        yield from zip(loop, (*loop[1:], loop[0]), strict=True)


def face_axes(vertices: Vertices, loops: Loops) -> tuple[Vertices, Vertices, Vertices]:
    """Return the unit axes of a face's frame: x along its first edge, z its Newell normal."""
    outer = vertices[list(loops[0])]
    return plane_axes(area_vector(outer), outer[1] - outer[0])


def euler_characteristic(vertices: int, edges: int, faces: Sequence[Loops]) -> int:
    """Return V - E + F - (loops - faces): 2 (shells - genus) of a closed solid."""
    return vertices - edges + 2 * len(faces) - sum(map(len, faces))
