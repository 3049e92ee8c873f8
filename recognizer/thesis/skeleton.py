"""Skeleton of ink -> graph -> end-points and vertices. Thesis 6.1, 6.2.

A thinned component is one pixel wide, but its pixels still touch in more ways than its lines
do. Two pixels are neighbours here if they share a side, or a corner and no pixel next to both;
then a pixel with one neighbour is an end, one with two lies on a line, and pixels with three or
more, together with those of their kind next to them, are one junction. Branches that end after
less than a given length are spurs of the thinning and are pruned, shortest first. Pixels:
(row, column).

A vertex is a junction of lines or a corner of one. Corners are where a line, replaced by as
few straight pieces as stay near it (Douglas and Peucker), turns; vertices closer together
than half a lattice unit are one that thinning has pulled apart.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import SupportsFloat

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from generator.alphabet import Glyph, counts, key_points

Array = NDArray[np.float64]
Pixel = tuple[int, int]
Path = list[tuple[float, float]]
_SIDES = ((0, 1), (1, 0), (0, -1), (-1, 0))
_CORNERS = ((1, 1), (1, -1), (-1, -1), (-1, 1))

# In lattice units of the alphabet (reach x pitch)
SPUR = 0.4  #: shorter branches with a free end are pruned
HOOK = 0.3  #: of a free end, in which thinning may have bent the line
BOW = 0.16  #: how far a line may bow from a straight one
NEAR = 0.5  #: vertices nearer together are one

TURN_RAD = math.radians(40)  #: from which a bend is a corner


@dataclass(frozen=True, slots=True)
class KeyPoints:
    """End-points, vertices and loops of a symbol."""

    ends: Array  #: (e, 2)
    vertices: Array  #: (v, 2)
    loops: int

    @property
    def counts(self) -> tuple[int, int, int]:
        """End-points, vertices and closed loops."""
        return len(self.ends), len(self.vertices), self.loops


@dataclass(slots=True)
class Branch:
    """A line of the skeleton from node to node."""

    start: int
    end: int
    path: Path  #: with the places of both nodes


@dataclass(frozen=True, slots=True)
class Graph:
    """A component of a skeleton."""

    nodes: dict[int, tuple[float, float]]  #: places, rows and columns
    branches: tuple[Branch, ...]

    def degree(self, node: int) -> int:
        """Return the number of lines that leave a node."""
        return sum((b.start == node) + (b.end == node) for b in self.branches)


def points_of_skeleton(skeleton: NDArray[np.bool_], unit: float) -> KeyPoints:
    """Return the end-points and vertices, (row, column), of a connected skeleton.

    `unit` is the alphabet's lattice unit, pixels.
    """
    found = graph(skeleton, SPUR * unit)
    ends = [at for node, at in found.nodes.items() if found.degree(node) == 1]
    vertices = [at for node, at in found.nodes.items() if found.degree(node) > 2]
    for branch in found.branches:
        free = [found.degree(node) == 1 for node in (branch.start, branch.end)]
        inner = _without_hooks(branch.path, free, HOOK * unit)
        vertices += _corners(inner, BOW * unit)
    loops = len(found.branches) - len(found.nodes) + 1
    merged = _merge_points(vertices, NEAR * unit)
    return KeyPoints(_stack_points(ends), _stack_points(merged), loops)


@lru_cache(maxsize=256)
def points_of_glyph(glyph: Glyph) -> KeyPoints:
    """Return the end-points and vertices, (x, y) in lattice units, of a stroke graph."""
    ends, vertices = key_points(glyph)
    return KeyPoints(_stack_points(ends), _stack_points(vertices), counts(glyph).loops)


def graph(skeleton: NDArray[np.bool_], shortest: float = 0.0) -> Graph:
    """Return the graph of a connected skeleton (h, w).

    Branches with a free end that are shorter than `shortest`, pixels, are pruned.
    """
    pixels = [(r, c) for r, c in np.argwhere(skeleton).tolist()]
    near = _neighbours(set(pixels))
    node_of, places = _nodes(pixels, near)
    found = Graph(places, tuple(_branches(near, node_of, places)))
    while True:
        spurs = [
            (length(branch.path), k)
            for k, branch in enumerate(found.branches)
            if sorted(min(found.degree(n), 3) for n in (branch.start, branch.end)) == [1, 3]
        ]
        if not spurs or min(spurs)[0] >= shortest:
            return found
        found = _remove_branch(found, min(spurs)[1])


def length(path: Path) -> float:
    """Return the length of a path, pixels."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise(path))


