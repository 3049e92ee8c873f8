"""Unroll a round face: facets of a polyhedron -> one polygon of the plane, and back.

The plane is the face frame of the face's first facet (origin at its first vertex, x along its
first edge, z outward), so its x runs around the round face and its y up. Facet i is taken to
where it is by one rigid transform; two neighbours share a straight line, in the plane as on
the solid. Lengths in mm. Thesis 6.3 (unfolding).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.polyhedron.frame import face_frame
from generator.polyhedron.winged import Developable, Polyhedron

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Development:
    """A round face of n facets in the plane."""

    T_object_flat: Points  #: (n, 4, 4) takes the plane to each facet, z outward
    low: Points  #: (n + 1, 2) lower ends of the lines between facets; the first and last: its sides
    high: Points  #: (n + 1, 2) upper ends; at the tip of a cone they are one point
    bends: Points  #: (n + 1, 3) from a line to the same line one mm above the surface, object frame
    vertices: NDArray[np.int64]  #: (n + 1, 2) of the polyhedron: lower and upper end of each line

    @property
    def outline(self) -> Points:
        """The polygon, (k, 2), counter-clockwise: below to the right, above back to the left."""
        pointed = (self.vertices[0, 1] == self.vertices[:, 1]).all()
        top = self.high[:1] if pointed else self.high[::-1]
        return np.concatenate([self.low, top])

    def facets_of(self, points: Points) -> NDArray[np.int64]:
        """Return the facet (n,) on which each of the points (n, 2) of the plane lies, or nearly."""
        corners = (self.low[:-1], self.low[1:], self.high[1:], self.high[:-1])
        inside = np.full((len(points), len(self.low) - 1), np.inf)
        for a, b in zip(corners, (*corners[1:], corners[0]), strict=True):
            left = np.outer(points[:, 1], (b - a)[:, 0]) - np.outer(points[:, 0], (b - a)[:, 1])
            inside = np.minimum(inside, left + a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        found: NDArray[np.int64] = inside.argmax(axis=1)
        return found

    def outline_edges(self) -> list[tuple[int, int]]:
        """Return the polyhedron's vertices at both ends of every edge of the outline."""
        low, high = self.vertices[:, 0].tolist(), self.vertices[:, 1].tolist()
        loop = low + (high[:1] if len(set(high)) == 1 else high[::-1])
        return list(zip(loop, loop[1:] + loop[:1], strict=True))


def development(polyhedron: Polyhedron, surface: Developable) -> Development:
    """Unroll a round face, mm.

    Its facets are loops (lower left, lower right, upper right, upper left) seen from outside, or
    triangles (lower left, lower right, tip).
    """
    loops = [polyhedron.faces[facet].loops[0] for facet in surface.facets]
    frames = [face_frame(polyhedron, facet) for facet in surface.facets]
    flat, low, high = [frames[0]], [], []
    for number, (loop, frame) in enumerate(zip(loops, frames, strict=True)):
        own = (polyhedron.vertices[list(loop)] - frame[:3, 3]) @ frame[:3, :2]
        if number == 0:
            turn, shift = np.eye(2), np.zeros(2)
            low, high = [own[0]], [own[-1]]
        else:
            # The line on the left is where the facet before has its line on the right.
            turn = _rotation_between(own[-1] - own[0], high[-1] - low[-1])
            shift = low[-1] - turn @ own[0]
            T_flat_own = np.eye(4)
            T_flat_own[:2, :2], T_flat_own[:2, 3] = turn, shift
            flat.append(frame @ np.linalg.inv(T_flat_own))
        low.append(turn @ own[1] + shift)
        high.append(turn @ own[2] + shift)
    ends = [(loop[0], loop[-1]) for loop in loops] + [(loops[-1][1], loops[-1][2])]
    normals = np.array([frame[:3, 2] for frame in frames])
    return Development(
        np.array(flat), np.array(low), np.array(high), _bends(normals, surface.closed),
        np.array(ends, dtype=np.int64),
    )  # fmt: skip


def _bends(normals: Points, closed: bool) -> Points:
    """Return where the lines between facets go when all facets rise by one mm."""
    before = np.concatenate([normals[-1:] if closed else normals[:1], normals])
    after = np.concatenate([normals, normals[:1] if closed else normals[-1:]])
    cosine = (before * after).sum(axis=1, keepdims=True)
    bends: Points = (before + after) / (1.0 + cosine)
    return bends


def _rotation_between(of: Points, to: Points) -> Points:
    cosine, sine = float(of @ to), float(of[0] * to[1] - of[1] * to[0])
    length = float(np.hypot(cosine, sine))
    return np.array([[cosine, -sine], [sine, cosine]]) / length
