"""Symbols on a round face -> facets of the part, with the feet cut out of the strip.

Every facet is planar: the strip's own ones less the feet, the tops piece by piece, the sides as
triangles. Cut points are made once and shared by number, so the part stays closed, which
`prove_closed` checks edge by edge. Object frame, mm. Thesis 6.3.

A point of the strip is (x, y) in the plane of its development and z above it. Facet i lies
between line i and line i + 1. At height z over a facet the strip is the facet's plane moved
outward by z; over a line it is where the moved planes of both neighbours meet. In between a point
is carried along by the share at which it lies between the two lines. A corner nearer to a line
than `NUDGE_MM` is moved to that distance, on its own side: no point lies on a line, no edge runs
along one, and no piece is thinner.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.errors import SolidError
from generator.layout.placement import FaceLayout
from generator.plane.polygon import points_inside, signed_area
from generator.polyhedron.development import Development, development
from generator.polyhedron.winged import Developable, Polyhedron
from generator.solid.part import Facet, WrappedSymbols, turn

Points = NDArray[np.float64]

NUDGE_MM = 0.005  #: far below what prints or is felt, far above the rounding of STL


@dataclass(frozen=True, slots=True)
class Strip:
    """A development with what is asked of it again and again."""

    development: Development
    right: Points  #: (n + 1, 2) unit normals of the lines, to the right

    @property
    def facets(self) -> int:
        """Number of facets."""
        return len(self.development.T_object_flat)

    def across(self, line: int, points: Points) -> Points:
        """Return how far points (k, 2) lie to the right of a line, mm."""
        distance: Points = (points - self.development.low[line]) @ self.right[line]
        return distance

    def along(self, line: int, points: Points) -> Points:
        """Return how far up a line points (k, 2) lie, from its lower end, mm."""
        up = self.development.high[line] - self.development.low[line]
        height: Points = (points - self.development.low[line]) @ (up / np.hypot(*up))
        return height

    def facet_of(self, point: Points) -> int:
        """Return the facet that holds a point (2,) of the plane; -1 where none does."""
        d = self.development
        offset = point - d.low
        side = (offset * self.right).sum(axis=1)
        up = d.high - d.low
        length = np.hypot(up[:, 0], up[:, 1])
        height = (offset * up).sum(axis=1) / length
        # Beyond the tip of a cone there is a mirror image of every facet; ends are not square.
        slack = np.abs(np.diff(d.low, axis=0)).max() + np.abs(np.diff(d.high, axis=0)).max()
        near = (height > -slack) & (height < length + slack)
        held = (side[:-1] >= 0.0) & (side[1:] < 0.0) & near[:-1]
        return int(np.argmax(held)) if held.any() else -1

    def lifted(self, facet: int, points: Points, z_mm: Points) -> Points:
        """Return points (k, 2) of a facet at heights (k,) on the solid, (k, 3) object frame."""
        d = self.development
        left, right = self.across(facet, points), -self.across(facet + 1, points)
        share = (left / (left + right))[:, None]
        bend = (1.0 - share) * d.bends[facet] + share * d.bends[facet + 1]
        T = d.T_object_flat[facet]
        lifted: Points = points @ T[:3, :2].T + T[:3, 3] + z_mm[:, None] * bend
        return lifted

    def lifted_line(self, line: int, points: Points, z_mm: Points) -> Points:
        """Return points (k, 2) on a line at heights (k,) on the solid, (k, 3) object frame."""
        d = self.development
        T = d.T_object_flat[min(line, self.facets - 1)]
        lifted: Points = points @ T[:3, :2].T + T[:3, 3] + z_mm[:, None] * d.bends[line]
        return lifted


def strip_of(development: Development) -> Strip:
    """Return the strip of a development."""
    up = development.high - development.low
    up = up / np.hypot(up[:, 0], up[:, 1])[:, None]
    return Strip(development, np.column_stack([up[:, 1], -up[:, 0]]))


Loop = tuple[int, ...]


def loops_of(edges: Sequence[tuple[int, int]], place: str) -> list[Loop]:
    """Return the loops that directed edges make.

    Raises `SolidError` if a point has not exactly one edge in and one out.
    """
    after = dict(edges)
    if len(after) != len(edges) or set(after) != set(after.values()):
        raise SolidError("the cut of a symbol does not close", place=place)
    loops = []
    while after:
        first, at = next(iter(after.items()))
        loop = [first]
        del after[first]
        while at != first:
            loop.append(at)
            at = after.pop(at)
        loops.append(tuple(loop))
    return loops


def with_holes(loops: Sequence[Loop], points: NDArray[np.float64]) -> list[tuple[Loop, ...]]:
    """Return each counter-clockwise loop with the clockwise ones in it; `points`: (k, 2)."""
    areas = [signed_area(points[list(loop)]) for loop in loops]
    outer = sorted((k for k, area in enumerate(areas) if area > 0), key=lambda k: areas[k])
    found: dict[int, list[Loop]] = {k: [loops[k]] for k in outer}
    for k, area in enumerate(areas):
        if area > 0:
            continue
        corner = points[list(loops[k][:1])]
        holder = next(  # the smallest that holds it
            (o for o in outer if points_inside(corner, [points[list(loops[o])]])[0]), None
        )
        if holder is None:
            raise SolidError("a hole lies outside of every outline")
        found[holder].append(loops[k])
    return [tuple(found[k]) for k in sorted(found)]


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


class Knife:
    """Cuts one symbol along the lines between facets; `place` names it in errors.

    `rings`: [tier][ring] (k, 2) in the plane, outer counter-clockwise, holes clockwise; `centre`
    (2,) of the symbol, inside a facet.
    """

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
        while first > 0 and strip.across(first, foot).min() < NUDGE_MM:
            first -= 1
        while last < strip.facets and strip.across(last, foot).max() > -NUDGE_MM:
            last += 1
        if strip.across(first, foot).min() <= 0.0 or strip.across(last, foot).max() >= 0.0:
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
        made.outline, made.crossed = self._outline(cycles[0])
        return made

    def _numbered(self, ring: Points, z: float) -> list[int]:
        """Add the corners of a ring; return their numbers."""
        ring = ring.copy()
        facet = np.full(len(ring), self.first)
        for line in self.lines:
            aside = self.strip.across(line, ring)
            least = np.maximum(np.abs(aside), NUDGE_MM)
            off = np.where(aside < 0.0, -least, least)
            ring += (off - aside)[:, None] * self.strip.right[line]
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
                one, two = self.strip.across(line, ends).tolist()
                share = one / (one - two)
                z = made.z_mm[start] + share * (made.z_mm[end] - made.z_mm[start])
                found.append(self._add(ends[0] + share * (ends[1] - ends[0]), z, -1, line))
            self.on_edge[start, end] = found
        return self.on_edge[start, end]

    def _cycle(self, corners: list[int]) -> list[int]:
        cycle = []
        for start, end in pairwise([*corners, corners[0]]):
            cycle += [start, *self._between(start, end)]
        return cycle

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

    def _outline(
        self, cycles: list[list[int]]
    ) -> tuple[dict[int, list[tuple[int, int]]], dict[int, list[int]]]:
        """Return the edges of cycles by facet, and the points where they cross lines by line."""
        edges: dict[int, list[tuple[int, int]]] = {}
        crossed: dict[int, list[int]] = {}
        for cycle in cycles:
            for start, end in pairwise([*cycle, cycle[0]]):
                edges.setdefault(self._facet_between(start, end), []).append((start, end))
            for number in cycle:
                if self.made.line[number] >= 0:
                    crossed.setdefault(self.made.line[number], []).append(number)
        return edges, crossed

    def _pieces(self, cycles: list[list[int]]) -> Iterator[tuple[int, tuple[Loop, ...]]]:
        """Yield the pieces of a level area."""
        made = self.made
        edges, crossed = self._outline(cycles)
        for line, numbers in crossed.items():
            ordered = up_the_line(self.strip, line, numbers, made.flat)
            for low, high in zip(ordered[::2], ordered[1::2], strict=True):
                edges.setdefault(line - 1, []).append((low, high))
                edges.setdefault(line, []).append((high, low))
        points = np.array(made.flat)
        for facet in sorted(edges):
            for loops in with_holes(loops_of(edges[facet], self.place), points):
                yield facet, loops


def up_the_line(
    strip: Strip, line: int, numbers: list[int], flat: Sequence[Points] | Mapping[int, Points]
) -> list[int]:
    """Return points of a line from the lowest to the highest."""
    heights = strip.along(line, np.array([flat[k] for k in numbers])).tolist()
    return [number for _, number in sorted(zip(heights, numbers, strict=True))]


@dataclass(slots=True)
class Body:
    """A body that symbols are wrapped onto, one round face after another."""

    vertices: list[Points]  #: blocks (k, 3) mm, object frame
    count: int  #: of vertices in them
    facets: list[Facet]  #: the first ones are the faces of the object, in their order
    wrapped: list[WrappedSymbols] = field(default_factory=list)


def wrapped_onto(
    body: Body,
    polyhedron: Polyhedron,
    surface: Developable,
    layout: FaceLayout,
    tiers: tuple[Tiers, ...],
) -> None:
    """Wrap the symbols of one round face onto the body, whose facets there are the polyhedron's.

    Raises `SolidError` if a symbol lies off the face, or a cut does not close.
    """
    strip = strip_of(development(polyhedron, surface))
    name = polyhedron.faces[surface.carrier].name
    R = turn(-layout.placement.rotation_rad)
    cuts, names, firsts = [], [], []
    for centre, label, row, column in zip(
        layout.centres_mm,
        layout.labels.tolist(),
        layout.rows.tolist(),
        layout.columns.tolist(),
        strict=True,
    ):
        symbol = f"r{row}c{column}"
        rings = [[ring @ R.T + centre for ring in tier] for tier in tiers[label].rings]
        cut = Knife(strip, rings, list(tiers[label].z_mm), centre, f"{name}/{symbol}").cut()
        cuts.append(cut)
        names.append(symbol)
        firsts.append(body.count)
        block = _lift(strip, cut)
        body.vertices.append(block)
        body.count += len(block)
    _cut_strip(body, strip, surface, cuts, firsts)
    _add_symbols(body, surface, name, names, cuts, firsts, np.asarray(layout.labels))


def _lift(strip: Strip, cut: CutSymbol) -> Points:
    flat, z = np.array(cut.flat), np.array(cut.z_mm)
    facet, line = np.array(cut.facet), np.array(cut.line)
    points = np.empty((len(flat), 3))
    for number in np.unique(facet[facet >= 0]).tolist():
        chosen = facet == number
        points[chosen] = strip.lifted(number, flat[chosen], z[chosen])
    for number in np.unique(line[line >= 0]).tolist():
        chosen = line == number
        points[chosen] = strip.lifted_line(number, flat[chosen], z[chosen])
    return points


def _cut_strip(
    body: Body, strip: Strip, surface: Developable, cuts: list[CutSymbol], firsts: list[int]
) -> None:
    """Cut the feet out of the strip's facets; a facet in several pieces gets more numbers."""
    d = strip.development
    flat: dict[int, Points] = {}
    edges: dict[int, list[tuple[int, int]]] = {}
    crossed: dict[int, list[int]] = {}
    for cut, first in zip(cuts, firsts, strict=True):
        flat |= {first + k: point for k, point in enumerate(cut.flat)}
        for facet, outline in cut.outline.items():
            edges.setdefault(facet, []).extend((first + b, first + a) for a, b in outline)
        for line, numbers in cut.crossed.items():
            crossed.setdefault(line, []).extend(first + k for k in numbers)
    rims = [  # the ends of a line have numbers of their own here, as a tip has several places
        {-2 - 2 * line: d.low[line], -3 - 2 * line: d.high[line]} for line in range(len(d.low))
    ]
    real = {key: int(d.vertices[k, j]) for k, rim in enumerate(rims) for j, key in enumerate(rim)}
    chains = []
    for line, rim in enumerate(rims):
        flat |= rim
        low, high = rim
        inner = up_the_line(strip, line, crossed[line], flat) if line in crossed else []
        chains.append([low, *inner, high])
    for number, facet in enumerate(surface.facets):
        if number not in edges and not {number, number + 1} & set(crossed):
            continue
        left, right = chains[number], chains[number + 1]
        own = list(edges.get(number, []))
        own += zip(right[::2], right[1::2], strict=True)
        own += [(b, a) for a, b in zip(left[::2], left[1::2], strict=True)]
        own.append((left[0], right[0]))
        top = (right[-1], left[-1])
        pointed = real[top[0]] == real[top[1]]
        own.append(top)
        plain = body.facets[facet]
        pieces = _named_pieces(own, flat, plain.name)
        if pointed:
            pieces = [tuple(_drop(loop, top[1]) for loop in loops) for loops in pieces]
        shown = [tuple(tuple(real.get(k, k) for k in loop) for loop in loops) for loops in pieces]
        body.facets[facet] = Facet(plain.name, shown[0])
        body.facets += [Facet(plain.name, loops) for loops in shown[1:]]


