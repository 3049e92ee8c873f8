"""End-points and vertices: of a skeleton, and of the glyph it should be. Thesis 6.1, 6.2.

A vertex is a junction of lines or a corner of one. Corners are where a line, replaced by as
few straight pieces as stay near it (Douglas and Peucker), turns; vertices closer together
than half a lattice unit are one that thinning has pulled apart.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from generator.alphabet import Glyph
from recognizer.thesis.settings import ROUNDING, CountingSettings
from recognizer.thesis.skeleton.graph import Path, graph

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class KeyPoints:
    """What symbols are told apart by."""

    ends: Array  #: (e, 2)
    vertices: Array  #: (v, 2)
    loops: int

    @property
    def counts(self) -> tuple[int, int, int]:
        """End-points, vertices and closed loops."""
        return len(self.ends), len(self.vertices), self.loops


def points_of_skeleton(
    skeleton: NDArray[np.bool_], unit: float, counting: CountingSettings
) -> KeyPoints:
    """Return the end-points and vertices, (row, column), of a connected skeleton.

    Parameters
    ----------
    unit
        The alphabet's lattice unit, pixels.
    """
    found = graph(skeleton, counting.spur * unit)
    ends = [at for node, at in found.nodes.items() if found.degree(node) == 1]
    vertices = [at for node, at in found.nodes.items() if found.degree(node) > 2]
    for branch in found.branches:
        free = [found.degree(node) == 1 for node in (branch.start, branch.end)]
        inner = _without_hooks(branch.path, free, counting.hook * unit)
        vertices += _corners(inner, counting.bow * unit, counting.turn_rad)
    loops = len(found.branches) - len(found.nodes) + 1
    merged = _merge_points(vertices, counting.near * unit)
    return KeyPoints(_stack_points(ends), _stack_points(merged), loops)


def points_of_glyph(glyph: Glyph) -> KeyPoints:
    """Return the end-points and vertices, (x, y) in lattice units, of a stroke graph."""
    strokes = [(complex(*a), complex(*b)) for a, b in glyph.strokes]
    places = {end for stroke in strokes for end in stroke}
    for one, other in itertools.combinations(strokes, 2):
        places |= _crossing_points(one, other)
    ends, vertices = [], []
    spokes = 0
    for at in sorted(places, key=lambda z: (z.real, z.imag)):
        leaving = {
            _round_complex((to - at) / abs(to - at))
            for a, b in strokes
            if _on_segment(at, a, b)
            for to in (a, b)
            if abs(to - at) > ROUNDING.lattice
        }
        spokes += len(leaving)
        straight = len(leaving) == 2 and abs(sum(leaving)) < ROUNDING.lattice
        if len(leaving) == 1:
            ends.append((at.real, at.imag))
        elif not straight:
            vertices.append((at.real, at.imag))
    return KeyPoints(_stack_points(ends), _stack_points(vertices), spokes // 2 - len(places) + 1)


def _corners(path: Path, bow: float, turn_rad: float) -> Path:
    require("skimage", extra="thesis", purpose="the thesis's reading")
    from skimage.measure import approximate_polygon

    pieces = approximate_polygon(np.array(path), bow)
    steps = np.diff(pieces, axis=0)
    found = []
    for k in range(1, len(pieces) - 1):
        (a, b), (c, d) = steps[k - 1], steps[k]
        if abs(math.atan2(a * d - b * c, a * c + b * d)) > turn_rad:
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


def _crossing_points(one: tuple[complex, complex], other: tuple[complex, complex]) -> set[complex]:
    (a, b), (c, d) = one, other
    u, v, w = b - a, d - c, c - a
    cross = (u.conjugate() * v).imag
    if abs(cross) < ROUNDING.lattice:
        return set()
    at = a + u * (w.conjugate() * v).imag / cross
    inside = _on_segment(at, a, b) and _on_segment(at, c, d)
    return {_round_complex(at)} if inside else set()


def _on_segment(at: complex, a: complex, b: complex) -> bool:
    return abs(at - a) + abs(b - at) < abs(b - a) + ROUNDING.lattice


def _round_complex(z: complex) -> complex:
    return complex(round(z.real, 9) + 0.0, round(z.imag, 9) + 0.0)


def _stack_points(points: Path) -> Array:
    return np.array(points, np.float64).reshape(-1, 2)
