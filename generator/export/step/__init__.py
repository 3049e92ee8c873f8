"""Parts -> STEP text (AP214, mm), without a CAD kernel: one part, or panels as an assembly.

Every symbol outline of an embossing is written once as a template of entities and stamped
for each symbol, so that writing costs little more than copying. The text comes in pieces
of a few MB. The same part gives the same bytes: no clock, no path.

Names: a facet bears its own name ("F1"); the faces of a symbol are "F1/r12c34/top",
"F1/r12c34/side" and, within a ring, "F1/r12c34/inside". Tops and sides of symbols share one
colour; marks (embossings that belong to no face) have none.
ISO 10303-21 (text), -42 (geometry and topology), -46 (colour), -214 (application).
"""

from __future__ import annotations

import zlib
from collections.abc import Generator, Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from generator.export.colours import BODY_RGB, SYMBOL_RGB
from generator.export.fixed_text import decimal_numbers, decimal_width, pad, stamp
from generator.export.formats import ExportedObject, Files
from generator.export.step.body import StepBody
from generator.export.step.curved import round_entities, write_round_faces
from generator.export.step.entities import (
    FOOTER,
    PLACES,
    Entities,
    ProductReferences,
    Shared,
    file_header,
    numbers_listed,
    step_string,
    write_assembly_product,
    write_origin,
    write_product,
    write_style,
    write_units,
)
from generator.export.step.symbol import KINDS, symbol_entities, symbol_template
from generator.solid.part import Embossing, Part, turn
from generator.solid.triangulate import Mesh, outline_points

_GZIP_LEVEL = 6
_ASSEMBLY_ENTITIES = 40  # for each part, besides its own
_CHUNK_BYTES = 400_000  # of symbols stamped at once: they stay in the cache


def write_part(part: Part, _mesh: Mesh) -> Iterator[bytes | memoryview]:
    """Return the STEP file of a part."""
    return step_chunks(part)


def write_part_gzipped(part: Part, _mesh: Mesh) -> Iterator[bytes]:
    """Return the STEP file of a part, gzipped."""
    return gzip_chunks(step_chunks(part))


def write_assembly(exported: ExportedObject) -> Files:
    """Yield the STEP file of an object in several parts."""
    if len(exported.parts) > 1:
        yield f"{exported.name}.step", assembly_chunks(exported.name, exported.parts)


def write_assembly_gzipped(exported: ExportedObject) -> Files:
    """Yield the STEP file of an object in several parts, gzipped."""
    if len(exported.parts) > 1:
        content = gzip_chunks(assembly_chunks(exported.name, exported.parts))
        yield f"{exported.name}.stpz", content


def step_chunks(part: Part) -> Iterator[bytes | memoryview]:
    """Yield the STEP text of a closed part, ASCII, in consecutive pieces.

    Coordinates are rounded to 1e-10 mm. A plane is placed at one of its own rounded points,
    so that its other points lie within a few 1e-10 mm of it.
    """
    name = step_string(part.name)
    entities = Entities(_entities_at_most(part))
    yield file_header(name)
    shared = _shared(entities)
    yield from _write_part(part, entities, shared, "")
    yield FOOTER


def assembly_chunks(name: str, parts: Sequence[Part]) -> Iterator[bytes | memoryview]:
    """Yield the STEP text of an assembly: each part a product, placed by its `T_object_part`."""
    entities = Entities(sum(map(_entities_at_most, parts)) + _ASSEMBLY_ENTITIES * len(parts))
    yield file_header(step_string(name))
    shared = _shared(entities)
    body = write_style(entities, BODY_RGB)
    held = []
    for part in parts:
        product = yield from _write_part(part, entities, shared, body)
        held.append((part, product))
    write_assembly_product(entities, step_string(name), shared, held)
    yield entities.taken()
    yield FOOTER


def gzip_chunks(chunks: Iterable[bytes | memoryview]) -> Iterator[bytes]:
    """Yield a text gzipped, without name or date: `.stpz`, which CAD programs open as STEP."""
    packer = zlib.compressobj(_GZIP_LEVEL, zlib.DEFLATED, zlib.MAX_WBITS | 16)
    for chunk in chunks:
        yield packer.compress(chunk)
    yield packer.flush()


