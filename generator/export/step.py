"""Parts -> STEP text (AP214, mm), without a CAD kernel: one part, or panels as an assembly.

Every symbol outline of an embossing is written once as a template of entities and stamped
for each symbol, so that writing costs little more than copying. The text comes in pieces
of a few MB: memory grows with the number of symbols by a few numbers for each of their
faces. The same part gives the same bytes: no clock, no path.

Names: a facet bears its own name ("F1"); the faces of a symbol are "F1/r12c34/top",
"F1/r12c34/side" and, within a ring, "F1/r12c34/inside". Tops and sides of symbols share one
colour; marks (embossings that belong to no face) have none.
ISO 10303-21 (text), -42 (geometry and topology), -46 (colour), -214 (application).
"""

from __future__ import annotations

import zlib
from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.export.colours import BODY_RGB, RGB, SYMBOL_RGB
from generator.export.fixed_text import decimal_numbers, decimal_width, pad, stamp
from generator.export.step_entities import (
    PLACES,
    Entities,
    numbers_listed,
    reference_list,
    step_string,
    triple,
    unit,
)
from generator.export.step_symbol import KINDS, entities_at_most, outline_points, symbol_template
from generator.solid.emboss import turn
from generator.solid.part import Embossing, Part

_CHUNK_BYTES = 4_000_000
_GZIP_LEVEL = 6
_ASSEMBLY_ENTITIES = 40  # for each part, besides its own
_FOOTER = b"ENDSEC;\nEND-ISO-10303-21;\n"
_TIME_STAMP = "1970-01-01T00:00:00"


def step_chunks(part: Part) -> Iterator[bytes]:
    """Yield the STEP text of a part, ASCII, in consecutive pieces.

    Parameters
    ----------
    part
        A closed part; coordinates in mm, part frame.

    Notes
    -----
    Coordinates are rounded to 1e-10 mm. A plane is placed at one of its own rounded points,
    so that its other points lie within a few 1e-10 mm of it.
    """
    name = step_string(part.name)
    entities = Entities(_entities_at_most(part))
    yield _header(name)
    shared = _shared(entities)
    yield from _write_part(part, entities, shared, "")
    yield _FOOTER


def assembly_chunks(name: str, parts: Sequence[Part]) -> Iterator[bytes]:
    """Yield the STEP text of an assembly: each part a product, placed by its `T_object_part`.

    Parameters
    ----------
    name
        Of the object.
    parts
        Closed parts, each in its own frame, mm.
    """
    entities = Entities(sum(map(_entities_at_most, parts)) + _ASSEMBLY_ENTITIES * len(parts))
    yield _header(step_string(name))
    shared = _shared(entities)
    body = _style(entities, BODY_RGB)
    held = []
    for part in parts:
        product = yield from _write_part(part, entities, shared, body)
        held.append((part, product))
    _assembly(entities, step_string(name), shared, held)
    yield entities.taken()
    yield _FOOTER


