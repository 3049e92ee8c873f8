"""Unfold a polyhedron into a net: cut along edges, lay the faces flat without overlap.

Polyhedron -> Net: one plane rigid transform per face. Neighbours along a fold share their edge
in the net, areas are kept, and faces of one piece never overlap. Not every polyhedron is known
to have a net in one piece, so several spanning trees are tried (breadth first from large faces,
steepest edges, random ones) and the one with the fewest pieces (islands) is taken. Thesis 6.3.

References
----------
W. Schlickenrieder, Nets of polyhedra, 1997: steepest-edge cuts.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from manifold3d import triangulate
from numpy.typing import NDArray

from generator.plane.polygon import is_convex, triangle_areas
from generator.polyhedron.frame import face_polygon
from generator.polyhedron.winged import Polyhedron

Points = NDArray[np.float64]
Triangles = NDArray[np.float64]  #: (n, 3, 2), counter-clockwise

TOLERANCE = 1e-7  #: faces that overlap by less than this share of the net's size touch
FACES_LAID = 6000  #: over all trees at most: bounds the time for objects of many faces
BREADTH_ROOTS = 12  #: faces from which a tree by breadth is begun
RANDOM_TREES = 24  #: in random order of edges, after those by breadth and by direction
#: In general position: no edge of a usual solid is level for them.
_DIRECTIONS = np.array([*product((1, -1), repeat=3)]) * (0.53, 0.31, 0.79)


@dataclass(frozen=True, slots=True)
class Net:
    """The faces of a polyhedron laid flat, seen from outside."""

    T_net_face: NDArray[np.float64]  #: (F, 3, 3) plane rigid transforms, mm
    pieces: tuple[tuple[int, ...], ...]  #: faces of each island, each in a plane of its own
    parents: tuple[int, ...]  #: the face at whose edge a face was laid down, -1 for the first


@dataclass(frozen=True, slots=True)
class _Hinge:
    face: int  # the neighbour
    edge: int
    start: int  # vertex
    end: int


@dataclass(frozen=True, slots=True)
class _Surface:
    points: list[dict[int, Points]]  # per face: vertex -> place in the face frame
    triangles: list[Triangles]
    hinges: list[list[_Hinge]]
    tolerance: float


Priority = Callable[[int, int], float]  # (edge, faces between this one and the first) -> order


def unfold(polyhedron: Polyhedron) -> Net:
    """Return the net with the fewest pieces among the trees that are tried."""
    surface = _surface(polyhedron)
    nets: list[Net] = []
    for root, priority in _trees(polyhedron, surface):
        nets.append(_lay_flat(surface, root, priority))
        if len(nets[-1].pieces) == 1 or len(nets) * len(polyhedron.faces) >= FACES_LAID:
            break
    return min(nets, key=lambda net: len(net.pieces))


def split(net: Net, piece: int) -> Net:
    """Return the net with one piece cut in two along the fold that leaves the most equal halves.

    A piece of at least two faces; the others are kept, the halves come last.
    """
    faces = net.pieces[piece]
    below = {face: [face] for face in faces}
    for face in reversed(faces):  # children stand after their parents
        if net.parents[face] in below:
            below[net.parents[face]] += below[face]
    cut = min(faces[1:], key=lambda face: abs(2 * len(below[face]) - len(faces)))
    half = set(below[cut])
    parents = tuple(-1 if face == cut else parent for face, parent in enumerate(net.parents))
    rest = tuple(face for face in faces if face not in half)
    kept = tuple(p for k, p in enumerate(net.pieces) if k != piece)
    return Net(net.T_net_face, (*kept, rest, tuple(f for f in faces if f in half)), parents)


def _surface(polyhedron: Polyhedron) -> _Surface:
    points, triangles = [], []
    for number, face in enumerate(polyhedron.faces):
        loops = face_polygon(polyhedron, number)
        vertices = [vertex for loop in face.loops for vertex in loop]
        points.append(dict(zip(vertices, np.concatenate(loops), strict=True)))
        triangles.append(triangles_of(loops))
    hinges: list[list[_Hinge]] = [[] for _ in polyhedron.faces]
    for number, edge in enumerate(polyhedron.edges):
        hinges[edge.left].append(_Hinge(edge.right, number, edge.start, edge.end))
        hinges[edge.right].append(_Hinge(edge.left, number, edge.start, edge.end))
    size = float(np.ptp(polyhedron.vertices, axis=0).max())
    return _Surface(points, triangles, hinges, TOLERANCE * size)


def _trees(polyhedron: Polyhedron, surface: _Surface) -> Iterator[tuple[int, Priority]]:
    """Yield the face to begin with and the order of folds, likely ones first."""
    areas = [float(np.sum(triangle_areas(triangles))) for triangles in surface.triangles]
    roots = sorted(range(len(areas)), key=lambda face: (-round(areas[face], 6), face))
    for root in roots[:BREADTH_ROOTS]:
        yield root, lambda _edge, depth: float(depth)
    for direction in _DIRECTIONS:
        yield roots[0], _uncut_first(_steepest_edges(polyhedron, direction))
    random = np.random.default_rng(0)
    for _ in range(RANDOM_TREES):
        yield roots[0], _edge_order(random.permutation(len(polyhedron.edges)))


def _uncut_first(cuts: NDArray[np.bool_]) -> Priority:
    """Fold along edges that are not cut first, near the root first."""
    return lambda edge, depth: float(cuts[edge] * 1e6 + depth)


def _edge_order(order: NDArray[np.int64]) -> Priority:
    """Fold along edges in a given order."""
    return lambda edge, _depth: float(order[edge])


def _steepest_edges(polyhedron: Polyhedron, direction: Points) -> NDArray[np.bool_]:
    """Return which edges are cut: from each vertex the edge that rises most steeply."""
    start = np.array([edge.start for edge in polyhedron.edges])
    end = np.array([edge.end for edge in polyhedron.edges])
    along = polyhedron.vertices[end] - polyhedron.vertices[start]
    slope = along @ direction / np.sqrt(np.einsum("ei,ei->e", along, along))
    number = np.arange(len(start))
    steepest = np.full(len(polyhedron.vertices), -np.inf)
    chosen = np.full(len(polyhedron.vertices), -1)
    for vertices, rise in ((start, slope), (end, -slope)):
        order = np.argsort(rise, kind="stable")
        better = rise[order] > steepest[vertices[order]]
        chosen[vertices[order][better]] = number[order][better]
        steepest[vertices[order][better]] = rise[order][better]
    top = int(np.argmax(polyhedron.vertices @ direction))
    cut = np.zeros(len(start), dtype=bool)
    cut[np.delete(chosen, top)] = True
    return cut


def _lay_flat(surface: _Surface, root: int, priority: Priority) -> Net:
    """Lay face after face at the edges of those that lie already, leaving out what overlaps."""
    count = len(surface.points)
    transforms = np.tile(np.eye(3), (count, 1, 1))
    parents = [-1] * count
    placed = [False] * count
    pieces: list[tuple[int, ...]] = []
    for first in (root, *range(count)):
        if placed[first]:
            continue
        placed[first] = True
        faces, depth = [first], {first: 0}
        lying = surface.triangles[first]
        waiting: list[tuple[float, int, int, _Hinge]] = []
        _push(waiting, surface, priority, first, 0)
        while waiting:
            *_, parent, hinge = heapq.heappop(waiting)
            face = hinge.face
            if placed[face]:
                continue
            T = transforms[parent] @ _hinge_transform(surface, parent, hinge)
            triangles = surface.triangles[face] @ T[:2, :2].T + T[:2, 2]
            if overlap(triangles, lying, surface.tolerance):
                continue
            lying = np.concatenate([lying, triangles])
            transforms[face], parents[face], placed[face] = T, parent, True
            faces.append(face)
            depth[face] = depth[parent] + 1
            _push(waiting, surface, priority, face, depth[face])
        pieces.append(tuple(faces))
    return Net(transforms, tuple(pieces), tuple(parents))


def _push(
    waiting: list[tuple[float, int, int, _Hinge]],
    surface: _Surface,
    priority: Priority,
    face: int,
    depth: int,
) -> None:
    for hinge in surface.hinges[face]:
        # Equal priorities: the longer way in the list of edges decides, never the hinge itself.
        item = (priority(hinge.edge, depth), 2 * hinge.edge + (hinge.face > face), face, hinge)
        heapq.heappush(waiting, item)


def _hinge_transform(surface: _Surface, parent: int, hinge: _Hinge) -> Points:
    """Return T_parent_face: the neighbour laid into the parent's plane at their common edge."""
    a, b = (surface.points[parent][v] for v in (hinge.start, hinge.end))
    c, d = (surface.points[hinge.face][v] for v in (hinge.start, hinge.end))
    p, q = b - a, d - c
    cosine, sine = q @ p, q[0] * p[1] - q[1] * p[0]
    length = np.hypot(cosine, sine)
    R = np.array([[cosine, -sine], [sine, cosine]]) / length
    T = np.eye(3)
    T[:2, :2] = R
    T[:2, 2] = (a + b) / 2 - R @ (c + d) / 2
    return T


