"""What every face must be, and that faces keep clear of each other.

Checked: duplicate vertices, slivers, planarity, loops that cross or touch themselves, holes
outside their face, faces that cut through others. Nothing is repaired here. Thesis 6.3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.plane.polygon import (
    area_vector,
    closest_pair,
    is_convex,
    plane_axes,
    side_of_polygon,
    signed_area,
)
from generator.plane.rings import distance
from generator.polyhedron.settings import SOLID
from generator.polyhedron.surface import (
    FaceProblem,
    Loops,
    Surface,
    Vertices,
    directed_edges,
    face_axes,
)


def face_problems(surface: Surface) -> list[FaceProblem]:
    """Return what is wrong with single faces: repeated points, slivers, bends, crossings."""
    tolerance = SOLID.closeness * surface.size
    problems = _duplicate_vertices(surface, tolerance)
    if problems:
        return problems  # every other measure would only repeat it
    for name, loops in zip(surface.names, surface.faces, strict=True):
        problems += _loop_problems(surface, name, loops, tolerance)
    return problems


def crossing_problems(surface: Surface) -> list[FaceProblem]:
    """Return the faces that are cut or touched by edges and vertices that are not their own.

    A convex solid has no vertex in front of any face and is done after one product.
    """
    tolerance = SOLID.closeness * surface.size
    vertices, problems = surface.vertices, []
    edges = np.array(sorted({(min(e), max(e)) for f in surface.faces for e in directed_edges(f)}))
    for name, loops in zip(surface.names, surface.faces, strict=True):
        own = np.zeros(len(vertices), dtype=bool)
        own[[v for loop in loops for v in loop]] = True
        origin = vertices[loops[0][0]]
        x, y, z = face_axes(vertices, loops)
        problems += _chord_problems(surface, name, loops, edges[own[edges].all(axis=1)])
        height = (vertices - origin) @ z
        height[own] = 0.0
        if height.max() <= tolerance and not (np.abs(height[~own]) <= tolerance).any():
            continue
        axes = np.stack([x, y], axis=1)
        polygon = [(vertices[list(loop)] - origin) @ axes for loop in loops]
        touching = np.flatnonzero(~own & (np.abs(height) <= tolerance))
        for v in touching[
            _in_widened_polygon(polygon, (vertices[touching] - origin) @ axes, tolerance)
        ]:
            cause = f"{surface.vertex(int(v))} of another face lies on it"
            problems.append(FaceProblem(name, cause, "move it away, or join the faces there"))
        a, b = height[edges[:, 0]], height[edges[:, 1]]
        cut = np.flatnonzero((np.minimum(a, b) < -tolerance) & (np.maximum(a, b) > tolerance))
        t = a[cut] / (a[cut] - b[cut])
        start, end = vertices[edges[cut, 0]], vertices[edges[cut, 1]]
        point = start + t[:, None] * (end - start)
        for k in np.flatnonzero(_in_widened_polygon(polygon, (point - origin) @ axes, tolerance)):
            v, w = edges[cut[k]]
            cause = f"the edge between vertices {v} and {w} runs through it at {_point(point[k])}"
            problems.append(FaceProblem(name, cause, "a solid must not cut through itself"))
    return problems


def _chord_problems(
    surface: Surface, name: str, loops: Loops, joined: NDArray[np.intp]
) -> list[FaceProblem]:
    """Find edges of other faces between two vertices of this one that lie on it."""
    own = {(min(edge), max(edge)) for edge in directed_edges(loops)}
    chords = [(int(v), int(w)) for v, w in joined if (v, w) not in own]
    if not chords:
        return []
    origin = surface.vertices[loops[0][0]]
    axes = np.stack(face_axes(surface.vertices, loops)[:2], axis=1)
    polygon = [(surface.vertices[list(loop)] - origin) @ axes for loop in loops]
    middle = surface.vertices[np.array(chords)].mean(axis=1)
    inside = side_of_polygon(polygon, (middle - origin) @ axes) > 0
    fix = "move it away, or join the faces there"
    return [
        FaceProblem(name, f"the edge between vertices {v} and {w} of other faces lies on it", fix)
        for (v, w), hit in zip(chords, inside, strict=True)
        if hit
    ]


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
            return [
                FaceProblem(
                    name,
                    f"its loop visits {surface.vertex(twice)} twice",
                    "a loop must not touch itself; split the face there",
                )
            ]
    vertices = surface.vertices
    outer = vertices[list(loops[0])]
    normal = area_vector(outer)
    area = float(np.sqrt(normal @ normal))
    longest = float(np.sqrt(((np.roll(outer, -1, axis=0) - outer) ** 2).sum(axis=1).max()))
    if area <= longest * tolerance:
        return [_no_area(name, outer, area, tolerance)]
    x, y, z = plane_axes(normal, outer[1] - outer[0])
    every = [v for loop in loops for v in loop]
    height = (vertices[every] - outer.mean(axis=0)) @ z
    worst = int(np.abs(height).argmax())
    allowed = SOLID.planarity * surface.size
    if abs(height[worst]) > allowed:
        return [
            FaceProblem(
                name,
                f"not planar: its vertices lie up to {abs(height[worst]):.3g} mm off their plane, "
                f"{allowed:.2g} mm is allowed; the farthest is {surface.vertex(every[worst])}",
                "correct the coordinates or split the face into triangles",
            )
        ]
    axes = np.stack([x, y], axis=1)
    polygon = [(vertices[list(loop)] - outer[0]) @ axes for loop in loops]
    if len(polygon) == 1 and is_convex(polygon[0]):
        return []
    gap, i, j = closest_pair(polygon)
    if gap <= tolerance:
        edges = list(directed_edges(loops))
        cause = (
            f"its edges {_edge(edges[i])} and {_edge(edges[j])} cross or touch "
            f"near {_point(vertices[edges[i][0]])}"
        )
        return [FaceProblem(name, cause, "list its vertices in the order in which the edge runs")]
    return _hole_problems(name, polygon)


def _no_area(name: str, outer: Vertices, area: float, tolerance: float) -> FaceProblem:
    """Tell a loop that crosses itself from a sliver."""
    spread = np.linalg.svd(outer - outer.mean(axis=0), compute_uv=False)
    if spread[1] > tolerance:
        fix = "list its vertices in the order in which the edge runs"
        return FaceProblem(
            name, f"its loop crosses itself: the parts of its area cancel to {area:.2g} mm^2", fix
        )
    fix = "remove it and join its neighbours, or correct its vertices"
    return FaceProblem(name, f"its area is {area:.2g} mm^2: a line, not a face", fix)


def _hole_problems(name: str, polygon: list[Vertices]) -> list[FaceProblem]:
    problems = []
    for k, hole in enumerate(polygon[1:], start=1):
        others = [loop for i, loop in enumerate(polygon) if i not in (0, k)]
        if side_of_polygon(polygon[:1], hole[:1])[0] < 0:
            problems.append(
                FaceProblem(name, f"hole {k} lies outside it", "list the outer loop first")
            )
        elif any(side_of_polygon([loop], hole[:1])[0] > 0 for loop in others):
            problems.append(
                FaceProblem(name, f"hole {k} lies inside another hole", "make it a face of its own")
            )
        elif signed_area(hole) > 0:
            problems.append(
                FaceProblem(
                    name,
                    f"hole {k} runs counter-clockwise where the outer loop does",
                    "reverse the order of its vertices",
                )
            )
    return problems


def _in_widened_polygon(
    polygon: list[Vertices], points: Vertices, tolerance: float
) -> NDArray[np.bool_]:
    """Whether points lie in a polygon, its boundary widened by the tolerance."""
    if len(points) == 0:
        return np.zeros(0, dtype=bool)
    inside = side_of_polygon(polygon, points) >= 0
    return inside | (distance(points, polygon) <= tolerance)


def _edge(edge: tuple[int, int]) -> str:
    return f"{edge[0]}-{edge[1]}"


def _point(point: Vertices) -> str:
    return "({:.6g}, {:.6g}, {:.6g})".format(*point)
