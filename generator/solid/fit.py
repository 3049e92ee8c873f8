"""Panels that fit: no two come nearer than the gap, wherever they meet in the finished object.

Mitres part the panels of faces with a common edge. Faces that share only a corner, or that
come near each other behind a small face, are parted here: both panels are cut by the plane
that bisects the angle between the faces, half the gap from it. A plane is moved back a
little where it would leave a facet too narrow to print. Lengths in mm, object frame unless said.

A plain body cut by a plane: exact clipping of its facets, without a boolean.

Body (vertices, planar facets with loops) + plane + which vertices go -> body. Every edge
between a vertex that stays and one that goes is cut once, so that neighbours keep common
corners; what the cut opens is closed by facets in the plane. Vertices that go need not be all
that lie beyond the plane: one connected piece of them is cut off alone. Lengths in mm.

Reference: Sutherland and Hodgman, Reentrant polygon clipping, Communications of the ACM 17
(1974); here the pieces of a facet are joined along the plane, so that it may be non-convex.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from manifold3d import Manifold, Mesh64
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.plane.polygon import area_vector, face_vector, signed_volume
from generator.polyhedron.frame import face_normal
from generator.polyhedron.winged import Polyhedron
from generator.solid.part import Facet, Part
from generator.solid.settings import EMBOSS
from generator.solid.triangulate import triangles

Points = NDArray[np.float64]
Loop = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class PlainBody:
    """A closed body of planar facets."""

    vertices: Points  #: (V, 3) mm
    facets: tuple[Facet, ...]


def cut_off(
    body: PlainBody, normal: Points, offset_mm: float, goes: NDArray[np.bool_], name: str
) -> PlainBody | None:
    """Return the body without the vertices that go, closed in a plane.

    Parameters
    ----------
    body
        Closed.
    normal, offset_mm
        Unit vector (3,) and distance: the plane normal . x = offset; what goes lies beyond.
    goes
        (V,) bool: vertices beyond the plane, each with all its neighbours beyond it.
    name
        Of the facets in the plane.

    Returns
    -------
    PlainBody or None
        None where a facet or the body would fall apart.
    """
    cuts = _Cuts(body, body.vertices @ normal - offset_mm, goes)
    facets: list[Facet] = []
    for facet in body.facets:
        loops = cuts.clip_facet(facet.loops, normal)
        if loops is None:
            return None
        if loops:
            facets.append(Facet(facet.name, loops))
    vertices = np.concatenate([body.vertices, *cuts.points])
    lids = cuts.lids()
    if any(area_vector(vertices[list(lid)]) @ normal <= 0 for lid in lids):
        return None  # a lid with a hole: not a panel
    facets += [Facet(name, (lid,)) for lid in lids]
    if not facets or not _connected(facets):
        return None
    used = np.unique(np.concatenate([loop for facet in facets for loop in facet.loops]))
    number = {old: new for new, old in enumerate(used.tolist())}
    return PlainBody(
        vertices[used],
        tuple(
            Facet(f.name, tuple(tuple(number[v] for v in loop) for loop in f.loops)) for f in facets
        ),
    )


def beyond(body: PlainBody, normal: Points, offset_mm: float) -> list[NDArray[np.bool_]]:
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

    Every stretch of the facet in the plane has one piece beyond it, from end to end.
    """
    if len(loops) == 1:
        over = height[list(loops[0])] > 0
        if np.count_nonzero(over != np.roll(over, 1)) <= 2:
            return []  # one stretch: its vertices are neighbours
    whole = [loop[0] for loop in loops if (height[list(loop)] > 0).all()]
    along = np.cross(face_vector([vertices[list(loop)] for loop in loops]), normal)
    ends = []
    for loop in loops:
        for a, b in zip(loop, loop[1:] + loop[:1], strict=True):
            if (height[a] > 0) != (height[b] > 0):
                share = height[a] / (height[a] - height[b])
                at = vertices[a] + share * (vertices[b] - vertices[a])
                ends.append((float(at @ along), a if height[a] > 0 else b))
    ends.sort()
    pairs = [(one[1], other[1]) for one, other in zip(ends[::2], ends[1::2], strict=True)]
    anchors = [*(pair[0] for pair in pairs), *whole] if whole else []
    return pairs + list(pairwise(anchors))