def _named_pieces(
    edges: list[tuple[int, int]], flat: dict[int, Points], place: str
) -> list[tuple[Loop, ...]]:
    """Return the pieces of a facet as loops of the points' own names."""
    names = sorted({k for edge in edges for k in edge})
    number = {name: k for k, name in enumerate(names)}
    points = np.array([flat[name] for name in names])
    loops = loops_of([(number[a], number[b]) for a, b in edges], place)
    return [
        tuple(tuple(names[k] for k in loop) for loop in piece)
        for piece in with_holes(loops, points)
    ]


def _drop(loop: Loop, number: int) -> Loop:
    return tuple(k for k in loop if k != number)


def _add_symbols(
    body: Body,
    surface: Developable,
    name: str,
    names: list[str],
    cuts: list[CutSymbol],
    firsts: list[int],
    labels: NDArray[np.int64],
) -> None:
    """Append sides and tops of all symbols, and note them with their feet."""
    start = len(body.facets)
    owners: list[int] = []
    feet: list[Facet] = []
    for symbol, (cut, first) in enumerate(zip(cuts, firsts, strict=True)):
        before = len(body.facets)
        full = f"{name}/{names[symbol]}"
        for _, piece in cut.sides:
            for triangle in _fan(piece):
                body.facets.append(Facet(f"{full}/side", (_shift(triangle, first),)))
        for _, loops in cut.tops:
            body.facets.append(Facet(f"{full}/top", tuple(_shift(k, first) for k in loops)))
        for _, loops in cut.feet:
            feet.append(Facet(full, tuple(_shift(k, first) for k in loops)))
        owners += [symbol] * (len(body.facets) - before)
    if not names:
        raise SolidError("a round face without symbols needs no wrapping", place=name)
    body.wrapped.append(
        WrappedSymbols(
            face=surface.carrier,
            facets=surface.facets,
            first=start,
            symbols=np.array(owners, dtype=np.int64),
            labels=labels,
            names=tuple(names),
            feet=tuple(feet),
        )
    )


def _fan(piece: Loop) -> list[Loop]:
    """Return the triangles of a convex piece, from its lowest numbered corner."""
    k = piece.index(min(piece))
    turned = piece[k:] + piece[:k]
    return [(turned[0], b, c) for b, c in pairwise(turned[1:])]


def _shift(loop: Loop, first: int) -> Loop:
    return tuple(first + k for k in loop)
