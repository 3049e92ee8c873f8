"""What a sensor meets besides the face that it rests on: walls, bores, steps.

Polyhedron + frame of a face + poses of a sensor in its plane -> the area that other faces have
inside the sensor's rectangle, seen along the face's normal, and their names. A sensor comes down
along the normal and is as high as whatever stands there (a hand or an arm holds it), so what
matters is the shadow of all that rises over the face: exactly what the simulated touch meets.
Only faces that look up cast it, since the solid is closed. mm.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.layout.footprint import Points
from generator.polyhedron.frame import face_vectors
from generator.polyhedron.winged import Polyhedron

Box = tuple[Points, Points]  #: lowest and highest x and y, mm

UPRIGHT = 1e-9  #: cosine to the normal up to which a face has no shadow
NAMED = 200  #: places for which it is said which face is met


@dataclass(frozen=True, slots=True, eq=False)
class SolidEdges:
    """The edges of all faces of a solid, a face's in a row; object frame."""

    starts: Points  #: (e, 3) mm
    ends: Points  #: (e, 3) mm
    first: NDArray[np.int64]  #: (faces,) number of each face's first edge
    normals: Points  #: (faces, 3)
    names: tuple[str, ...]  #: as people count faces: all facets of a round face have one

    @property
    def owner(self) -> NDArray[np.int64]:
        """The face of each edge, (e,)."""
        sizes = np.diff(np.append(self.first, len(self.starts)))
        return np.repeat(np.arange(len(self.first)), sizes)

    def rise_mm(self, T_object_plane: Points) -> float:
        """Return how high the solid rises over a plane; of a convex one over a face it is 0."""
        return float(((self.starts - T_object_plane[:3, 3]) @ T_object_plane[:3, 2]).max())

    def above(
        self, T_object_plane: Points, height_mm: float, box: Box
    ) -> tuple[Points, Points, NDArray[np.int64]]:
        """Return starts, ends (k, 2) and faces (k,) of what rises higher over a plane, from above.

        `box`: lowest and highest x and y of what is looked at. Faces that are cut in two keep a
        closed outline: what is lower is moved onto the line where the face has that height.
        """
        R = T_object_plane[:3, :3]
        normals, owner = self.normals @ R, self.owner
        a, b = ((points - T_object_plane[:3, 3]) @ R for points in (self.starts, self.ends))
        kept = self._rising(a, height_mm, box) & (normals[:, 2] > UPRIGHT)
        of = owner[kept[owner]]
        a, b = a[kept[owner]], b[kept[owner]]
        slope = -normals[of, :2] / normals[of, 2:]
        slope /= np.maximum((slope**2).sum(axis=1, keepdims=True), np.finfo(float).tiny)
        (low, start), (under, end) = (
            (height_mm - p[:, 2], p[:, :2] + np.maximum(height_mm - p[:, 2:], 0.0) * slope)
            for p in (a, b)
        )
        crosses = (low * under < 0)[:, None]
        share = (low / np.where(low == under, 1.0, low - under))[:, None]
        middle = np.where(crosses, a[:, :2] + share * (b - a)[:, :2], start)
        return np.concatenate([start, middle]), np.concatenate([middle, end]), np.r_[of, of]

    def _rising(self, points: Points, height_mm: float, box: Box) -> NDArray[np.bool_]:
        """Return which faces reach higher and into the box, (faces,)."""
        high = np.maximum.reduceat(points, self.first)
        low = np.minimum.reduceat(points[:, :2], self.first)
        inside = (low < box[1]).all(axis=1) & (high[:, :2] > box[0]).all(axis=1)
        found: NDArray[np.bool_] = inside & (high[:, 2] > height_mm)
        return found

    def nearest(
        self, T_object_plane: Points, height_mm: float, box: Box, places_mm: Points
    ) -> Counter[str]:
        """Return how many places (n, 2) of a plane have each face nearest that rises higher.

        Of two that are as near, a wall and its top, the one that reaches down farther.
        """
        R = T_object_plane[:3, :3]
        a, b = ((points - T_object_plane[:3, 3]) @ R for points in (self.starts, self.ends))
        lowest, owner = np.minimum.reduceat(a[:, 2], self.first), self.owner
        upright = self._rising(a, height_mm, box) & ((self.normals @ R)[:, 2] <= UPRIGHT)
        walls = np.flatnonzero(upright[owner] & (np.maximum(a, b)[:, 2] > height_mm))
        a, b = a[walls], b[walls]
        rise = np.where(a[:, 2] == b[:, 2], 1.0, b[:, 2] - a[:, 2])
        level = ((height_mm - a[:, 2]) / rise)[:, None]
        first = np.where(a[:, 2:] < height_mm, level, 0.0)
        last = np.where(b[:, 2:] < height_mm, level, 1.0)
        starts, ends, of = self.above(T_object_plane, height_mm, box)
        starts = np.concatenate([starts, (a + first * (b - a))[:, :2]])
        ends, of = np.concatenate([ends, (a + last * (b - a))[:, :2]]), np.r_[of, owner[walls]]
        order = np.argsort(lowest[of], kind="stable")
        start, along, of = starts[order], (ends - starts)[order], of[order]
        square = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
        found: Counter[str] = Counter()
        for place in places_mm[:NAMED]:
            away = place - start
            share = np.clip((away * along).sum(axis=1) / square, 0.0, 1.0)
            gap = np.hypot(*(away - share[:, None] * along).T)
            found[self.names[of[np.argmin(gap.round(6))]]] += 1
        return found


def solid_edges(polyhedron: Polyhedron) -> SolidEdges:
    """Return the edges of a solid, face by face."""
    rings = [polyhedron.vertices[list(loop)] for face in polyhedron.faces for loop in face.loops]
    vectors = face_vectors(polyhedron)
    sizes = [sum(map(len, face.loops)) for face in polyhedron.faces]
    return SolidEdges(
        np.concatenate(rings),
        np.concatenate([np.roll(ring, -1, axis=0) for ring in rings]),
        np.cumsum([0, *sizes[:-1]]),
        vectors / np.linalg.norm(vectors, axis=1, keepdims=True),
        tuple(face.name.partition(".")[0] for face in polyhedron.faces),
    )
