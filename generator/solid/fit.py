"""Cut panels until no two come nearer than the gap, wherever they meet in the finished object.

Mitres part the panels of faces with a common edge. Faces that share only a corner, or that
come near each other behind a small face, are parted here: both panels are cut by the plane
that bisects the angle between the faces, half the gap from it. A plane is moved back a
little where it would leave a facet too narrow to print. Lengths in mm, object frame unless said.

A plain body is cut by exact clipping of its facets, without a boolean (Sutherland and Hodgman,
Reentrant polygon clipping, Communications of the ACM 17, 1974). Every edge between a vertex that
stays and one that goes is cut once, so that neighbours keep common corners; the pieces of a facet
are joined along the plane, so that it may be non-convex. Vertices that go need not be all that
lie beyond the plane: one connected piece of them is cut off alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from manifold3d import Manifold, Mesh64
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.plane.polygon import area_vector, face_vector, signed_volume
from generator.polyhedron.check import directed_edges
from generator.polyhedron.frame import face_normal
from generator.polyhedron.winged import Polyhedron
from generator.solid.part import Facet, Part, transform
from generator.solid.triangulate import triangles

Points = NDArray[np.float64]
Loop = tuple[int, ...]

_ROUNDING_MM = 1e-6  # a gap smaller by less is kept; 64-bit coordinates round far below
_PARALLEL = 1e-6  # faces whose unit normals differ by less have no bisecting plane
_EDGE_MM = 0.05  # a cut that leaves a shorter edge, which no printer makes, is moved back
_STEP_MM = 0.02  # by which a cut is moved back at a time
_STEPS = 12  # tries at that; then the one with the longest shortest edge is taken


def cut_off(
    body: Part, normal: Points, offset_mm: float, goes: NDArray[np.bool_], name: str
) -> Part | None:
    """Return the body without the vertices that go, closed in the plane normal . x = offset.

    `goes` (V,) bool: vertices beyond the plane, each with all its neighbours beyond it. New facets
    are called `name`. None where a facet or the body would fall apart.
    """
    cuts = _Cuts(body, body.vertices @ normal - offset_mm, goes)
    facets: list[Facet] = []
    for facet in body.facets:
        loops = cuts.clip_facet(facet.loops, normal)
        if loops is None:
            return None
        if loops:
            facets.append(Facet(facet.name, loops))
    vertices = cuts.all_points()
    lids = cuts.lids()
    if any(area_vector(vertices[list(lid)]) @ normal <= 0 for lid in lids):
        return None  # a lid with a hole: not a panel
    facets += [Facet(name, (lid,)) for lid in lids]
    if not facets or not _connected(facets):
        return None
    used = np.unique(np.concatenate([loop for facet in facets for loop in facet.loops]))
    number = {old: new for new, old in enumerate(used.tolist())}
    kept = tuple(
        Facet(f.name, tuple(tuple(number[v] for v in loop) for loop in f.loops)) for f in facets
    )
    return replace(body, vertices=vertices[used], facets=kept)


def beyond(body: Part, normal: Points, offset_mm: float) -> list[NDArray[np.bool_]]:
    """Return what lies beyond a plane, one mask (V,) for each connected piece of the surface."""
    height = body.vertices @ normal - offset_mm
    over = height > 0
    if not over.any():
        return []
    joined = [edge for edge in _edges(body.facets) if over[edge[0]] and over[edge[1]]]
    for facet in body.facets:
        joined += _joined_across(body.vertices, facet.loops, normal, height)
    edges = np.array([*joined, *((b, a) for a, b in joined)]).reshape(-1, 2).astype(np.int64)
    piece = np.where(over, np.arange(len(over)), -1)
    for _ in range(len(over)):
        before = piece.copy()
        np.maximum.at(piece, edges[:, 0], piece[edges[:, 1]])
        if (piece == before).all():
            break
    return [piece == number for number in np.unique(piece[over]).tolist()]


def _joined_across(
    vertices: Points, loops: Sequence[Loop], normal: Points, height: Points
) -> list[tuple[int, int]]:
    """Return pairs of vertices beyond a plane that a facet joins, other than by its edges.

    Each segment in which the facet meets the plane bounds one piece beyond it, from end to end.
    """
    if len(loops) == 1:
        over = height[list(loops[0])] > 0
        if np.count_nonzero(over != np.roll(over, 1)) <= 2:
            return []  # one stretch: its vertices are neighbours
    whole = [loop[0] for loop in loops if (height[list(loop)] > 0).all()]
    along = np.cross(face_vector([vertices[list(loop)] for loop in loops]), normal)
    ends = []
    for a, b in directed_edges(loops):
        if (height[a] > 0) != (height[b] > 0):
            share = height[a] / (height[a] - height[b])
            at = vertices[a] + share * (vertices[b] - vertices[a])
            ends.append((float(at @ along), a if height[a] > 0 else b))
    ends.sort()
    pairs = [(one[1], other[1]) for one, other in zip(ends[::2], ends[1::2], strict=True)]
    anchors = [*(pair[0] for pair in pairs), *whole] if whole else []
    return pairs + list(pairwise(anchors))


def corners_beyond(
    body: Part, normal: Points, offset_mm: float, piece: NDArray[np.bool_]
) -> Points:
    """Return the corners (n, 3) of one of the pieces of `beyond`, those in the plane included."""
    cuts = _Cuts(body, body.vertices @ normal - offset_mm, piece)
    for a, b in _edges(body.facets):
        if piece[a] and not piece[b]:
            cuts.cut(a, b)
    return np.concatenate([body.vertices[piece], np.reshape(cuts.points, (-1, 3))])


def shortest_edge_mm(body: Part) -> float:
    """Return the length of the shortest edge."""
    ends = body.vertices[np.array(_edges(body.facets))]
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).min())


def body_volume(body: Part) -> float:
    """Return the volume, mm^3."""
    return signed_volume(body.vertices, [facet.loops for facet in body.facets])


class _Cuts:
    """The points where edges are cut, and how facets leave and enter what stays there."""

    def __init__(self, body: Part, height: Points, goes: NDArray[np.bool_]) -> None:
        self.body = body
        self.height = height
        self.goes = goes.tolist()
        self.points: list[Points] = []
        self.numbers: dict[tuple[int, int], int] = {}
        self.lid_next: dict[int, int] = {}

    def clip_facet(self, loops: Sequence[Loop], normal: Points) -> tuple[Loop, ...] | None:
        """Return what stays of a facet, () for nothing; None where it would fall apart."""
        whole = [loop for loop in loops if not any(self.goes[v] for v in loop)]
        if len(whole) == len(loops):
            return tuple(loops)
        chains = [chain for loop in loops for chain in self._chains(loop)]
        if not chains:
            return () if not whole else None
        upward = face_vector([self.body.vertices[list(loop)] for loop in loops])
        along = np.cross(upward, normal)
        points = self.all_points()
        ends = [(float(points[c[-1]] @ along), k, False) for k, c in enumerate(chains)]
        ends += [(float(points[c[0]] @ along), k, True) for k, c in enumerate(chains)]
        ends.sort()
        following: dict[int, int] = {}
        for (_, leaves, wrong), (_, enters, right) in zip(ends[::2], ends[1::2], strict=True):
            if wrong or not right:
                return None
            following[leaves] = enters
            self.lid_next[chains[enters][0]] = chains[leaves][-1]
        joined = _cycles(following)
        found = [tuple(v for k in cycle for v in chains[k]) for cycle in joined] + whole
        areas = [float(area_vector(points[list(loop)]) @ upward) for loop in found]
        outer = [loop for loop, area in zip(found, areas, strict=True) if area > 0]
        if len(outer) != 1:
            return None
        return (outer[0], *(loop for loop in found if loop is not outer[0]))

    def lids(self) -> list[Loop]:
        return [tuple(cycle) for cycle in _cycles(self.lid_next)]

    def _chains(self, loop: Loop) -> list[Loop]:
        """Return the runs of a loop that stay, each with the points where it is cut."""
        n = len(loop)
        chains = []
        for k in range(n):
            if self.goes[loop[k - 1]] and not self.goes[loop[k]]:
                after = loop[k:] + loop[:k]
                stays = next(j for j in range(1, n) if self.goes[after[j]])
                first = self.cut(after[-1], after[0])
                last = self.cut(after[stays - 1], after[stays])
                chains.append((first, *after[:stays], last))
        return chains

    def cut(self, a: int, b: int) -> int:
        """Return the number of the point where the edge a-b meets the plane."""
        key = (min(a, b), max(a, b))
        if key not in self.numbers:
            self.numbers[key] = len(self.body.vertices) + len(self.points)
            p, q = self.body.vertices[list(key)]
            share = self.height[key[0]] / (self.height[key[0]] - self.height[key[1]])
            self.points.append(p + share * (q - p))
        return self.numbers[key]

    def all_points(self) -> Points:
        """Return the vertices (n, 3) of the body, and the points where edges are cut."""
        return np.concatenate([self.body.vertices, np.reshape(self.points, (-1, 3))])


def _cycles(following: dict[int, int]) -> list[list[int]]:
    """Return the cycles of a permutation, each from its least number."""
    cycles, left = [], set(following)
    while left:
        cycle = [min(left)]
        while following[cycle[-1]] != cycle[0]:
            cycle.append(following[cycle[-1]])
        cycles.append(cycle)
        left -= set(cycle)
    return cycles


def _edges(facets: Sequence[Facet]) -> list[tuple[int, int]]:
    return [edge for facet in facets for edge in directed_edges(facet.loops)]


def _connected(facets: Sequence[Facet]) -> bool:
    """Whether the facets are one surface: each reached from the first over common vertices."""
    waiting = [{v for loop in facet.loops for v in loop} for facet in facets]
    reached = waiting.pop()
    while waiting:
        apart = [corners for corners in waiting if not corners & reached]
        if len(apart) == len(waiting):
            return False
        reached.update(*(corners for corners in waiting if corners & reached))
        waiting = apart
    return True


Plane = tuple[Points, float]  #: unit normal (3,) and offset; the first panel lies below


def fit_panels(polyhedron: Polyhedron, parts: Sequence[Part], gap_mm: float) -> tuple[Part, ...]:
    """Return plain panels, one for each face, cut so that they keep `gap_mm` from each other.

    Facet 0 of a panel is the face, facet 1 the back. Raises `SolidError` if no plane parts two of
    them.
    """
    fitted = list(parts)
    seats = [part.seated for part in fitted]
    for one, other in _near_pairs(seats, gap_mm):
        planes = list(_planes(polyhedron, one, other))
        half = gap_mm / 2 - _ROUNDING_MM
        if any(_parts(plane, seats[one], seats[other], half) for plane in planes):
            continue
        if _gap(fitted[one], fitted[other], gap_mm) >= gap_mm - _ROUNDING_MM:
            continue
        fitted[one], fitted[other] = _cut_apart(
            polyhedron, (one, other), (fitted[one], fitted[other]), planes, gap_mm
        )
        seats[one], seats[other] = fitted[one].seated, fitted[other].seated
    return tuple(fitted)


def _near_pairs(seats: Sequence[Points], gap: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs of panels whose boxes come nearer than the gap."""
    low = np.array([points.min(axis=0) for points in seats])
    high = np.array([points.max(axis=0) for points in seats])
    for one in range(len(seats) - 1):
        rest = slice(one + 1, None)
        near = (low[rest] < high[one] + gap).all(axis=1) & (high[rest] > low[one] - gap).all(axis=1)
        yield from ((one, one + 1 + int(k)) for k in np.flatnonzero(near))


