"""One symbol as a template of STEP entities: points, edges, sides, top.

Outlines with as many points share their entities, parts and files the directions; the references
of a template to its file are filled in for each file. The points are numbered tier by tier and
ring by ring. Point i is entity i of the template and its vertex entity n + i, so that the
coordinates of all symbols of one outline are filled in as one array. The footprint (the outer
ring of the first tier) is a bound of the facet. Engraved symbols have the same topology: with
falling z the vertex order turns the sides towards the cavity, outside the material.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.export.fixed_text import (
    DECIMAL,
    NAMES,
    NUMBER,
    TextTemplate,
    reference_field,
    template_of,
    with_references,
)
from generator.export.step.entities import Entities, unit, unit_text
from generator.solid.triangulate import number_rings, outline_points

KINDS = ("top", "side", "inside")  #: of a symbol's faces; "inside": the facet within a ring

_DIRECTION, _VECTOR, _STYLE = "direction", "vector", "style"  # of a file, that a symbol refers to
_AXIS, _SIDE, _FOOT, _EDGE = "axis", "side", "foot", "edge"  # along which: side's normal, its foot

_Referred = tuple[str, str, tuple[int, ...]]  # kind, along which, numbers of that
_Term = int | str  # a number of the template, or literal text such as "#100017"


@dataclass(frozen=True, slots=True)
class SymbolTemplate:
    """The entities of one symbol, numbered from 0."""

    template: TextTemplate
    entities: int  #: how many
    footprint: int  #: bound of the facet
    faces: NDArray[np.int64]
    coloured: NDArray[np.int64]  #: styled items


def symbol_entities(tiers: Tiers) -> int:
    """Return a bound on the entities of one symbol and on the directions it needs."""
    return 40 * sum(len(ring) for rings in tiers.rings for ring in rings)


def symbol_template(
    tiers: Tiers,
    axes: NDArray[np.float64],
    entities: Entities,
    decimal_width: int,
    name_widths: tuple[int, ...],
    style: str,
) -> SymbolTemplate:
    """Return the template of an outline; its directions are written to `entities`.

    Parameters
    ----------
    axes
        (3, 3) rows: the symbol's x, y and z axis in the part frame.
    decimal_width, name_widths
        Widths of the fields that each instance fills.
    style
        Reference to the colour of tops and sides, "" for none.
    """
    sizes = tuple(tuple(len(ring) for ring in rings) for rings in tiers.rings)
    points = outline_points(tiers) @ axes
    frame = axes[[2, 0]]
    topology = _topology(sizes, entities.width, decimal_width, name_widths, bool(style))
    along = _components(topology, points.tobytes(), frame.tobytes())
    find = {_DIRECTION: entities.direction_along, _VECTOR: entities.vector_along}
    references = [
        find[kind](components) if components else style
        for (kind, _, _), components in zip(topology.referred, along, strict=True)
    ]
    template = topology.symbol.template
    text = with_references(template.text, references, entities.width)
    return replace(topology.symbol, template=replace(template, text=text))


@dataclass(frozen=True, slots=True, eq=False)
class _SymbolTopology:
    """The entities of all symbols whose rings have as many points, in any file."""

    symbol: SymbolTemplate
    referred: tuple[_Referred, ...]  #: what its reference fields mean, in the order of first use
    quads: NDArray[np.int64]  #: (q, 4) points of each side, counter-clockwise from outside


@lru_cache(maxsize=256)
def _components(topology: _SymbolTopology, points: bytes, frame: bytes) -> tuple[str, ...]:
    """Return the components of all that a topology refers to, as STEP writes them; "" for a style.

    `points`: (n, 3) mm, part frame; `frame`: (2, 3) the symbol's z and x axis in the part frame.
    """
    corners, axes = np.frombuffer(points).reshape(-1, 3), np.frombuffer(frame).reshape(2, 3)
    a, a_next, b_next, b = corners[topology.quads.T]
    edges = np.array([ends for _, what, ends in topology.referred if what == _EDGE], np.int64)
    found = {
        _AXIS: axes,
        _SIDE: unit(np.cross(b_next - a, b - a_next)),
        _FOOT: unit(a_next - a),
        _EDGE: unit(corners[edges[:, 1]] - corners[edges[:, 0]]),
    }
    texts = {what: map(unit_text, rows) for what, rows in found.items()}
    return tuple(next(texts[what]) if what else "" for _, what, _ in topology.referred)


class _SymbolBuilder:
    def __init__(
        self,
        sizes: tuple[tuple[int, ...], ...],
        width: int,
        decimal_width: int,
        name_widths: tuple[int, ...],
        coloured: bool,
    ) -> None:
        self.sizes = sizes
        self.width = width
        self.referred: dict[_Referred, int] = {}
        self.normal = self.reference(_DIRECTION, _AXIS, 0)
        self.along = self.reference(_DIRECTION, _AXIS, 1)
        self.number = NUMBER * width
        self.names = {
            kind: mark * width for kind, mark, width in zip(KINDS, NAMES, name_widths, strict=True)
        }
        self.coordinates = ",".join([DECIMAL * decimal_width] * 3)
        self.style = self.reference(_STYLE, "") if coloured else ""
        self.points = sum(map(sum, sizes))
        self.quads: list[list[int]] = []
        self.text: list[str] = []
        self.numbers: list[int] = []
        self.count = 0
        self.edges: dict[tuple[int, int], int] = {}
        self.faces: list[int] = []
        self.coloured: list[int] = []

    def reference(self, kind: str, what: str, *which: int) -> str:
        """Return the field that refers to an entity of the file."""
        number = self.referred.setdefault((kind, what, which), len(self.referred))
        return reference_field(number, self.width)

    def built(self) -> _SymbolTopology:
        n = self.points
        for _ in range(n):
            self.add(f"CARTESIAN_POINT('',({self.coordinates}))")
        for i in range(n):
            self.add("VERTEX_POINT('',", i, ")")
        rings = [[ring.tolist() for ring in tier] for tier in number_rings(self.sizes)]
        outer, *holes = rings[0]
        footprint = self.bound(outer[::-1], "FACE_BOUND")
        for hole in holes:
            self.flat([hole[::-1]], "inside")
        for below, above in pairwise(rings):
            for low, high in zip(below, above, strict=True):
                self.sides(low, high)
        self.flat(rings[-1], "top")
        symbol = SymbolTemplate(
            template_of("".join(self.text), self.numbers, self.width),
            self.count,
            footprint,
            np.array(self.faces, np.int64),
            np.array(self.coloured, np.int64),
        )
        return _SymbolTopology(symbol, tuple(self.referred), np.array(self.quads, np.int64))

    def add(self, *terms: _Term) -> int:
        """Write one entity from literal text and references; return its number."""
        text, numbers, mark = self.text, self.numbers, f"#{self.number}"
        text.append(mark + "=")
        numbers.append(self.count)
        for term in terms:
            if isinstance(term, str):
                text.append(term)
            else:
                text.append(mark)
                numbers.append(term)
        text.append(";\n")
        self.count += 1
        return self.count - 1

    def edge(self, start: int, end: int) -> int:
        """Return the oriented edge from one point to another; the edge itself is written once."""
        low, high = min(start, end), max(start, end)
        edge = self.edges.get((low, high))
        if edge is None:
            along = self.reference(_VECTOR, _EDGE, low, high)
            line = self.add("LINE('',", low, f",{along})")
            n = self.points
            edge = self.add("EDGE_CURVE('',", n + low, ",", n + high, ",", line, ",.T.)")
            self.edges[low, high] = edge
        return self.add("ORIENTED_EDGE('',*,*,", edge, ",.T.)" if start == low else ",.F.)")

    def bound(self, loop: list[int], kind: str) -> int:
        oriented = [self.edge(a, b) for a, b in zip(loop, loop[1:] + loop[:1], strict=True)]
        terms: list[_Term] = ["EDGE_LOOP('',("]
        for number in oriented:
            terms += [number, ","]
        terms[-1] = "))"
        return self.add(f"{kind}('',", self.add(*terms), ",.T.)")

    def flat(self, loops: list[list[int]], kind: str) -> None:
        self.face(loops, self.normal, self.along, kind)

    def sides(self, low: list[int], high: list[int]) -> None:
        for i, point in enumerate(low):
            j = (i + 1) % len(low)
            number = len(self.quads)
            self.quads.append([point, low[j], high[j], high[i]])
            normal = self.reference(_DIRECTION, _SIDE, number)
            self.face([self.quads[-1]], normal, self.reference(_DIRECTION, _FOOT, number), "side")

    def face(self, loops: list[list[int]], normal: str, along: str, kind: str) -> None:
        terms: list[_Term] = [f"ADVANCED_FACE({self.names[kind]},("]
        for i, loop in enumerate(loops):
            terms += [self.bound(loop, "FACE_BOUND" if i else "FACE_OUTER_BOUND"), ","]
        placement = self.add("AXIS2_PLACEMENT_3D('',", loops[0][0], f",{normal},{along})")
        terms[-1] = "),"
        terms += [self.add("PLANE('',", placement, ")"), ",.T.)"]
        self.faces.append(self.add(*terms))
        if self.style and kind != "inside":
            self.coloured.append(self.add(f"STYLED_ITEM('',({self.style}),", self.faces[-1], ")"))


@lru_cache(maxsize=128)  # some .1 MB each; figures and symbols of many outlines share theirs
def _topology(*outline: Any) -> _SymbolTopology:
    """Return the entities of an outline, given as `_SymbolBuilder` takes it."""
    return _SymbolBuilder(*outline).built()
