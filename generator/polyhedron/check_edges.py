"""How faces must join to be a solid: numbers, edges, orientation, vertices, shells.

Every edge lies between exactly two faces that run it in opposite directions; around a
vertex they form one fan; all hang together. Nothing is repaired here. Thesis 6.3.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from generator.polyhedron.surface import LISTED, FaceProblem, Surface, directed_edges

Users = dict[tuple[int, int], list[tuple[int, bool]]]  # edge -> (face, runs upward in number)


def number_problems(surface: Surface) -> list[FaceProblem]:
    """Return what is wrong with counts, coordinates and indices; the rest needs these right."""
    vertices, problems = surface.vertices, []
    if len(vertices) < 4 or len(surface.faces) < 4:
        problems.append(
            FaceProblem(
                "",
                f"{len(vertices)} vertices and {len(surface.faces)} faces: a solid has at least "
                "4 of each",
                "give every vertex and every face",
            )
        )
    for number in np.flatnonzero(~np.isfinite(vertices).all(axis=1)):
        problems.append(
            FaceProblem(
                "", f"vertex {number} is not a point: {vertices[number]}", "give three lengths"
            )
        )
    for name, loops in zip(surface.names, surface.faces, strict=True):
        if not loops:
            problems.append(FaceProblem(name, "it has no vertices", "list at least 3 vertices"))
        for loop in loops:
            outside = [v for v in loop if not 0 <= v < len(vertices)]
            if outside:
                problems.append(
                    FaceProblem(
                        name,
                        f"there is no vertex {outside[0]}; they are 0 to {len(vertices) - 1}",
                        "count vertices from 0",
                    )
                )
            elif len(loop) < 3:
                problems.append(
                    FaceProblem(name, f"a loop of {len(loop)} vertices", "list at least 3 vertices")
                )
    return problems


def edge_problems(surface: Surface) -> list[FaceProblem]:
    """Return what is wrong with the way faces join: open, branching or reversed edges, shells."""
    users: Users = defaultdict(list)
    for face, loops in enumerate(surface.faces):
        for a, b in directed_edges(loops):
            users[min(a, b), max(a, b)].append((face, a < b))
    problems = [
        _edge_problem(surface, edge, faces) for edge, faces in users.items() if len(faces) != 2
    ]
    problems += [
        FaceProblem("", f"{surface.vertex(int(v))} belongs to no face", "remove it, or use it")
        for v in np.setdiff1d(np.arange(len(surface.vertices)), np.unique(list(users)))
    ]
    if problems:
        return problems
    problems = _orientation_problems(surface, users)
    return problems or _fan_problems(surface) or _shell_problems(surface, users)


def _edge_problem(
    surface: Surface, edge: tuple[int, int], users: list[tuple[int, bool]]
) -> FaceProblem:
    a, b = edge
    names = [surface.names[face] for face, _ in users]
    where = f"the edge between {surface.vertex(a)} and {surface.vertex(b)}"
    if len(users) == 1:
        return FaceProblem(
            names[0], f"open: {where} has no second face", "add the face that is missing"
        )
    cause = f"{where} joins {len(users)} faces ({', '.join(names)}); a solid has 2 at each edge"
    return FaceProblem(names[0], cause, "separate them there, or leave one out")


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