def _planes(polyhedron: Polyhedron, one: int, other: int) -> Iterator[Plane]:
    """Yield planes that may part two panels: with the middles of their faces on either side.

    Those that bisect the angle between the faces; where they share a corner, also the one
    across the middle of the two lines from there to the middles of the faces.
    """
    loops = [polyhedron.faces[face].loops[0] for face in (one, other)]
    n, m = (face_normal(polyhedron, face) for face in (one, other))
    p, q = (polyhedron.vertices[list(loop)].mean(axis=0) for loop in loops)
    found: list[Plane] = []
    for sign in (1.0, -1.0):
        away = m - sign * n
        length = float(np.linalg.norm(away))
        if length >= _PARALLEL:
            offset = (float(m @ q) - sign * float(n @ p)) / length
            found += [(away / length, offset), (-away / length, -offset)]
    for corner in sorted(set(loops[0]) & set(loops[1])):
        at = polyhedron.vertices[corner]
        to_p, to_q = (float(np.linalg.norm(middle - at)) for middle in (p, q))
        if min(to_p, to_q) < _PARALLEL:
            continue  # the middle of an L can be its inner corner
        away = (q - at) / to_q - (p - at) / to_p
        length = float(np.linalg.norm(away))
        if length >= _PARALLEL:
            found.append((away / length, float(away @ at) / length))
    yield from (
        (normal, offset)
        for normal, offset in found
        if float(normal @ p) < offset < float(normal @ q)
    )


