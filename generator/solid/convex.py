"""Cut a closed body into convex pieces that fill it, for simulators whose bodies are convex.

A piece that is not convex is cut by a plane through its deepest reflex edge: along one of the
two faces there, or between them, whichever leaves the pieces nearest to their hulls.
B. Chazelle, "Convex partitions of polyhedra", 1984: cuts at reflex edges.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from itertools import count

import numpy as np
from manifold3d import Error, Manifold, Mesh64
from numpy.typing import NDArray

from generator.errors import SolidError

Points = NDArray[np.float64]
Index = NDArray[np.int64]
Plane = tuple[Points, float]  #: unit normal (3,), offset (mm)
_Entry = tuple[float, int, list[Plane], Manifold]  #: less its depth, number, cuts, piece

#: A hull may stand out of its piece by so much: what a filament printer rounds off.
DEPTH_MM = 0.1
_MOST = 128  # pieces, after which nothing is cut: simulators slow down with each
_THIN_MM = 0.02  # a thinner piece is left out: no simulator feels it
_FLAT = 1e-6  # of the body's size: less is rounding
_DIGITS = 5  # of mm: a hull of points that are almost in a plane may turn triangles inside out
_APART = 1e-3  # of that: how far pieces are cut apart


@dataclass(frozen=True, slots=True, eq=False)
class ConvexPieces:
    """Convex bodies that together fill one that is not."""

    pieces: tuple[tuple[Points, Index], ...]  #: corners (n, 3) mm, triangles (m, 3) outward
    depth_mm: float  #: how far one of them stands out of the body, at most


def convex_pieces(vertices: Points, triangles: Index, upon: Points | None = None) -> ConvexPieces:
    """Return the convex pieces of a closed mesh, the largest first.

    `upon` (n, 3) mm are points of what stands on it: every piece reaches to those that are nearer
    to it than to the others. Raises `SolidError` if the triangles close no body.
    """
    body = Manifold(Mesh64(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles)))
    if body.status() != Error.NoError or body.is_empty():
        raise SolidError(
            f"the triangles close no body ({body.status().name})",
            fix="report the spec together with this message",
        )
    flat = _FLAT * float(np.ptp(vertices, axis=0).max())
    number = count()  # of equal depths the first found is cut first

    def entry(piece: Manifold) -> _Entry:
        depth, planes = _deepest(piece, flat)
        return -depth, next(number), planes, piece

    waiting = [entry(piece) for piece in body.decompose()]
    heapq.heapify(waiting)
    while waiting[0][0] < -DEPTH_MM and len(waiting) < _MOST:
        halves = _best_cut(waiting[0][3], waiting[0][2], _APART * flat)
        if len(halves) < 2:
            break
        heapq.heapreplace(waiting, entry(halves[0]))
        for half in halves[1:]:
            heapq.heappush(waiting, entry(half))
    hulls = sorted((piece.hull() for *_, piece in waiting), key=_order)
    hulls = [hull for hull in hulls if _thickness(hull) > _THIN_MM] or hulls[:1]
    if upon is not None:
        heights = np.stack([_heights(hull, upon) for hull in hulls])
        nearest, outside = heights.argmin(axis=0), heights.min(axis=0) > 0
        reach = [np.concatenate([_mesh(hull)[0], upon[outside & (nearest == number)]])
                 for number, hull in enumerate(hulls)]  # fmt: skip
        hulls = [Manifold.hull_points(points.round(_DIGITS)) for points in reach]
    return ConvexPieces(tuple(map(_mesh, hulls)), -waiting[0][0])


def _deepest(piece: Manifold, flat: float) -> tuple[float, list[Plane]]:
    """Return the depth of the deepest reflex edge in the hull, and planes through it."""
    corners, triangles = _mesh(piece)
    tri = corners[triangles]
    normals = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    one, other, start, end = _edges(triangles)
    opposite = triangles[other].sum(axis=1) - start - end
    above = np.einsum("ij,ij->i", corners[opposite] - corners[start], normals[one])
    reflex = np.flatnonzero((above > flat) & (lengths[one, 0] > 0) & (lengths[other, 0] > 0))
    if not len(reflex):
        return 0.0, []
    outward, offsets = _sides(piece.hull())
    middles = (corners[start[reflex]] + corners[end[reflex]]) / 2
    depths = (offsets - middles @ outward.T).min(axis=1)
    best = reflex[int(np.argmax(depths))]
    at, along = corners[start[best]], corners[end[best]] - corners[start[best]]
    first, second = normals[one[best]], normals[other[best]]
    between = np.cross(along, first + second)
    found = [first, second]
    if np.linalg.norm(between) > 0:
        found.append(between / np.linalg.norm(between))
    return max(0.0, float(depths.max())), [(normal, float(normal @ at)) for normal in found]


def _best_cut(piece: Manifold, planes: list[Plane], apart: float) -> list[Manifold]:
    """Return the pieces along the plane that leaves them nearest to their hulls."""
    cuts = []
    for normal, offset in planes:
        halves = [
            part
            for side in (1, -1)  # a membrane left in the plane would hold two pieces together
            for half in [
                piece.trim_by_plane(tuple((side * normal).tolist()), side * offset + apart)
            ]
            for part in half.decompose()
            if part.volume() > 0
        ]
        excess = sum(half.hull().volume() - half.volume() for half in halves)
        cuts.append((len(halves) < 2, round(excess, 2), len(halves), halves))
    return min(cuts, key=lambda cut: cut[:3])[3]


def _sides(hull: Manifold) -> tuple[Points, Points]:
    """Return outward normals (n, 3) and offsets (n,) of the triangles of a convex body."""
    corners, triangles = _mesh(hull)
    sides = corners[triangles]
    normals = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    size = np.linalg.norm(normals, axis=1)
    normals = normals[size > 0] / size[size > 0, None]
    return normals, np.einsum("ij,ij->i", normals, sides[size > 0, 0])


def _heights(hull: Manifold, points: Points) -> Points:
    """Return how far points (n, 3) stand out of a convex body, beyond its farthest plane; (n,)."""
    normals, offsets = _sides(hull)
    highest = np.full(len(points), -np.inf)
    for normal, offset in zip(normals, offsets, strict=True):
        np.maximum(highest, points @ normal - offset, out=highest)
    return highest


def _thickness(hull: Manifold) -> float:
    """Return the least distance of two parallel planes that hold a convex body, one in a face."""
    normals, offsets = _sides(hull)
    corners, _ = _mesh(hull)
    return float((offsets - corners @ normals.T).max(axis=0).min()) if len(normals) else 0.0


def _edges(triangles: Index) -> tuple[Index, Index, Index, Index]:
    """Return for each edge its two triangles, its start and its end in the first one."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    owner = np.repeat(np.arange(len(triangles)), 3)
    forward = np.lexsort([end, start])
    backward = np.lexsort([start, end])
    chosen = start[forward] < end[forward]
    return (
        owner[forward][chosen], owner[backward][chosen], start[forward][chosen],
        end[forward][chosen],
    )  # fmt: skip


def _mesh(body: Manifold) -> tuple[Points, Index]:
    mesh = body.to_mesh64()
    return (
        np.asarray(mesh.vert_properties, np.float64)[:, :3],
        np.asarray(mesh.tri_verts, np.int64),
    )


def _order(hull: Manifold) -> tuple[float, ...]:
    """Return what sorts pieces: the largest first, then by place."""
    return (-round(hull.volume(), 3), *(round(value, 3) for value in hull.bounding_box()))
