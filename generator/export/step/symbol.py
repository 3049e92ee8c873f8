"""One symbol as a template of STEP entities: points, edges, sides, top.

Panels of an object share their templates: what a template refers to in a file, directions and
colours, is filled in for each file. The points of a symbol are numbered tier by tier and ring by
ring. Point i is entity i of the template and its vertex entity n + i, so that the coordinates of
all symbols of one outline are filled in as one array. The footprint (the outer ring of the first
tier, seen as a hole of the facet) is a bound that the facet refers to.

Engraved symbols have the same topology: with falling z the same vertex order turns the
sides towards the cavity, which is outside the material.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

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

KINDS = ("top", "side", "inside")  #: of a symbol's faces; "inside": the facet within a ring

_DIRECTION, _VECTOR, _STYLE = "direction", "vector", "style"  # of a file, that a symbol refers to

_Term = int | str  # a number of the template, or literal text such as "#100017"


@dataclass(frozen=True, slots=True)
class SymbolTemplate:
    """The entities of one symbol, numbered from 0."""

    template: TextTemplate
    entities: int  #: how many
    footprint: int  #: bound of the facet
    faces: NDArray[np.int64]
    coloured: NDArray[np.int64]  #: styled items


def outline_points(tiers: Tiers) -> NDArray[np.float64]:
    """Return all points of an outline, (n, 3) mm in the symbol's axes, tier by tier."""
    blocks = [
        np.column_stack([ring, np.full(len(ring), z)])
        for z, rings in zip(tiers.z_mm, tiers.rings, strict=True)
        for ring in rings
    ]
    return np.concatenate(blocks)


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
    tiers
        The outline.
    axes
        (3, 3) rows: the symbol's x, y and z axis in the part frame.
    entities
        The file.
    decimal_width, name_widths
        Widths of the fields that each instance fills.
    style
        Reference to the colour of tops and sides, "" for none.
    """
    sizes = tuple(tuple(len(ring) for ring in rings) for rings in tiers.rings)
    points = outline_points(tiers) @ axes
    shape = points.tobytes(), sizes, axes[[2, 0]].tobytes()
    pattern = _pattern(*shape, entities.width, decimal_width, name_widths, bool(style))
    return pattern.bound(entities, style)


@dataclass(frozen=True, slots=True)
class _SymbolPattern:
    """The entities of a symbol in any file: what they refer to in it is asked for by `bound`."""

    symbol: SymbolTemplate
    referred: tuple[tuple[str, str], ...]  #: kind and components, in the order of their first use
    width: int  #: digits of a number

    def bound(self, entities: Entities, style: str) -> SymbolTemplate:
        """Return the template in a file; directions that it has not yet are written to it."""
        find = {_DIRECTION: entities.direction_along, _VECTOR: entities.vector_along}
        references = [
            style if kind == _STYLE else find[kind](components)
            for kind, components in self.referred
        ]
        template = self.symbol.template
        text = with_references(template.text, references, self.width)
        return replace(self.symbol, template=replace(template, text=text))


@lru_cache(maxsize=128)  # a template takes some .1 MB; panels of an object share theirs
def _pattern(
    points: bytes,
    sizes: tuple[tuple[int, ...], ...],
    axes: bytes,
    width: int,
    decimal_width: int,
    name_widths: tuple[int, ...],
    coloured: bool,
) -> _SymbolPattern:
    """Return the entities of an outline.

    Parameters
    ----------
    points, sizes
        (n, 3) mm, part frame; how many of them each ring of each tier has.
    axes
        (2, 3) the symbol's z and x axis in the part frame.
    width
        Digits of a number.
    """
    builder = _SymbolBuilder(
        np.frombuffer(points).reshape(-1, 3), sizes, np.frombuffer(axes).reshape(2, 3),
        width, decimal_width, name_widths, coloured,
    )  # fmt: skip
    return _SymbolPattern(builder.built(), tuple(builder.referred), width)


class _SymbolBuilder:
    def __init__(
        self,
        points: NDArray[np.float64],
        sizes: tuple[tuple[int, ...], ...],
        axes: NDArray[np.float64],
        width: int,
        decimal_width: int,
        name_widths: tuple[int, ...],
        coloured: bool,
    ) -> None:
        self.points = points
        self.sizes = sizes
        self.width = width
        self.referred: dict[tuple[str, str], int] = {}
        self.normal, self.along = self.direction(axes[0]), self.direction(axes[1])
        self.number = NUMBER * width
        self.names = {
            kind: mark * width for kind, mark, width in zip(KINDS, NAMES, name_widths, strict=True)
        }
        self.coordinates = ",".join([DECIMAL * decimal_width] * 3)
        self.style = self.reference(_STYLE, "") if coloured else ""
        self.text: list[str] = []
        self.numbers: list[int] = []
        self.count = 0
        self.edges: dict[tuple[int, int], int] = {}
        self.faces: list[int] = []
        self.coloured: list[int] = []

    def reference(self, kind: str, components: str) -> str:
        """Return the field that refers to an entity of the file."""
        number = self.referred.setdefault((kind, components), len(self.referred))
        return reference_field(number, self.width)

    def direction(self, along: NDArray[np.float64]) -> str:
        return self.reference(_DIRECTION, unit_text(along))

    def built(self) -> SymbolTemplate:
        n = len(self.points)
        for _ in range(n):
            self.add(f"CARTESIAN_POINT('',({self.coordinates}))")
        for i in range(n):
            self.add("VERTEX_POINT('',", i, ")")
        rings = self.rings()
        outer, *holes = rings[0]
        footprint = self.bound(outer[::-1], "FACE_BOUND")
        for hole in holes:
            self.flat([hole[::-1]], "inside")
        for below, above in pairwise(rings):
            for low, high in zip(below, above, strict=True):
                self.sides(low, high)
        self.flat(rings[-1], "top")
        return SymbolTemplate(
            template_of("".join(self.text), self.numbers, self.width),
            self.count,
            footprint,
            np.array(self.faces, np.int64),
            np.array(self.coloured, np.int64),
        )

    def rings(self) -> list[list[list[int]]]:
        """Return the numbers of the points, [tier][ring][point]."""
        rings: list[list[list[int]]] = []
        first = 0
        for tier in self.sizes:
            rings.append([])
            for size in tier:
                rings[-1].append(list(range(first, first + size)))
                first += size
        return rings

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
            along = self.reference(_VECTOR, unit_text(unit(self.points[high] - self.points[low])))
            line = self.add("LINE('',", low, f",{along})")
            n = len(self.points)
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
        """Write a face parallel to the facet."""
        self.face(loops, self.normal, self.along, kind)

    def sides(self, low: list[int], high: list[int]) -> None:
        """Write the quadrilaterals between two rings."""
        a, b = self.points[low], self.points[high]
        a_next, b_next = np.roll(a, -1, axis=0), np.roll(b, -1, axis=0)
        normals = unit(np.cross(b_next - a, b - a_next))
        along = unit(a_next - a)
        for i, point in enumerate(low):
            j = (i + 1) % len(low)
            self.face(
                [[point, low[j], high[j], high[i]]],
                self.direction(normals[i]),
                self.direction(along[i]),
                "side",
            )

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