def corners_beyond(
    body: PlainBody, normal: Points, offset_mm: float, piece: NDArray[np.bool_]
) -> Points:
    """Return the corners (n, 3) of one of the pieces of `beyond`, those in the plane included."""
    cuts = _Cuts(body, body.vertices @ normal - offset_mm, piece)
    for a, b in _edges(body.facets):
        if piece[a] and not piece[b]:
            cuts.cut(a, b)
    return np.concatenate([body.vertices[piece], *cuts.points])


def shortest_edge_mm(body: PlainBody) -> float:
    """Return the length of the shortest edge."""
    edges = np.array(_edges(body.facets))
    ends = body.vertices[edges]
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).min())


def body_volume(body: PlainBody) -> float:
    """Return the volume, mm^3."""
    return signed_volume(body.vertices, [facet.loops for facet in body.facets])


class _Cuts:
    """The points where edges are cut, and how facets leave and enter what stays there."""

    def __init__(self, body: PlainBody, height: Points, goes: NDArray[np.bool_]) -> None:
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
        ends = [(float(self._point(c[-1]) @ along), k, False) for k, c in enumerate(chains)]
        ends += [(float(self._point(c[0]) @ along), k, True) for k, c in enumerate(chains)]
        ends.sort()
        following: dict[int, int] = {}
        for (_, leaves, wrong), (_, enters, right) in zip(ends[::2], ends[1::2], strict=True):
            if wrong or not right:
                return None
            following[leaves] = enters
            self.lid_next[chains[enters][0]] = chains[leaves][-1]
        joined = _cycles(following)
        found = [tuple(v for k in cycle for v in chains[k]) for cycle in joined] + whole
        areas = [float(area_vector(self._points(loop)) @ upward) for loop in found]
        outer = [loop for loop, area in zip(found, areas, strict=True) if area > 0]
        if len(outer) != 1:
            return None
        return (outer[0], *(loop for loop in found if loop is not outer[0]))

    def lids(self) -> list[Loop]:
        """Return the loops that close the body in the plane."""
        return [tuple(cycle) for cycle in _cycles(self.lid_next)]

    def _chains(self, loop: Loop) -> list[Loop]:
        """Return the runs of a loop that stay, each with the points where it is cut."""
        n = len(loop)
        starts = [k for k in range(n) if self.goes[loop[k - 1]] and not self.goes[loop[k]]]
        chains = []
        for start in starts:
            chain = [self.cut(loop[start - 1], loop[start])]
            k = start
            while not self.goes[loop[k % n]]:
                chain.append(loop[k % n])
                k += 1
            chain.append(self.cut(loop[(k - 1) % n], loop[k % n]))
            chains.append(tuple(chain))
        return chains

    def cut(self, a: int, b: int) -> int:
        """Return the number of the point where the edge a-b meets the plane."""
        key = (min(a, b), max(a, b))
        if key not in self.numbers:
            self.numbers[key] = len(self.body.vertices) + len(self.points)
            p, q = self.body.vertices[list(key)]
            share = self.height[key[0]] / (self.height[key[0]] - self.height[key[1]])
            self.points.append((p + share * (q - p))[None])
        return self.numbers[key]

    def _point(self, number: int) -> Points:
        first = len(self.body.vertices)
        point: Points = (
            self.body.vertices[number] if number < first else self.points[number - first][0]
        )
        return point

    def _points(self, loop: Loop) -> Points:
        return np.array([self._point(v) for v in loop])


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
    """Return all directed edges."""
    return [
        edge
        for facet in facets
        for loop in facet.loops
        for edge in zip(loop, loop[1:] + loop[:1], strict=True)
    ]


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
    """Return the plain panels of all faces, cut so that they keep `gap_mm` from each other.

    Parameters
    ----------
    polyhedron
        Closed and oriented; mm, object frame.
    parts
        One plain panel for each face, without embossings; facet 0 is the face, facet 1 the back.
    gap_mm
        Least distance between two of them.

    Raises
    ------
    SolidError
        If two panels run into each other so that no plane parts them.
    """
    fitted = list(parts)
    seats = [_in_object(part) for part in fitted]
    for one, other in _near_pairs(seats, gap_mm):
        planes = list(_planes(polyhedron, one, other))
        half = gap_mm / 2 - EMBOSS.fit_rounding_mm
        if any(_parts(plane, seats[one], seats[other], half) for plane in planes):
            continue
        if _gap(fitted[one], fitted[other], gap_mm) >= gap_mm - EMBOSS.fit_rounding_mm:
            continue
        fitted[one], fitted[other] = _cut_apart(
            polyhedron, (one, other), (fitted[one], fitted[other]), planes, gap_mm
        )
        seats[one], seats[other] = _in_object(fitted[one]), _in_object(fitted[other])
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
        if length >= EMBOSS.fit_parallel:
            offset = (float(m @ q) - sign * float(n @ p)) / length
            found += [(away / length, offset), (-away / length, -offset)]
    for corner in sorted(set(loops[0]) & set(loops[1])):
        at = polyhedron.vertices[corner]
        to_p, to_q = (float(np.linalg.norm(middle - at)) for middle in (p, q))
        if min(to_p, to_q) < EMBOSS.fit_parallel:
            continue  # the middle of an L can be its inner corner
        away = (q - at) / to_q - (p - at) / to_p
        length = float(np.linalg.norm(away))
        if length >= EMBOSS.fit_parallel:
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
    seats = [_in_object(part) for part in parts]
    before = sum(body_volume(_body(part)) for part in parts)
    best: tuple[float, tuple[Part, Part]] | None = None
    for normal, offset in planes:
        first = _cut_part(parts[0], normal, offset, gap, seats[1], f"{names[0]} by {names[1]}")
        if first is None:
            continue
        second = _cut_part(parts[1], -normal, -offset, gap, seats[0], f"{names[1]} by {names[0]}")
        if second is None:
            continue
        apart = gap / 2 - EMBOSS.fit_rounding_mm
        if not _parts((normal, offset), _in_object(first), _in_object(second), apart) and (
            _gap(first, second, gap) < gap - EMBOSS.fit_rounding_mm
        ):
            continue
        lost = before - sum(body_volume(_body(part)) for part in (first, second))
        if best is None or lost < best[0] - EMBOSS.fit_rounding_mm:
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

    Parameters
    ----------
    part
        Plain panel.
    normal, offset
        The plane, object frame; the panel is to lie below it.
    gap
        Twice the distance from it.
    other
        (n, 3) corners of the other panel, object frame.
    name
        Of the facet in the plane.
    """
    T = part.T_object_part
    inward, at = T[:3, :3].T @ normal, offset - gap / 2 - float(T[:3, 3] @ normal)
    low, high = other.min(axis=0) - gap, other.max(axis=0) + gap
    body = _body(part)
    allowed = min(shortest_edge_mm(body), EMBOSS.fit_edge_mm)
    best, best_edge = None, 0.0
    for step in range(EMBOSS.fit_steps):
        cut: PlainBody | None = body
        back = at - step * EMBOSS.fit_step_mm
        for _ in beyond(body, inward, back):
            assert cut is not None
            piece = _first_near(cut, T, inward, back, low, high)
            if piece is None:
                break
            cut = cut_off(cut, inward, back, piece, name)
            if cut is None:
                break
        if cut is None or [f.name for f in cut.facets[:2]] != [f.name for f in body.facets[:2]]:
            continue
        if cut is body:
            return part
        edge = shortest_edge_mm(cut)
        if edge > best_edge:
            best, best_edge = cut, edge
        if edge >= allowed:
            break
    if best is None:
        return None
    return Part(part.name, best.vertices, best.facets, (), T)


def _first_near(
    body: PlainBody, T: Points, normal: Points, offset: float, low: Points, high: Points
) -> NDArray[np.bool_] | None:
    """Return a piece beyond the plane whose box meets that of the other panel."""
    for piece in beyond(body, normal, offset):
        mine = _seated(T, corners_beyond(body, normal, offset, piece))
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
    solids = [_manifold(part) for part in (one, other)]
    return float(solids[0].min_gap(solids[1], reach))


def _manifold(part: Part) -> Manifold:
    mesh = triangles(part)
    seated = _seated(part.T_object_part, mesh.vertices)
    return Manifold(Mesh64(seated, mesh.triangles.astype(np.uint64)))


def _in_object(part: Part) -> Points:
    return _seated(part.T_object_part, part.vertices)


def _seated(T_object_part: Points, points: Points) -> Points:
    """Return points (n, 3) of a part's frame in the object's."""
    seated: Points = points @ T_object_part[:3, :3].T + T_object_part[:3, 3]
    return seated


def _body(part: Part) -> PlainBody:
    return PlainBody(part.vertices, part.facets)
