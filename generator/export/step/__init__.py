"""Parts -> STEP text (AP214, mm), without a CAD kernel: one part, or panels as an assembly.

Every symbol outline of an embossing is written once as a template of entities and stamped
for each symbol, so that writing costs little more than copying. The text comes in pieces
of a few MB: memory grows with the number of symbols by a few numbers for each of their
faces. The same part gives the same bytes: no clock, no path.

Names: a facet bears its own name ("F1"); the faces of a symbol are "F1/r12c34/top",
"F1/r12c34/side" and, within a ring, "F1/r12c34/inside". Tops and sides of symbols share one
colour; marks (embossings that belong to no face) have none.
ISO 10303-21 (text), -42 (geometry and topology), -46 (colour), -214 (application).

::

    entities.py  the running list of entities, numbers and directions
    product.py   header, units, colours, products, assembly
    body.py      points, edges and planar facets of the plain body, rims of round faces
    curved.py    round faces as cylinders and cones, with the symbols on them
    symbol.py    one symbol as a template
    part.py      one part, its symbols stamped
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Sequence

from generator.export.colours import BODY_RGB, SYMBOL_RGB
from generator.export.step.entities import Entities, step_string
from generator.export.step.part import entities_at_most, write_part
from generator.export.step.product import (
    FOOTER,
    Shared,
    file_header,
    write_assembly,
    write_origin,
    write_style,
    write_units,
)
from generator.solid.part import Part

__all__ = ["assembly_chunks", "gzip_chunks", "step_chunks"]

_GZIP_LEVEL = 6
_ASSEMBLY_ENTITIES = 40  # for each part, besides its own


def step_chunks(part: Part) -> Iterator[bytes | memoryview]:
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
    entities = Entities(entities_at_most(part))
    yield file_header(name)
    shared = _shared(entities)
    yield from write_part(part, entities, shared, "")
    yield FOOTER


def assembly_chunks(name: str, parts: Sequence[Part]) -> Iterator[bytes | memoryview]:
    """Yield the STEP text of an assembly: each part a product, placed by its `T_object_part`.

    Parameters
    ----------
    name
        Of the object.
    parts
        Closed parts, each in its own frame, mm.
    """
    entities = Entities(sum(map(entities_at_most, parts)) + _ASSEMBLY_ENTITIES * len(parts))
    yield file_header(step_string(name))
    shared = _shared(entities)
    body = write_style(entities, BODY_RGB)
    held = []
    for part in parts:
        product = yield from write_part(part, entities, shared, body)
        held.append((part, product))
    write_assembly(entities, step_string(name), shared, held)
    yield entities.taken()
    yield FOOTER


def gzip_chunks(chunks: Iterable[bytes | memoryview]) -> Iterator[bytes]:
    """Yield a text gzipped, without name or date: `.stpz`, which CAD programs open as STEP.

    Names and numbers of 20,000 symbols repeat: a sixth is left.
    """
    packer = zlib.compressobj(_GZIP_LEVEL, zlib.DEFLATED, zlib.MAX_WBITS | 16)
    for chunk in chunks:
        yield packer.compress(chunk)
    yield packer.flush()


def _shared(entities: Entities) -> Shared:
    return Shared(write_units(entities), write_origin(entities), write_style(entities, SYMBOL_RGB))
