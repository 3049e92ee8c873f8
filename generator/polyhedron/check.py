"""What faces must be, and how they must join, to be a solid; and how faults are named.

Vertices (V, 3) mm and faces as tuples of loops (outer counter-clockwise seen from outside,
holes clockwise). Single faces: no duplicate vertices, slivers, bends, loops that cross or touch
themselves, holes outside. Together: every edge lies between exactly two faces that run it in
opposite directions; around a vertex they form one fan; all hang together; none cuts through
another. Nothing is repaired. Tolerances are shares of the size, the diagonal of the bounding
box. Thesis 6.3.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.plane.polygon import (
    area_vector,
    closest_pair,
    distance,
    is_convex,
    plane_axes,
    side_of_polygon,
    signed_area,
)

PLANARITY = 1e-4  #: most a vertex may lie off its face's plane, of the size: more is no rounding
CLOSENESS = 1e-6  #: two points, or a point and an edge, nearer than this share touch: float32

Loops = tuple[tuple[int, ...], ...]
Vertices = NDArray[np.float64]
Users = dict[tuple[int, int], list[tuple[int, bool]]]  # edge -> (face, runs upward in number)

LISTED = 8  #: problems spelled out in one message


class FaceProblem(NamedTuple):
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


def flat_loops(
    vertices: Vertices, loops: Loops, x: Vertices, y: Vertices, *points: Vertices
) -> tuple[Vertices, ...]:
    """Return the loops of a face, (k, 2) each, and then sets of points (n, 3), in its frame."""
    origin, axes = vertices[loops[0][0]], np.stack([x, y], axis=1)
    sets = [vertices[list(loop)] for loop in loops] + list(points)
    return tuple((own - origin) @ axes for own in sets)


def number_problems(surface: Surface) -> list[FaceProblem]:
    """Return what is wrong with counts, coordinates and indices; the rest needs these right."""
    vertices, problems = surface.vertices, []
    count = len(vertices)
    if count < 4 or len(surface.faces) < 4:
        cause = f"{count} vertices and {len(surface.faces)} faces: a solid has at least 4 of each"
        problems.append(FaceProblem("", cause, "give every vertex and every face"))
    for number in np.flatnonzero(~np.isfinite(vertices).all(axis=1)):
        cause = f"vertex {number} is not a point: {vertices[number]}"
        problems.append(FaceProblem("", cause, "give three lengths"))
    few = "list at least 3 vertices"
    for name, loops in zip(surface.names, surface.faces, strict=True):
        if not loops:
            problems.append(FaceProblem(name, "it has no vertices", few))
        for loop in loops:
            outside = [v for v in loop if not 0 <= v < count]
            if outside:
                cause = f"there is no vertex {outside[0]}; they are 0 to {count - 1}"
                problems.append(FaceProblem(name, cause, "count vertices from 0"))
            elif len(loop) < 3:
                problems.append(FaceProblem(name, f"a loop of {len(loop)} vertices", few))
    return problems


def edge_problems(surface: Surface) -> list[FaceProblem]:
    """Return what is wrong with the way faces join: open, branching or reversed edges, shells."""
    users: Users = defaultdict(list)
    for face, loops in enumerate(surface.faces):
        for a, b in directed_edges(loops):
            users[min(a, b), max(a, b)].append((face, a < b))
    problems = []
    for (a, b), found in users.items():
        if len(found) == 2:
            continue
        names = [surface.names[face] for face, _ in found]
        where = f"the edge between {surface.vertex(a)} and {surface.vertex(b)}"
        if len(found) == 1:
            cause, fix = f"open: {where} has no second face", "add the face that is missing"
            problems.append(FaceProblem(names[0], cause, fix))
        else:
            joined = f"{len(found)} faces ({', '.join(names)})"
            cause = f"{where} joins {joined}; a solid has 2 at each edge"
            problems.append(FaceProblem(names[0], cause, "separate them there, or leave one out"))
    problems += [
        FaceProblem("", f"{surface.vertex(int(v))} belongs to no face", "remove it, or use it")
        for v in np.setdiff1d(np.arange(len(surface.vertices)), np.unique(list(users)))
    ]
    if problems:
        return problems
    problems = _orientation_problems(surface, users)
    return problems or _fan_problems(surface) or _shell_problems(surface, users)


def _orientation_problems(surface: Surface, users: Users) -> list[FaceProblem]:
    """Name the faces that run against the majority of their shell."""
    neighbours: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for (f, forward), (g, same) in users.values():
        neighbours[f].append((g, forward == same))
        neighbours[g].append((f, forward == same))
    turned: dict[int, bool] = {}
    problems = []
    for seed in range(len(surface.faces)):
        if seed in turned:
            continue
        turned[seed] = False
        shell = [seed]
        for face in shell:
            for other, against in neighbours[face]:
                wanted = turned[face] ^ against
                if other not in turned:
                    turned[other] = wanted
                    shell.append(other)
                elif turned[other] != wanted:
                    cause = "the surface has no outside: it turns over on the way round"
                    return [FaceProblem(surface.names[other], cause, "correct how its faces join")]
        minority = 2 * sum(turned[f] for f in shell) <= len(shell)
        for face in sorted(shell):
            if turned[face] == minority:
                cause = "it runs the other way round than its neighbours"
                fix = "reverse the order of its vertices"
                problems.append(FaceProblem(surface.names[face], cause, fix))
    return problems


def _fan_problems(surface: Surface) -> list[FaceProblem]:
    """Faces around a vertex must form one fan: rotate from edge to edge and count."""
    turn: dict[tuple[int, int], int] = {}  # (vertex, edge towards) -> next edge around the vertex
    degree: dict[int, int] = defaultdict(int)
    first: dict[int, int] = {}
    for loops in surface.faces:
        for loop in loops:
            for before, v, after in zip(
                (loop[-1], *loop[:-1]), loop, (*loop[1:], loop[0]), strict=True
            ):
                turn[v, after] = before
                degree[v] += 1
                first.setdefault(v, after)
    problems = []
    for v, start in first.items():
        steps, other = 1, turn[v, start]
        while other != start:
            steps, other = steps + 1, turn[v, other]
        if steps != degree[v]:
            cause = f"the solid touches itself at {surface.vertex(v)}"
            problems.append(FaceProblem("", cause, "move the parts apart or join them by more"))
    return problems


def _shell_problems(surface: Surface, users: Users) -> list[FaceProblem]:
    parent = list(range(len(surface.faces)))

    def root(face: int) -> int:
        while parent[face] != face:
            parent[face] = parent[parent[face]]
            face = parent[face]
        return face

    for (f, _), (g, _) in users.values():
        parent[root(f)] = root(g)
    shells = {root(f): surface.names[f] for f in reversed(range(len(parent)))}
    if len(shells) == 1:
        return []
    starts = ", ".join(list(shells.values())[::-1][:LISTED])
    cause = f"{len(shells)} separate shells (they start at faces {starts}); one solid has one"
    return [FaceProblem("", cause, "give each body a file of its own, and fill inner voids")]


def face_problems(surface: Surface) -> list[FaceProblem]:
    """Return what is wrong with single faces: repeated points, slivers, bends, crossings."""
    tolerance = CLOSENESS * surface.size
    problems = _duplicate_vertices(surface, tolerance)
    if problems:
        return problems  # every other measure would only repeat it
    for name, loops in zip(surface.names, surface.faces, strict=True):
        problems += _loop_problems(surface, name, loops, tolerance)
    return problems


def crossing_problems(surface: Surface) -> list[FaceProblem]:
    """Return the faces that are cut or touched by edges and vertices that are not their own."""
    tolerance = CLOSENESS * surface.size
    vertices, problems = surface.vertices, []
    edges = np.array(sorted({(min(e), max(e)) for f in surface.faces for e in directed_edges(f)}))
    move = "move it away, or join the faces there"
    for name, loops in zip(surface.names, surface.faces, strict=True):
        own = np.zeros(len(vertices), dtype=bool)
        own[[v for loop in loops for v in loop]] = True
        sides = {(min(edge), max(edge)) for edge in directed_edges(loops)}
        x, y, z = face_axes(vertices, loops)
        chords = [(v, w) for v, w in edges[own[edges].all(axis=1)].tolist() if (v, w) not in sides]
        if chords:  # edges of other faces between two vertices of this one
            middle = vertices[np.array(chords)].mean(axis=1)
            *polygon, middle = flat_loops(vertices, loops, x, y, middle)
            for v, w in np.array(chords)[side_of_polygon(polygon, middle) > 0]:
                cause = f"the edge between vertices {v} and {w} of other faces lies on it"
                problems.append(FaceProblem(name, cause, move))
        height = (vertices - vertices[loops[0][0]]) @ z
        height[own] = 0.0
        if height.max() <= tolerance and not (np.abs(height[~own]) <= tolerance).any():
            continue  # of a convex solid no vertex is in front of any face
        touching = np.flatnonzero(~own & (np.abs(height) <= tolerance))
        a, b = height[edges[:, 0]], height[edges[:, 1]]
        cut = np.flatnonzero((np.minimum(a, b) < -tolerance) & (np.maximum(a, b) > tolerance))
        t = a[cut] / (a[cut] - b[cut])
        start, end = vertices[edges[cut, 0]], vertices[edges[cut, 1]]
        point = start + t[:, None] * (end - start)
        *polygon, near, through = flat_loops(vertices, loops, x, y, vertices[touching], point)
        for v in touching[_in_widened_polygon(polygon, near, tolerance)]:
            cause = f"{surface.vertex(int(v))} of another face lies on it"
            problems.append(FaceProblem(name, cause, move))
        for k in np.flatnonzero(_in_widened_polygon(polygon, through, tolerance)):
            v, w = edges[cut[k]]
            cause = f"the edge between vertices {v} and {w} runs through it at {_point(point[k])}"
            problems.append(FaceProblem(name, cause, "a solid must not cut through itself"))
    return problems


def _duplicate_vertices(surface: Surface, tolerance: float) -> list[FaceProblem]:
    vertices, problems = surface.vertices, []
    order = np.argsort(vertices[:, 0], kind="stable")
    x = vertices[order, 0]
    last = np.searchsorted(x, x + tolerance, side="right")
    for i in np.flatnonzero(last > np.arange(len(x)) + 1):
        near = order[i + 1 : last[i]]
        for j in near[np.linalg.norm(vertices[near] - vertices[order[i]], axis=1) <= tolerance]:
            a, b = sorted((int(order[i]), int(j)))
            cause = (
                f"{surface.vertex(a)} and vertex {b} are the same point within {tolerance:.2g} mm"
            )
            problems.append(FaceProblem("", cause, f"use vertex {a} for both"))
    return problems


def _loop_problems(
    surface: Surface, name: str, loops: Loops, tolerance: float
) -> list[FaceProblem]:
    for loop in loops:
        if len(set(loop)) < len(loop):
            twice = next(v for k, v in enumerate(loop) if v in loop[:k])
            cause = f"its loop visits {surface.vertex(twice)} twice"
            fix = "a loop must not touch itself; split the face there"
            return [FaceProblem(name, cause, fix)]
    vertices = surface.vertices
    outer = vertices[list(loops[0])]
    normal = area_vector(outer)
    area = float(np.sqrt(normal @ normal))
    longest = float(np.sqrt(((np.roll(outer, -1, axis=0) - outer) ** 2).sum(axis=1).max()))
    order = "list its vertices in the order in which the edge runs"
    if area <= longest * tolerance:  # a loop that crosses itself, or a sliver
        spread = np.linalg.svd(outer - outer.mean(axis=0), compute_uv=False)
        if spread[1] > tolerance:
            cause = f"its loop crosses itself: the parts of its area cancel to {area:.2g} mm^2"
            return [FaceProblem(name, cause, order)]
        fix = "remove it and join its neighbours, or correct its vertices"
        return [FaceProblem(name, f"its area is {area:.2g} mm^2: a line, not a face", fix)]
    every = [v for loop in loops for v in loop]
    x, y, z = face_axes(vertices, loops)
    height = (vertices[every] - outer.mean(axis=0)) @ z
    worst = int(np.abs(height).argmax())
    allowed = PLANARITY * surface.size
    if abs(height[worst]) > allowed:
        cause = (
            f"not planar: its vertices lie up to {abs(height[worst]):.3g} mm off their plane, "
            f"{allowed:.2g} mm is allowed; the farthest is {surface.vertex(every[worst])}"
        )
        fix = "correct the coordinates or split the face into triangles"
        return [FaceProblem(name, cause, fix)]
    polygon = flat_loops(vertices, loops, x, y)
    if len(polygon) == 1 and is_convex(polygon[0]):
        return []
    gap, i, j = closest_pair(polygon)
    if gap > tolerance:
        return _hole_problems(name, polygon)
    edges = list(directed_edges(loops))
    (a, b), (c, d) = edges[i], edges[j]
    cause = f"its edges {a}-{b} and {c}-{d} cross or touch near {_point(vertices[a])}"
    return [FaceProblem(name, cause, order)]


def _hole_problems(name: str, polygon: Sequence[Vertices]) -> list[FaceProblem]:
    problems = []
    for k, hole in enumerate(polygon[1:], start=1):
        others = [loop for i, loop in enumerate(polygon) if i not in (0, k)]
        if side_of_polygon(polygon[:1], hole[:1])[0] < 0:
            cause, fix = f"hole {k} lies outside it", "list the outer loop first"
        elif any(side_of_polygon([loop], hole[:1])[0] > 0 for loop in others):
            cause, fix = f"hole {k} lies inside another hole", "make it a face of its own"
        elif signed_area(hole) > 0:
            cause = f"hole {k} runs counter-clockwise where the outer loop does"
            fix = "reverse the order of its vertices"
        else:
            continue
        problems.append(FaceProblem(name, cause, fix))
    return problems


def _in_widened_polygon(
    polygon: Sequence[Vertices], points: Vertices, tolerance: float
) -> NDArray[np.bool_]:
    """Whether points lie in a polygon, its boundary widened by the tolerance."""
    if len(points) == 0:
        return np.zeros(0, dtype=bool)
    inside = side_of_polygon(polygon, points) >= 0
    return inside | (distance(points, polygon) <= tolerance)


def _point(point: Vertices) -> str:
    return "({:.6g}, {:.6g}, {:.6g})".format(*point)
