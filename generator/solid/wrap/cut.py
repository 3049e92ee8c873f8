"""A symbol in the plane of a strip, cut along the lines between its facets.

Tiers at their place -> the pieces of foot, sides and top on each facet. Every cut point is
made once and shared by all pieces that meet there, so the pieces close up as the symbol did.
A corner nearer to a line than `nudge_mm` is moved to that distance, on its own side: no
point lies on a line, no edge runs along one, and no piece is thinner. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from generator.errors import SolidError
from generator.solid.settings import EMBOSS
from generator.solid.wrap.strip import Points, Strip
from generator.solid.wrap.walk import Loop, loops_of, with_holes


@dataclass(slots=True)
class CutSymbol:
    """A symbol in pieces; points are numbered, pieces name them."""

    flat: list[Points] = field(default_factory=list)  #: (2,) in the plane
    z_mm: list[float] = field(default_factory=list)
    facet: list[int] = field(default_factory=list)  #: that a point lies in; -1 on a line
    line: list[int] = field(default_factory=list)  #: that a point lies on; -1 in a facet
    sides: list[tuple[int, Loop]] = field(default_factory=list)  #: facet, convex piece
    tops: list[tuple[int, tuple[Loop, ...]]] = field(default_factory=list)  #: facet, with holes
    feet: list[tuple[int, tuple[Loop, ...]]] = field(default_factory=list)
    outline: dict[int, list[tuple[int, int]]] = field(default_factory=dict)  #: foot, by facet
    crossed: dict[int, list[int]] = field(default_factory=dict)  #: line -> points of the foot


def cut_symbol(
    strip: Strip, rings: list[list[Points]], z_mm: list[float], centre: Points, place: str
) -> CutSymbol:
    """Cut a symbol.

    Parameters
    ----------
    strip
        The facets.
    rings
        [tier][ring] (k, 2) in the plane, outer counter-clockwise, holes clockwise.
    z_mm
        Height of each tier.
    centre
        (2,) of the symbol; inside a facet.
    place
        Names the symbol in errors.
    """
    return _Knife(strip, rings, z_mm, centre, place).cut()


class _Knife:
    """Cuts one symbol."""

    def __init__(
        self, strip: Strip, rings: list[list[Points]], z_mm: list[float], centre: Points, place: str
    ) -> None:
        self.strip, self.z_mm, self.place = strip, z_mm, place
        self.made = CutSymbol()
        home = strip.facet_of(centre)
        if home < 0:
            raise SolidError("a symbol lies beside its face", place=place)
        foot = np.concatenate([ring for tier in rings for ring in tier])
        first, last = home, home + 1  # lines around the symbol, neither of which it meets
        while first > 0 and strip.beside(first, foot).min() < EMBOSS.nudge_mm:
            first -= 1
        while last < strip.facets and strip.beside(last, foot).max() > -EMBOSS.nudge_mm:
            last += 1
        if strip.beside(first, foot).min() <= 0.0 or strip.beside(last, foot).max() >= 0.0:
            raise SolidError("a symbol reaches over the side of its face", place=place)
        self.first, self.lines = first, range(first + 1, last)
        self.points = [[self._numbered(ring, z) for ring in tier]
                       for tier, z in zip(rings, z_mm, strict=True)]  # fmt: skip
        self.on_edge: dict[tuple[int, int], list[int]] = {}

    def cut(self) -> CutSymbol:
        """Return all pieces."""
        made = self.made
        cycles = [[self._cycle(ring) for ring in tier] for tier in self.points]
        for lower, upper in pairwise(self.points):
            for a, b in zip(lower, upper, strict=True):
                for k in range(len(a)):
                    j = (k + 1) % len(a)
                    made.sides += self._convex([a[k], a[j], b[j], b[k]])
        made.tops = list(self._pieces(cycles[-1]))
        made.feet = list(self._pieces(cycles[0]))
        for cycle in cycles[0]:
            for start, end in self._edges(cycle):
                made.outline.setdefault(self._facet_between(start, end), []).append((start, end))
            for number in cycle:
                if made.line[number] >= 0:
                    made.crossed.setdefault(made.line[number], []).append(number)
        return made

    def _numbered(self, ring: Points, z: float) -> list[int]:
        """Add the corners of a ring; return their numbers."""
        ring = ring.copy()
        facet = np.full(len(ring), self.first)
        for line in self.lines:
            beside = self.strip.beside(line, ring)
            off = np.where(
                beside < 0.0,
                np.minimum(beside, -EMBOSS.nudge_mm),
                np.maximum(beside, EMBOSS.nudge_mm),
            )
            ring += (off - beside)[:, None] * self.strip.right[line]
            facet = np.where(off > 0.0, line, facet)
        first = len(self.made.flat)
        for point, number in zip(ring, facet.tolist(), strict=True):
            self._add(point, z, number, -1)
        return list(range(first, first + len(ring)))

    def _add(self, point: Points, z: float, facet: int, line: int) -> int:
        made = self.made
        made.flat.append(point)
        made.z_mm.append(z)
        made.facet.append(facet)
        made.line.append(line)
        return len(made.flat) - 1

    def _between(self, start: int, end: int) -> list[int]:
        """Return the points at which the edge from one corner to another meets lines."""
        if (end, start) in self.on_edge:
            return self.on_edge[end, start][::-1]
        if (start, end) not in self.on_edge:
            made = self.made
            a, b = made.facet[start], made.facet[end]
            lines = range(a + 1, b + 1) if a < b else range(a, b, -1)
            ends = np.array([made.flat[start], made.flat[end]])
            found = []
            for line in lines:
                one, two = self.strip.beside(line, ends).tolist()
                share = one / (one - two)
                z = made.z_mm[start] + share * (made.z_mm[end] - made.z_mm[start])
                found.append(self._add(ends[0] + share * (ends[1] - ends[0]), z, -1, line))
            self.on_edge[start, end] = found
        return self.on_edge[start, end]

    def _cycle(self, corners: list[int]) -> list[int]:
        """Return corners and cut points around a ring."""
        cycle = []
        for start, end in pairwise([*corners, corners[0]]):
            cycle += [start, *self._between(start, end)]
        return cycle

    def _edges(self, cycle: list[int]) -> Iterator[tuple[int, int]]:
        return pairwise([*cycle, cycle[0]])

    def _facet_between(self, start: int, end: int) -> int:
        """Return the facet that an uncut edge lies in."""
        made = self.made
        for number in (start, end):
            if made.facet[number] >= 0:
                return made.facet[number]
        return min(made.line[start], made.line[end])  # from line to line across one facet

    def _convex(self, corners: list[int]) -> list[tuple[int, Loop]]:
        """Return the pieces of a side, a convex quadrilateral when it stands."""
        made = self.made
        cycle = self._cycle(corners)
        facets = {made.facet[k] for k in corners}
        found = []
        for facet in range(min(facets), max(facets) + 1):
            piece = tuple(
                k for k in cycle if made.facet[k] == facet or made.line[k] in (facet, facet + 1)
            )
            for line in (facet, facet + 1):
                if sum(made.line[k] == line for k in piece) not in (0, 2):
                    raise SolidError("a side of a symbol is not convex", place=self.place)
            found.append((facet, piece))
        return found

    def _pieces(self, cycles: list[list[int]]) -> Iterator[tuple[int, tuple[Loop, ...]]]:
        """Yield the pieces of a level area."""
        made = self.made
        edges: dict[int, list[tuple[int, int]]] = {}
        crossed: dict[int, list[int]] = {}
        for cycle in cycles:
            for start, end in self._edges(cycle):
                edges.setdefault(self._facet_between(start, end), []).append((start, end))
            for number in cycle:
                if made.line[number] >= 0:
                    crossed.setdefault(made.line[number], []).append(number)
        for line, numbers in crossed.items():
            ordered = up_the_line(self.strip, line, numbers, made)
            for low, high in zip(ordered[::2], ordered[1::2], strict=True):
                edges.setdefault(line - 1, []).append((low, high))
                edges.setdefault(line, []).append((high, low))
        points = np.array(made.flat)
        for facet in sorted(edges):
            for loops in with_holes(loops_of(edges[facet], self.place), points):
                yield facet, loops


def up_the_line(strip: Strip, line: int, numbers: list[int], made: CutSymbol) -> list[int]:
    """Return points of a line from the lowest to the highest."""
    heights = strip.along(line, np.array([made.flat[k] for k in numbers])).tolist()
    return [number for _, number in sorted(zip(heights, numbers, strict=True))]
