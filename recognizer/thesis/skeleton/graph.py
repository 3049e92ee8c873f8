"""Skeleton -> graph: nodes where it ends or branches, branches along its pixels. Thesis 6.1.

A thinned component is one pixel wide, but its pixels still touch in more ways than its lines
do. Two pixels are neighbours here if they share a side, or a corner and no pixel beside both;
then a pixel with one neighbour is an end, one with two is passed through, and pixels with
three or more, together with those of their kind next to them, are one junction. Branches that
end after less than a given length are spurs of the thinning and are pruned, shortest first.
Pixels: (row, column).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Pixel = tuple[int, int]
Path = list[tuple[float, float]]
_SIDES = ((0, 1), (1, 0), (0, -1), (-1, 0))
_CORNERS = ((1, 1), (1, -1), (-1, -1), (-1, 1))


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
        """Return how many lines leave a node."""
        return sum((b.start == node) + (b.end == node) for b in self.branches)


def graph(skeleton: NDArray[np.bool_], shortest: float = 0.0) -> Graph:
    """Return the graph of a connected skeleton.

    Parameters
    ----------
    skeleton
        (h, w) one pixel wide.
    shortest
        Length, pixels, that a branch with a free end must have; shorter ones are pruned.
    """
    pixels = [(int(r), int(c)) for r, c in np.argwhere(skeleton)]
    near = _neighbours(set(pixels))
    node_of, places = _nodes(pixels, near)
    branches = _branches(near, node_of, places)
    return _prune_spurs(places, branches, shortest)


def length(path: Path) -> float:
    """Return the length of a path, pixels."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise(path))


def _neighbours(pixels: set[Pixel]) -> dict[Pixel, list[Pixel]]:
    near: dict[Pixel, list[Pixel]] = {}
    for r, c in pixels:
        found = [(r + i, c + j) for i, j in _SIDES if (r + i, c + j) in pixels]
        for i, j in _CORNERS:
            beside = (r + i, c) in pixels or (r, c + j) in pixels
            if not beside and (r + i, c + j) in pixels:
                found.append((r + i, c + j))
        near[r, c] = found
    return near


def _nodes(
    pixels: list[Pixel], near: dict[Pixel, list[Pixel]]
) -> tuple[dict[Pixel, int], dict[int, tuple[float, float]]]:
    """Return the node of every pixel that is one, and where nodes lie."""
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


def _prune_spurs(
    places: dict[int, tuple[float, float]], branches: list[Branch], shortest: float
) -> Graph:
    found = Graph(places, tuple(branches))
    while True:
        spurs = [
            (length(branch.path), k)
            for k, branch in enumerate(found.branches)
            if sorted(min(found.degree(n), 3) for n in (branch.start, branch.end)) == [1, 3]
        ]
        if not spurs or min(spurs)[0] >= shortest:
            return found
        found = _remove_branch(found, min(spurs)[1])


def _remove_branch(graph: Graph, number: int) -> Graph:
    """Return the graph without a branch, its free end, and the node that it joined, if passed."""
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
    """Return two branches as one, through the node that they share."""
    if a.end != node:
        a = Branch(a.end, a.start, a.path[::-1])
    if b.start != node:
        b = Branch(b.end, b.start, b.path[::-1])
    return Branch(a.start, b.end, a.path + b.path[1:])