def _cut_apart(
    polyhedron: Polyhedron,
    faces: tuple[int, int],
    parts: tuple[Part, Part],
    planes: Sequence[Plane],
    gap: float,
) -> tuple[Part, Part]:
    """Return two panels cut by the plane that takes the least from them."""
    names = [polyhedron.faces[face].name for face in faces]
    seats = [part.seated for part in parts]
    before = sum(body_volume(part) for part in parts)
    best: tuple[float, tuple[Part, Part]] | None = None
    for normal, offset in planes:
        first = _cut_part(parts[0], normal, offset, gap, seats[1], f"{names[0]} by {names[1]}")
        if first is None:
            continue
        second = _cut_part(parts[1], -normal, -offset, gap, seats[0], f"{names[1]} by {names[0]}")
        if second is None:
            continue
        apart = gap / 2 - _ROUNDING_MM
        if not _parts((normal, offset), first.seated, second.seated, apart) and (
            _gap(first, second, gap) < gap - _ROUNDING_MM
        ):
            continue
        lost = before - sum(body_volume(part) for part in (first, second))
        if best is None or lost < best[0] - _ROUNDING_MM:
            best = (lost, (first, second))
    if best is None:
        raise SolidError(
            f"the panels of {names[0]} and {names[1]} run into each other",
            fix="set wall to less, or print the object whole (parts: whole)",
            place=names[0],
        )
    return best[1]