def _neighbours(pixels: set[Pixel]) -> dict[Pixel, list[Pixel]]:
    near: dict[Pixel, list[Pixel]] = {}
    for r, c in pixels:
        found = [(r + i, c + j) for i, j in _SIDES if (r + i, c + j) in pixels]
        for i, j in _CORNERS:
            between = (r + i, c) in pixels or (r, c + j) in pixels
            if not between and (r + i, c + j) in pixels:
                found.append((r + i, c + j))
        near[r, c] = found
    return near


def _nodes(
    pixels: list[Pixel], near: dict[Pixel, list[Pixel]]
) -> tuple[dict[Pixel, int], dict[int, tuple[float, float]]]:
    """Return the node of every pixel that belongs to one, and the places of nodes."""
    node_of: dict[Pixel, int] = {}
    places: dict[int, tuple[float, float]] = {}
    for pixel in pixels:
        if pixel in node_of or len(near[pixel]) == 2:
            continue
        number, group = len(places), [pixel]
        node_of[pixel] = number
        if len(near[pixel]) > 2:
            for member in group:  # grows while it is read
                for other in near[member]:
                    if other not in node_of and len(near[other]) > 2:
                        node_of[other] = number
                        group.append(other)
        rows, columns = zip(*group, strict=True)
        places[number] = (sum(rows) / len(group), sum(columns) / len(group))
    if not places:  # a ring: cut it anywhere
        node_of[pixels[0]], places[0] = 0, (float(pixels[0][0]), float(pixels[0][1]))
    return node_of, places


def _branches(
    near: dict[Pixel, list[Pixel]],
    node_of: dict[Pixel, int],
    places: dict[int, tuple[float, float]],
) -> list[Branch]:
    branches: list[Branch] = []
    walked: set[tuple[Pixel, Pixel]] = set()
    for pixel, node in node_of.items():
        for first in near[pixel]:
            if node_of.get(first) == node or (pixel, first) in walked:
                continue
            path: Path = [places[node]]
            before, at = pixel, first
            while at not in node_of:
                path.append((float(at[0]), float(at[1])))
                before, at = at, next(p for p in near[at] if p != before)
            walked |= {(pixel, first), (at, before)}
            branches.append(Branch(node, node_of[at], [*path, places[node_of[at]]]))
    return branches


def _remove_branch(graph: Graph, number: int) -> Graph:
    """Return the graph without a branch, its free end, and a junction that has two lines left."""
    gone = graph.branches[number]
    rest = [b for k, b in enumerate(graph.branches) if k != number]
    left = Graph(graph.nodes, tuple(rest))
    for node in (gone.start, gone.end):
        if left.degree(node) == 2:
            joined = [b for b in rest if node in (b.start, b.end)]
            if len(joined) == 2:
                one, other = joined
                rest = [b for b in rest if b not in joined] + [_join_branches(one, other, node)]
    used = {b.start for b in rest} | {b.end for b in rest}
    return Graph({n: p for n, p in graph.nodes.items() if n in used}, tuple(rest))


def _join_branches(a: Branch, b: Branch, node: int) -> Branch:
    if a.end != node:
        a = Branch(a.end, a.start, a.path[::-1])
    if b.start != node:
        b = Branch(b.end, b.start, b.path[::-1])
    return Branch(a.start, b.end, a.path + b.path[1:])


def _corners(path: Path, bow: float) -> Path:
    require("skimage", extra="thesis", purpose="the thesis's reading")
    from skimage.measure import approximate_polygon

    pieces = approximate_polygon(np.array(path), bow)
    steps = np.diff(pieces, axis=0)
    found = []
    for k in range(1, len(pieces) - 1):
        (a, b), (c, d) = steps[k - 1], steps[k]
        if abs(math.atan2(a * d - b * c, a * c + b * d)) > TURN_RAD:
            found.append((float(pieces[k, 0]), float(pieces[k, 1])))
    return found


def _without_hooks(path: Path, free: list[bool], hook: float) -> Path:
    """Return a path without the last pixels at its free ends, length `hook` each."""
    for is_free in free:
        first, along = 0, 0.0
        while is_free and first < len(path) - 2 and along < hook:
            along += math.dist(path[first], path[first + 1])
            first += 1
        path = path[first:][::-1]
    return path


def _merge_points(points: Path, near: float) -> Path:
    """Return points, those closer together than `near` as their mean."""
    groups: list[Path] = []
    for point in points:
        touched = [g for g in groups if any(math.dist(point, other) < near for other in g)]
        groups = [g for g in groups if g not in touched] + [[point, *itertools.chain(*touched)]]
    return [(sum(p[0] for p in g) / len(g), sum(p[1] for p in g) / len(g)) for g in groups]


def _stack_points(points: Sequence[tuple[SupportsFloat, SupportsFloat]]) -> Array:
    return np.array(points, np.float64).reshape(-1, 2)