def gzip_chunks(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """Yield a text gzipped, without name or date: `.stpz`, which CAD programs open as STEP.

    Names and numbers of 20,000 symbols repeat: a sixth is left.
    """
    packer = zlib.compressobj(_GZIP_LEVEL, zlib.DEFLATED, zlib.MAX_WBITS | 16)
    for chunk in chunks:
        yield packer.compress(chunk)
    yield packer.flush()


@dataclass(frozen=True, slots=True)
class _Shared:
    """What all parts of a file refer to."""

    units: str
    origin: str
    symbols: str  #: style of symbols


@dataclass(frozen=True, slots=True)
class _Product:
    """References to a product."""

    definition: str
    shape: str


def _shared(entities: Entities) -> _Shared:
    return _Shared(_units(entities), _origin(entities), _style(entities, SYMBOL_RGB))


def _write_part(
    part: Part, entities: Entities, shared: _Shared, body_style: str
) -> Generator[bytes, None, _Product]:
    """Write one part and the product that it is the shape of."""
    name, units, style = step_string(part.name), shared.units, shared.symbols
    body = _StepBody(part, entities)
    shell: list[NDArray[np.int64]] = []
    coloured: list[NDArray[np.int64]] = []
    for embossing in part.embossings:
        yield from _write_symbols(part, embossing, entities, style, body, shell, coloured)
    shell.append(body.faces())
    coloured.append(_wrapped_colour(part, shell[-1], entities, style))
    yield entities.taken()
    number = entities.reserve(1)
    yield f"#{number}=CLOSED_SHELL('',(\n".encode("ascii")
    yield from numbers_listed(np.concatenate(shell), entities.width)
    yield b"));\n"
    solid = entities.add(f"MANIFOLD_SOLID_BREP('{name}',#{number})")
    if body_style:
        coloured.append(np.array([entities.next]))
        entities.add(f"STYLED_ITEM('',({body_style}),{solid})")
    product = _product(entities, name, solid, units, shared.origin)
    yield entities.taken()
    if any(map(len, coloured)):
        head = f"#{entities.reserve(1)}=MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION"
        yield f"{head}('',(\n".encode("ascii")
        yield from numbers_listed(np.concatenate(coloured), entities.width)
        yield f"),{units});\n".encode("ascii")
    return product


def _header(name: str) -> bytes:
    return (
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('encoded object'),'2;1');\n"
        f"FILE_NAME('{name}','{_TIME_STAMP}',(''),(''),'encoded-objects','encoded-objects','');\n"
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
    ).encode("ascii")


def _units(entities: Entities) -> str:
    """Write mm, radian and the tolerance; return the geometric context."""
    length = entities.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = entities.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid_angle = entities.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    accuracy = entities.add(
        f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),{length},"
        "'distance_accuracy_value','confusion accuracy')"
    )
    return entities.add(
        f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({accuracy}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))"
        "REPRESENTATION_CONTEXT('',''))"
    )


def _origin(entities: Entities) -> str:
    point = entities.add("CARTESIAN_POINT('',(0.,0.,0.))")
    x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    return entities.add(
        f"AXIS2_PLACEMENT_3D('',{point},{entities.direction(z)},{entities.direction(x)})"
    )


def _style(entities: Entities, colour_rgb: RGB) -> str:
    """Write a colour; return the style that faces of that colour refer to."""
    rgb = ",".join(f"{value / 255:.6f}" for value in colour_rgb)
    colour = entities.add(f"COLOUR_RGB('',{rgb})")
    fill = entities.add(f"FILL_AREA_STYLE_COLOUR('',{colour})")
    area = entities.add(f"FILL_AREA_STYLE('',({fill}))")
    surface = entities.add(f"SURFACE_STYLE_FILL_AREA({area})")
    side = entities.add(f"SURFACE_SIDE_STYLE('',({surface}))")
    usage = entities.add(f"SURFACE_STYLE_USAGE(.BOTH.,{side})")
    return entities.add(f"PRESENTATION_STYLE_ASSIGNMENT(({usage}))")