def _cut_part(
    part: Part, normal: Points, offset: float, gap: float, other: Points, name: str
) -> Part | None:
    """Return a panel that keeps half a gap from a plane near another one; None if it breaks.

    It is to lie below the plane (object frame); `other`: (n, 3) corners of the other panel, object
    frame; `name` of the facet in the plane.
    """
    T = part.T_object_part
    inward, at = T[:3, :3].T @ normal, offset - gap / 2 - float(T[:3, 3] @ normal)
    low, high = other.min(axis=0) - gap, other.max(axis=0) + gap
    allowed = min(shortest_edge_mm(part), _EDGE_MM)
    best: Part | None = None
    best_edge = 0.0
    for step in range(_STEPS):
        cut: Part | None = part
        back = at - step * _STEP_MM
        for _ in beyond(part, inward, back):
            assert cut is not None
            piece = _first_near(cut, T, inward, back, low, high)
            if piece is None:
                break
            cut = cut_off(cut, inward, back, piece, name)
            if cut is None:
                break
        if cut is None or [f.name for f in cut.facets[:2]] != [f.name for f in part.facets[:2]]:
            continue
        if cut is part:
            return part
        edge = shortest_edge_mm(cut)
        if edge > best_edge:
            best, best_edge = cut, edge
        if edge >= allowed:
            break
    return best


def _first_near(
    body: Part, T: Points, normal: Points, offset: float, low: Points, high: Points
) -> NDArray[np.bool_] | None:
    """Return a piece beyond the plane whose box meets that of the other panel."""
    for piece in beyond(body, normal, offset):
        mine = transform(T, corners_beyond(body, normal, offset, piece))
        if (mine.min(axis=0) <= high).all() and (mine.max(axis=0) >= low).all():
            return piece
    return None


def _parts(plane: Plane, one: Points, other: Points, half: float) -> bool:
    """Whether a plane already lies between two panels, half a gap from both."""
    normal, offset = plane
    below = float((one @ normal).max()) <= offset - half
    return below and float((other @ normal).min()) >= offset + half


def _gap(one: Part, other: Part, reach: float) -> float:
    """Return the distance of two plain panels, mm, at most `reach`; 0 where they overlap."""
    solids = []
    for part in (one, other):
        mesh = triangles(part)
        seated = transform(part.T_object_part, mesh.vertices)
        solids.append(Manifold(Mesh64(seated, mesh.triangles.astype(np.uint64))))
    return float(solids[0].min_gap(solids[1], reach))
