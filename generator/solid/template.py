"""One symbol as points and triangles, to be stamped at every centre with its label."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.solid.polygon import triangulate_rings

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class SymbolSolid:
    """Points in the symbol's axes, tier after tier and ring after ring, and its triangles."""

    points: NDArray[np.float64]  #: (k, 3) mm
    own: Index  #: (m, 3) points: sides and top; with the foot where the symbol is a solid
    base: Index  #: (b, 3) of the four corners of the square (0-3) and points (from 4): the facet
    foot: tuple[Index, ...]  #: points of each ring in the facet


@lru_cache(maxsize=256)  # some 10 KB each
def template_of(tiers: Tiers, pitch_mm: float) -> SymbolSolid:
    """Return the template of a symbol on a facet.

    With a pitch it brings the facet inside its lattice square along, corners
    counter-clockwise from the lower left; with pitch 0 the foot is cut out of the facet.
    """
    points, rings = _number_points(tiers)
    base = np.zeros((0, 3), dtype=np.int64)
    if pitch_mm > 0:
        h = pitch_mm / 2
        square = np.array([[-h, -h], [h, -h], [h, h], [-h, h]])
        foot = [ring[::-1] for ring in tiers.rings[0]]
        numbers = [np.arange(4), *(4 + ring[::-1] for ring in rings[0])]
        base = triangulate_rings([square, *foot], np.concatenate(numbers), "a symbol's square")
    own = np.concatenate([_sides(rings), _top(tiers, rings)])
    return SymbolSolid(points, own, base, tuple(rings[0]))


@lru_cache(maxsize=256)
def closed_template(tiers: Tiers) -> SymbolSolid:
    """Return the template of a symbol as a solid of its own, with its foot as a bottom."""
    points, rings = _number_points(tiers)
    bottom = triangulate_rings(tiers.rings[0], np.concatenate(rings[0]), "a symbol's foot")[:, ::-1]
    own = np.concatenate([_sides(rings), _top(tiers, rings), bottom])
    return SymbolSolid(points, own, np.zeros((0, 3), dtype=np.int64), tuple(rings[0]))


def _number_points(tiers: Tiers) -> tuple[NDArray[np.float64], list[list[Index]]]:
    """Return all points, and the numbers of each tier's rings."""
    points, numbers, count = [], [], 0
    for z, rings in zip(tiers.z_mm, tiers.rings, strict=True):
        tier = []
        for ring in rings:
            points.append(np.c_[ring, np.full(len(ring), z)])
            tier.append(np.arange(count, count + len(ring)))
            count += len(ring)
        numbers.append(tier)
    return np.concatenate(points), numbers


def _sides(numbers: list[list[Index]]) -> Index:
    """Return the triangles between neighbouring tiers; the same order rises and falls."""
    found = []
    for lower, upper in itertools.pairwise(numbers):
        for a, b in zip(lower, upper, strict=True):
            ahead_a, ahead_b = np.roll(a, -1), np.roll(b, -1)
            found += [np.stack([a, ahead_a, ahead_b], 1), np.stack([a, ahead_b, b], 1)]
    return np.concatenate(found)


def _top(tiers: Tiers, numbers: list[list[Index]]) -> Index:
    """Return the triangles of the last tier."""
    return triangulate_rings(tiers.rings[-1], np.concatenate(numbers[-1]), "a symbol's top")