class _StepBody:
    """The plain body: its points and edges, and the bounds of each facet so far."""

    def __init__(self, part: Part, entities: Entities) -> None:
        self.part = part
        self.entities = entities
        self.vertices = np.round(part.vertices, PLACES)
        self.points = [
            entities.add(f"CARTESIAN_POINT('',{triple(vertex, PLACES)})")
            for vertex in self.vertices
        ]
        self.corners = [entities.add(f"VERTEX_POINT('',{point})") for point in self.points]
        self.edges: dict[tuple[int, int], str] = {}
        self.bounds = [
            [
                self._bound(loop, "FACE_BOUND" if i else "FACE_OUTER_BOUND")
                for i, loop in enumerate(facet.loops)
            ]
            for facet in part.facets
        ]

    def faces(self) -> NDArray[np.int64]:
        """Write the facets, with all footprints cut out; return their numbers."""
        numbers = []
        add, direction = self.entities.add, self.entities.direction
        for facet, bounds in zip(self.part.facets, self.bounds, strict=True):
            corners = self.vertices[list(facet.loops[0])]
            following = np.roll(corners, -1, axis=0)
            normal = unit(np.cross(corners - corners[0], following - corners[0]).sum(axis=0))
            longest = int(np.argmax(np.linalg.norm(following - corners, axis=1)))
            along = unit(following[longest] - corners[longest])
            placement = add(
                f"AXIS2_PLACEMENT_3D('',{self.points[facet.loops[0][0]]},"
                f"{direction(normal)},{direction(along)})"
            )
            plane = add(f"PLANE('',{placement})")
            numbers.append(self.entities.next)
            add(
                f"ADVANCED_FACE('{step_string(facet.name)}',({reference_list(bounds)}),{plane},.T.)"
            )
        return np.array(numbers, np.int64)

    def _bound(self, loop: tuple[int, ...], kind: str) -> str:
        add = self.entities.add
        oriented = [
            add(f"ORIENTED_EDGE('',*,*,{self._edge(start, end)},.{'T' if start < end else 'F'}.)")
            for start, end in zip(loop, (*loop[1:], loop[0]), strict=True)
        ]
        edge_loop = add(f"EDGE_LOOP('',({reference_list(oriented)}))")
        return add(f"{kind}('',{edge_loop},.T.)")

    def _edge(self, start: int, end: int) -> str:
        low, high = min(start, end), max(start, end)
        edge = self.edges.get((low, high))
        if edge is None:
            add = self.entities.add
            along = self.entities.vector(unit(self.vertices[high] - self.vertices[low]))
            line = add(f"LINE('',{self.points[low]},{along})")
            edge = add(f"EDGE_CURVE('',{self.corners[low]},{self.corners[high]},{line},.T.)")
            self.edges[low, high] = edge
        return edge