def _shared(entities: Entities) -> Shared:
    return Shared(write_units(entities), write_origin(entities), write_style(entities, SYMBOL_RGB))


def _write_part(
    part: Part, entities: Entities, shared: Shared, body_style: str
) -> Generator[bytes | memoryview, None, ProductReferences]:
    """Write one part and the product that it is the shape of."""
    name, units, style = step_string(part.name), shared.units, shared.symbols
    body = StepBody(part, entities)
    shell: list[NDArray[np.int64]] = []
    coloured: list[NDArray[np.int64]] = []
    width = decimal_width(_largest_mm(part), PLACES)
    for embossing in part.embossings:
        yield from _write_symbols(part, embossing, entities, style, width, body, shell, coloured)
    shell.append(body.faces())
    coloured.append(_wrapped_colour(part, body.planar, shell[-1], entities, style))
    faces, styled = write_round_faces(body, entities, style)
    shell.append(faces)
    coloured.append(styled)
    yield entities.taken()
    number = entities.reserve(1)
    yield f"#{number}=CLOSED_SHELL('',(\n".encode("ascii")
    yield from numbers_listed(np.concatenate(shell), entities.width)
    yield b"));\n"
    solid = entities.add(f"MANIFOLD_SOLID_BREP('{name}',#{number})")
    if body_style:
        coloured.append(np.array([entities.next]))
        entities.add(f"STYLED_ITEM('',({body_style}),{solid})")
    product = write_product(entities, name, solid, units, shared.origin)
    yield entities.taken()
    if any(map(len, coloured)):
        head = f"#{entities.reserve(1)}=MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION"
        yield f"{head}('',(\n".encode("ascii")
        yield from numbers_listed(np.concatenate(coloured), entities.width)
        yield f"),{units});\n".encode("ascii")
    return product


def _write_symbols(
    part: Part,
    embossing: Embossing,
    entities: Entities,
    style: str,
    width: int,
    body: StepBody,
    shell: list[NDArray[np.int64]],
    coloured: list[NDArray[np.int64]],
) -> Iterator[bytes | memoryview]:
    """Write the symbols of one embossing with coordinates of `width`; append their references."""
    facet_axes = embossing.T_part_facet[:3, :3].T
    axes = np.vstack([turn(embossing.rotation_rad).T @ facet_axes[:2], facet_axes[2:]])
    centres = embossing.centres_mm @ facet_axes[:2] + embossing.T_part_facet[:3, 3]
    prefix = part.facets[embossing.facet].name
    names = tuple(
        pad([f"'{step_string(f'{prefix}/{name}/{kind}')}'" for name in embossing.names])
        for kind in KINDS
    )
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
    part: Part, planar: list[int], faces: NDArray[np.int64], entities: Entities, style: str
) -> NDArray[np.int64]:
    """Give those facets of wrapped symbols that are planes their colour; return styled items."""
    number_of = dict(zip(planar, faces.tolist(), strict=True))
    numbers = []
    for wrapped in part.wrapped:
        for facet in range(wrapped.first, wrapped.first + len(wrapped.symbols)):
            if facet in number_of:
                numbers.append(entities.next)
                entities.add(f"STYLED_ITEM('',({style}),#{number_of[facet]})")
    return np.array(numbers, np.int64)


def _entities_at_most(part: Part) -> int:
    """Return a bound on the entities of a part: those of facets that are written as planes."""
    curved = {facet for face in part.analytic for facet in face.facets}
    planar = [facet for k, facet in enumerate(part.facets) if k not in curved]
    corners = sum(len(loop) for facet in planar for loop in facet.loops)
    count = 1000 + 20 * corners + 11 * len(planar)
    count += sum(map(round_entities, part.analytic))
    for embossing in part.embossings:
        numbers = np.bincount(embossing.labels, minlength=len(embossing.tiers)).tolist()
        for tiers, symbols in zip(embossing.tiers, numbers, strict=True):
            count += symbol_entities(tiers) * (symbols + 1) if symbols else 0
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
