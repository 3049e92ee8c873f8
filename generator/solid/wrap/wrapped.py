"""Symbols on a round face -> facets of the part, with the feet cut out of the strip.

Every facet that is made is planar: the strip's own ones less the feet, the tops piece by piece,
the sides as triangles. Points that pieces share have one number, so the part stays closed, which
`prove_closed` checks edge by edge. Object frame, mm. Thesis 6.3.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.errors import SolidError
from generator.layout.placement import FaceLayout
from generator.polyhedron.developable import Developable
from generator.polyhedron.development import development
from generator.polyhedron.winged import Polyhedron
from generator.solid.emboss import turn
from generator.solid.part import Facet, WrappedSymbols
from generator.solid.wrap.cut import CutSymbol, cut_symbol
from generator.solid.wrap.strip import Strip, strip_of
from generator.solid.wrap.walk import Loop, loops_of, with_holes

Points = NDArray[np.float64]


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
    """Wrap the symbols of one round face onto the body.

    Parameters
    ----------
    body
        Its facets of this face are still those of the polyhedron.
    polyhedron, surface
        The solid and its round face.
    layout
        Symbols of the face, in the plane of its development.
    tiers
        One outline per label.

    Raises
    ------
    SolidError
        A symbol lies beside the face, or a cut does not close.
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
        cut = cut_symbol(strip, rings, list(tiers[label].z_mm), centre, f"{name}/{symbol}")
        cuts.append(cut)
        names.append(symbol)
        firsts.append(body.count)
        block = _lift(strip, cut)
        body.vertices.append(block)
        body.count += len(block)
    _cut_strip(body, strip, surface, cuts, firsts)
    _add_symbols(body, surface, name, names, cuts, firsts, np.asarray(layout.labels))


def _lift(strip: Strip, cut: CutSymbol) -> Points:
    """Return the points of a symbol on the solid."""
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
        inner = crossed.get(line, [])
        if inner:
            heights = strip.along(line, np.array([flat[k] for k in inner])).tolist()
            inner = [k for _, k in sorted(zip(heights, inner, strict=True))]
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
