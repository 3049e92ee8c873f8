"""What stands close in front of a face: the walls of a slot, an overhang, a lid.

Polyhedron (mm) -> for each face the parts of it, in its own frame, over which the solid begins
again within a given distance. Symbols there would cut into what stands in front of them, and
no sensor would reach them. A neighbour across an edge does not count: what it needs is a
clearance from that edge.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection

import numpy as np
from manifold3d import CrossSection, FillRule, OpType
from numpy.typing import NDArray

from generator.polyhedron.frame import face_area, face_frame, face_normal, face_polygon, size
from generator.polyhedron.winged import Polyhedron

TOUCHING = 1e-6  #: nearer than this share of the size, nothing is in front of a face
FACING = -0.01  #: greatest cosine between faces that look at each other: not those at right angles
NEGLIGIBLE = 1e-6  #: share of a face's area below which it is not covered

Loop = NDArray[np.float64]  #: (k, 2) mm


def covered_parts(
    polyhedron: Polyhedron, faces: Collection[int], distance_mm: float
) -> dict[int, tuple[Loop, ...]]:
    """Return the parts of faces in front of which, along the normal, the solid is nearer than this.

    Face -> loops in its frame, mm, that run as holes do; faces without such parts are left out.
    """
    start = np.cumsum([0] + [sum(map(len, face.loops)) for face in polyhedron.faces])[:-1]
    corner = np.concatenate([loop for face in polyhedron.faces for loop in face.loops])
    normals = np.array([face_normal(polyhedron, k) for k in range(len(polyhedron.faces))])
    neighbours: dict[int, set[int]] = defaultdict(set)
    for edge in polyhedron.edges:
        neighbours[edge.left].add(edge.right)
        neighbours[edge.right].add(edge.left)
    touching = TOUCHING * size(polyhedron)
    found = {}
    for face in faces:
        T_object_face = face_frame(polyhedron, face)
        local = (polyhedron.vertices - T_object_face[:3, 3]) @ T_object_face[:3, :3]
        if local[:, 2].max() <= touching:
            continue  # nothing at all is in front
        low = np.minimum.reduceat(local[corner], start)
        high = np.maximum.reduceat(local[corner], start)
        outline = face_polygon(polyhedron, face)
        near = (high[:, 2] > touching) & (low[:, 2] < distance_mm)
        near &= (normals @ T_object_face[:3, 2] < FACING) & (
            (low[:, :2] < outline[0].max(axis=0)) & (high[:, :2] > outline[0].min(axis=0))
        ).all(axis=1)
        near[[face, *neighbours[face]]] = False
        over = [
            _slice(local, polyhedron.faces[other].loops, touching, distance_mm)
            for other in np.flatnonzero(near).tolist()
        ]
        if over:
            parts = CrossSection.batch_boolean(over, OpType.Add)
            parts = parts ^ CrossSection(list(outline), FillRule.EvenOdd)
            if parts.area() > NEGLIGIBLE * face_area(polyhedron, face):
                found[face] = tuple(np.asarray(loop)[::-1].copy() for loop in parts.to_polygons())
    return found


def _slice(
    local: NDArray[np.float64],
    loops: tuple[tuple[int, ...], ...],
    low: float,
    high: float,
) -> CrossSection:
    """Return what a face between two heights covers, seen along z."""
    kept = []
    for loop in loops:
        points = _clip_loop(_clip_loop(local[list(loop)], low, 1.0), high, -1.0)
        if len(points) >= 3:
            kept.append(points[:, :2])
    return CrossSection(kept, FillRule.EvenOdd)


def _clip_loop(points: NDArray[np.float64], height: float, sign: float) -> NDArray[np.float64]:
    """Return the part of a loop (k, 3) above a height, or below it where the sign is -1."""
    over = sign * (points[:, 2] - height)
    kept: list[NDArray[np.float64]] = []
    for k in range(len(points)):
        if (over[k - 1] < 0.0) != (over[k] < 0.0):
            share = over[k - 1] / (over[k - 1] - over[k])
            kept.append(points[k - 1] + share * (points[k] - points[k - 1]))
        if over[k] >= 0.0:
            kept.append(points[k])
    return np.array(kept).reshape(-1, 3)
