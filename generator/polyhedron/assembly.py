"""In which order the faces of a polyhedron are put together, edge by edge.

The largest face lies on the table; then always the face that meets most of those that are there,
the longer edges first, so that every panel is held by its neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generator.polyhedron.frame import face_area, face_normal
from generator.polyhedron.winged import Polyhedron


@dataclass(frozen=True, slots=True)
class AssemblyStep:
    """A face, and the edges by which it meets those that are there."""

    face: int
    edges: tuple[int, ...]


def assembly_order(polyhedron: Polyhedron) -> tuple[AssemblyStep, ...]:
    """Return all faces in order; the first has no edges."""
    vertices = polyhedron.vertices
    lengths = [float(np.linalg.norm(vertices[e.end] - vertices[e.start])) for e in polyhedron.edges]
    areas = [face_area(polyhedron, face) for face in range(len(polyhedron.faces))]
    first = max(range(len(areas)), key=lambda face: (round(areas[face], 6), -face))
    steps = [AssemblyStep(first, ())]
    there = {first}
    while len(there) < len(areas):
        meeting: dict[int, list[int]] = {}
        for number, edge in enumerate(polyhedron.edges):
            for one, other in ((edge.left, edge.right), (edge.right, edge.left)):
                if one in there and other not in there:
                    meeting.setdefault(other, []).append(number)
        if not meeting:  # a solid inside another one's hollow
            rest = min(set(range(len(areas))) - there)
            meeting[rest] = []
        face, edges = max(
            meeting.items(),
            key=lambda item: (len(item[1]), round(sum(lengths[e] for e in item[1]), 6), -item[0]),
        )
        steps.append(AssemblyStep(face, tuple(edges)))
        there.add(face)
    return tuple(steps)


def distinct_faces(polyhedron: Polyhedron, faces: list[int]) -> tuple[int, ...]:
    """Return up to three of `faces` that look in different directions, the largest first."""
    normals = {face: face_normal(polyhedron, face) for face in faces}
    chosen: list[int] = []
    for face in sorted(faces, key=lambda f: (-round(face_area(polyhedron, f), 6), f)):
        if all(abs(float(normals[face] @ normals[other])) < 0.95 for other in chosen):
            chosen.append(face)
    rest = [face for face in faces if face not in chosen]
    return tuple((chosen + rest)[:3])
