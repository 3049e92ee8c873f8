"""Symbols as stroke graphs: what a finger or a skeleton counts.

A glyph is a set of straight strokes between nodes of a small integer lattice; x to
the right, y up, the symbol's centre at (0, 0). One lattice unit is `reach` times the
pitch. End-points, vertices and loops are computed from the strokes: strokes are split
where another one ends on them or crosses them, and a point where one stroke passes
straight through counts as nothing. Thesis 6.1 and 6.2, figures 6.4 and 6.12.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import combinations, pairwise
from math import gcd

from generator.errors import AlphabetError

Node = tuple[int, int]
Stroke = tuple[Node, Node]
Point = tuple[Fraction, Fraction]


@dataclass(frozen=True, slots=True)
class Glyph:
    """One symbol."""

    name: str
    strokes: tuple[Stroke, ...]  #: pairs of nodes, lattice units


@dataclass(frozen=True, slots=True)
class Counts:
    """What the thesis recognises a symbol by, and the number of closed loops."""

    ends: int
    vertices: int  #: corners and junctions
    loops: int
    pieces: int  #: connected components


def counts(glyph: Glyph) -> Counts:
    """Count end-points, vertices, loops and pieces of a glyph from its stroke graph.

    >>> counts(Glyph("L", (((-1, 1), (-1, -1)), ((-1, -1), (1, -1)))))
    Counts(ends=2, vertices=1, loops=0, pieces=1)
    """
    edges = _split(glyph.strokes)
    ends, vertices = key_points(glyph)
    nodes = {node for edge in edges for node in edge}
    pieces = _pieces(edges)
    return Counts(len(ends), len(vertices), len(edges) - len(nodes) + pieces, pieces)


def key_points(glyph: Glyph) -> tuple[list[Point], list[Point]]:
    """Return the end-points and the vertices of a glyph, from left to right, lattice units."""
    spokes: dict[Point, list[Point]] = {}
    for a, b in _split(glyph.strokes):
        spokes.setdefault(a, []).append((b[0] - a[0], b[1] - a[1]))
        spokes.setdefault(b, []).append((a[0] - b[0], a[1] - b[1]))
    ends = [at for at, out in sorted(spokes.items()) if len(out) == 1]
    vertices = [at for at, out in sorted(spokes.items()) if len(out) > 1 and not _is_straight(out)]
    return ends, vertices


def turn_glyph(glyph: Glyph, quarters: int) -> Glyph:
    """Return the glyph turned counter-clockwise by quarter turns about the symbol's centre."""
    strokes = glyph.strokes
    for _ in range(quarters % 4):
        strokes = tuple(((-ay, ax), (-by, bx)) for (ax, ay), (bx, by) in strokes)
    return Glyph(glyph.name, strokes)


def same_shape(one: Glyph, other: Glyph) -> bool:
    """Whether two glyphs cover the same points, up to a shift."""
    return _shape(one) == _shape(other)


@lru_cache(maxsize=16)
def check_distinguishable(alphabet: str, glyphs: tuple[Glyph, ...]) -> None:
    """Refuse glyphs in several pieces, and those that look like one of them after a turn.

    Thesis 6.1, demands (1) and (2): a symbol alone gives the orientation of the grid. Raises
    `AlphabetError`.
    """
    place = f"alphabet {alphabet}"
    names = [glyph.name for glyph in glyphs]
    if len(glyphs) < 2 or len(set(names)) < len(names):
        raise AlphabetError(
            f"{len(glyphs)} symbols named {', '.join(names)}",
            fix="give at least two symbols, each with a name of its own",
            place=place,
        )
    for glyph in glyphs:
        if not glyph.strokes or any(a == b for a, b in glyph.strokes):
            raise AlphabetError(
                f"symbol '{glyph.name}' has no stroke or one without length",
                fix="let every stroke join two different nodes",
                place=place,
            )
        if counts(glyph).pieces != 1:
            raise AlphabetError(
                f"symbol '{glyph.name}' falls into {counts(glyph).pieces} pieces",
                fix="join its strokes",
                place=place,
            )
        for quarters in (1, 2, 3):
            if same_shape(glyph, turn_glyph(glyph, quarters)):
                raise AlphabetError(
                    f"symbol '{glyph.name}' looks the same after {90 * quarters} degrees",
                    fix="make it unsymmetric under quarter turns",
                    place=place,
                )
    for one, other in combinations(glyphs, 2):
        for quarters in range(4):
            if same_shape(one, turn_glyph(other, quarters)):
                turn = f"turned by {90 * quarters} degrees" if quarters else "once more"
                raise AlphabetError(
                    f"symbol '{one.name}' is symbol '{other.name}' {turn}",
                    fix="change one of the two",
                    place=place,
                )


def _split(strokes: Iterable[Stroke]) -> set[tuple[Point, Point]]:
    """Split strokes where they meet; equal pieces are one; ends in order."""
    exact = [tuple((Fraction(x), Fraction(y)) for x, y in stroke) for stroke in strokes]
    pieces: set[tuple[Point, Point]] = set()
    for a, b in exact:
        along = {Fraction(0), Fraction(1)}
        for c, d in exact:
            along |= _meetings(a, b, c, d)
        points = [(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])) for t in sorted(along)]
        pieces |= {(min(p, q), max(p, q)) for p, q in pairwise(points)}
    return pieces


def _meetings(a: Point, b: Point, c: Point, d: Point) -> set[Fraction]:
    """Return where segment cd meets the open segment ab, as fractions of ab."""
    u = (b[0] - a[0], b[1] - a[1])
    v = (d[0] - c[0], d[1] - c[1])
    w = (c[0] - a[0], c[1] - a[1])
    cross = u[0] * v[1] - u[1] * v[0]
    if cross:
        t = (w[0] * v[1] - w[1] * v[0]) / cross
        s = (w[0] * u[1] - w[1] * u[0]) / cross
        return {t} if 0 < t < 1 and 0 <= s <= 1 else set()
    if w[0] * u[1] - w[1] * u[0]:
        return set()
    square = u[0] * u[0] + u[1] * u[1]
    ends = {((p[0] - a[0]) * u[0] + (p[1] - a[1]) * u[1]) / square for p in (c, d)}
    return {t for t in ends if 0 < t < 1}


def _is_straight(spokes: list[Point]) -> bool:
    """Whether a point is only passed through: two spokes in opposite directions."""
    if len(spokes) != 2:
        return False
    (ax, ay), (bx, by) = spokes
    return ax * by == ay * bx and ax * bx + ay * by < 0


def _pieces(edges: set[tuple[Point, Point]]) -> int:
    """Count connected components."""
    groups: list[set[Point]] = []
    for edge in edges:
        touched = [group for group in groups if group & set(edge)]
        groups = [group for group in groups if not group & set(edge)]
        groups.append(set(edge).union(*touched))
    return len(groups)


def _shape(glyph: Glyph) -> frozenset[tuple[Node, Node]]:
    """Return the steps between neighbouring lattice points that a glyph covers, shifted to 0."""
    steps: set[tuple[Node, Node]] = set()
    for (ax, ay), (bx, by) in glyph.strokes:
        n = gcd(bx - ax, by - ay)
        points = [(ax + (bx - ax) // n * k, ay + (by - ay) // n * k) for k in range(n + 1)]
        steps |= {(min(p, q), max(p, q)) for p, q in pairwise(points)}
    x0 = min(x for step in steps for x, _ in step)
    y0 = min(y for step in steps for _, y in step)
    return frozenset(((ax - x0, ay - y0), (bx - x0, by - y0)) for (ax, ay), (bx, by) in steps)