def _write_symbols(
    part: Part,
    embossing: Embossing,
    entities: Entities,
    style: str,
    body: _StepBody,
    shell: list[NDArray[np.int64]],
    coloured: list[NDArray[np.int64]],
) -> Iterator[bytes]:
    """Write the symbols of one embossing; append to the lists what refers to them."""
    facet_axes = embossing.T_part_facet[:3, :3].T
    axes = np.vstack([turn(embossing.rotation_rad).T @ facet_axes[:2], facet_axes[2:]])
    centres = embossing.centres_mm @ facet_axes[:2] + embossing.T_part_facet[:3, 3]
    prefix = part.facets[embossing.facet].name
    names = tuple(
        pad([f"'{step_string(f'{prefix}/{name}/{kind}')}'" for name in embossing.names])
        for kind in KINDS
    )
    width = decimal_width(_largest_mm(part), PLACES)
    for label in np.unique(embossing.labels).tolist():
        tiers = embossing.tiers[label]
        symbol = symbol_template(
            tiers,
            axes,
            entities,
            width,
            tuple(rows.shape[1] for rows in names),
            style if embossing.face is not None else "",
        )
        yield entities.taken()
        points = outline_points(tiers) @ axes
        chosen = np.flatnonzero(embossing.labels == label)
        step = max(1, _CHUNK_BYTES // len(symbol.template.text))
        for start in range(0, len(chosen), step):
            some = chosen[start : start + step]
            first = entities.reserve(symbol.entities * len(some)) + symbol.entities * np.arange(
                len(some), dtype=np.int64
            )
            coordinates = decimal_numbers(points + centres[some, None, :], width, PLACES)
            rows = tuple(kind[some] for kind in names)
            yield stamp(symbol.template, first, entities.width, coordinates, rows)
            shell.append((first[:, None] + symbol.faces).ravel())
            coloured.append((first[:, None] + symbol.coloured).ravel())
            footprints = (first + symbol.footprint).tolist()
            body.bounds[embossing.facet] += [f"#{number}" for number in footprints]


def _wrapped_colour(
    part: Part, faces: NDArray[np.int64], entities: Entities, style: str
) -> NDArray[np.int64]:
    """Give the facets of wrapped symbols their colour; return the styled items."""
    numbers = []
    for wrapped in part.wrapped:
        own = faces[wrapped.first : wrapped.first + len(wrapped.symbols)]
        for face in own.tolist():
            numbers.append(entities.next)
            entities.add(f"STYLED_ITEM('',({style}),#{face})")
    return np.array(numbers, np.int64)


def _product(entities: Entities, name: str, solid: str, units: str, origin: str) -> _Product:
    """Write the product that the solid is the shape of."""
    add = entities.add
    shape = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('{name}',({origin},{solid}),{units})")
    return _product_of(entities, name, shape)


def _product_of(entities: Entities, name: str, shape: str) -> _Product:
    """Write the product that a representation is the shape of."""
    add = entities.add
    application = add("APPLICATION_CONTEXT('automotive design')")
    add(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',"
        f"2000,{application})"
    )
    context = add(f"PRODUCT_CONTEXT('',{application},'mechanical')")
    product = add(f"PRODUCT('{name}','{name}','',({context}))")
    add(f"PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))")
    formation = add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
    design = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')")
    definition = add(f"PRODUCT_DEFINITION('design','',{formation},{design})")
    definition_shape = add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
    add(f"SHAPE_DEFINITION_REPRESENTATION({definition_shape},{shape})")
    return _Product(definition, shape)


def _assembly(
    entities: Entities, name: str, shared: _Shared, held: Sequence[tuple[Part, _Product]]
) -> None:
    """Write the product that holds all parts, each where it belongs (ISO 10303-44, -43)."""
    add = entities.add
    places = [_placement(entities, part.T_object_part) for part, _ in held]
    items = reference_list([shared.origin, *places])
    whole_shape = add(f"SHAPE_REPRESENTATION('{name}',({items}),{shared.units})")
    whole = _product_of(entities, name, whole_shape)
    for number, ((part, product), place) in enumerate(zip(held, places, strict=True), 1):
        own = step_string(part.name)
        use = add(
            f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('{number}','{own}','',{whole.definition},"
            f"{product.definition},$)"
        )
        of_use = add(f"PRODUCT_DEFINITION_SHAPE('','',{use})")
        motion = add(f"ITEM_DEFINED_TRANSFORMATION('','',{shared.origin},{place})")
        relation = add(
            f"(REPRESENTATION_RELATIONSHIP('','',{product.shape},{whole_shape})"
            f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({motion})"
            "SHAPE_REPRESENTATION_RELATIONSHIP())"
        )
        add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relation},{of_use})")


def _placement(entities: Entities, T: NDArray[np.float64]) -> str:
    point = entities.add(f"CARTESIAN_POINT('',{triple(np.round(T[:3, 3], PLACES), PLACES)})")
    z, x = entities.direction(T[:3, 2]), entities.direction(T[:3, 0])
    return entities.add(f"AXIS2_PLACEMENT_3D('',{point},{z},{x})")


def _entities_at_most(part: Part) -> int:
    corners = sum(len(loop) for facet in part.facets for loop in facet.loops)
    count = 1000 + 20 * corners + 2 * len(part.vertices) + 11 * len(part.facets)
    for embossing in part.embossings:
        numbers = np.bincount(embossing.labels, minlength=len(embossing.tiers)).tolist()
        for tiers, symbols in zip(embossing.tiers, numbers, strict=True):
            count += entities_at_most(tiers) * (symbols + 1) if symbols else 0
    return count


def _largest_mm(part: Part) -> float:
    """Return a bound on every coordinate of the part."""
    reach = max(
        (
            float(np.abs(outline_points(tiers)).sum(axis=1).max())
            for embossing in part.embossings
            for tiers in embossing.tiers
        ),
        default=0.0,
    )
    return float(np.abs(part.vertices).max()) + 2.0 * reach