def triangles_of(loops: Sequence[Points]) -> Triangles:
    """Return triangles (n, 3, 2) that fill a polygon: outer loop, then holes."""
    points = np.concatenate(loops)
    if len(loops) == 1 and is_convex(points):
        k = np.arange(1, len(points) - 1)
        corners = points[np.column_stack([np.zeros_like(k), k, k + 1])]
    else:
        corners = points[np.asarray(triangulate([np.asarray(loop) for loop in loops]))]
    size = float(np.ptp(points, axis=0).max())
    return np.asarray(corners[triangle_areas(corners) > 0.5e-12 * size * size])


def overlap(first: Triangles, second: Triangles, tolerance: float) -> bool:
    """Whether two sets of triangles (n, 3, 2) share more than a border; by separating axes."""
    second = _near_triangles(second, first, tolerance)
    first = _near_triangles(first, second, tolerance)
    if len(first) == 0 or len(second) == 0:
        return False
    gap = np.maximum(_separation(first, second), _separation(second, first).T)
    return bool((gap < -tolerance).any())


def _near_triangles(triangles: Triangles, others: Triangles, tolerance: float) -> Triangles:
    """Return the triangles that reach into the bounding box of the others."""
    if len(others) == 0:
        return triangles[:0]
    low, high = others.min(axis=(0, 1)) + tolerance, others.max(axis=(0, 1)) - tolerance
    near = (triangles.max(axis=1) > low) & (triangles.min(axis=1) < high)
    return np.asarray(triangles[near.all(axis=1)])


def _separation(first: Triangles, second: Triangles) -> Points:
    """Return the widest gap (n, m) that an edge normal of the first shows to the second, mm."""
    side = np.roll(first, -1, axis=1) - first
    normal = np.stack([side[..., 1], -side[..., 0]], axis=-1)
    normal /= np.sqrt(np.einsum("nki,nki->nk", side, side))[..., None]
    foot = np.einsum("nki,nki->nk", normal, first)
    reach = np.einsum("nki,mci->nkmc", normal, second).min(axis=-1)
    return np.asarray((reach - foot[..., None]).max(axis=1))
