"""Parts -> 3MF: body and symbols as separate objects, arranged on the printer's bed.

Slicers read two ways to say that a body and its symbols belong together, so each plate is
made in both, from the same meshes:

- ``components`` (3MF core specification 1.3): each part is an object of two components,
  "<part> body" and "<part> symbols". Bambu Studio, Orca, Cura and 3D Builder keep them
  together; PrusaSlicer asks when a person opens the file, and headless it drops the symbols
  beside the body.
- ``volumes``: each part is one mesh, and a settings file that PrusaSlicer and SuperSlicer
  read names the two ranges of its triangles, beside `SlicerSettings`. Others see one mesh of
  two materials.

Body and symbols have a material each. The file is a zip whose dates are fixed; mm.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from generator.export.bed import BedPlace, Plate, Size, arrange_plates
from generator.export.colours import BODY_RGB, SYMBOL_RGB, hexadecimal
from generator.export.slicer_settings import SlicerSettings
from generator.solid.part import Part
from generator.solid.triangulate import Mesh, body_mesh, symbol_meshes

_MODEL, _CONFIG = "3D/3dmodel.model", "Metadata/Slic3r_PE_model.config"
_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest a zip can hold
_LEVEL = 4  # of compression: 6 takes twice as long for a few percent
_BLOCK = 20_000  # vertices or triangles formatted at once

_XML = '<?xml version="1.0" encoding="UTF-8"?>\n'
_CONTENT_TYPES = (
    _XML + '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    '<Default Extension="config" ContentType="text/xml"/></Types>\n'
)
_RELATIONSHIPS = (
    _XML + '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)


@dataclass(frozen=True, slots=True)
class PrintFile:
    """One plate as two 3MF files; see the module."""

    plate: Plate
    content: bytes  #: body and symbols as components
    prusaslicer: bytes  #: as volumes


@dataclass(frozen=True, slots=True)
class _Shape:
    """A mesh whose vertices are all in use."""

    vertices: NDArray[np.float64]  #: (N, 3) mm
    triangles: NDArray[np.int64]  #: (M, 3)


@dataclass(frozen=True, slots=True)
class _Printed:
    """What one part puts on the bed: body and symbols (None without symbols)."""

    name: str
    body: _Shape
    symbols: _Shape | None
    low: NDArray[np.float64]  #: (3,) lowest x, y, z, mm
    size: Size

    def shapes(self) -> list[tuple[str, int, _Shape]]:
        """Return name, material and mesh of body and symbols."""
        shapes = [(f"{self.name} body", 0, self.body)]
        if self.symbols is not None:
            shapes.append((f"{self.name} symbols", 1, self.symbols))
        return shapes


def print_files(
    title: str,
    parts: Sequence[Part],
    bed_mm: Size,
    settings: SlicerSettings | None = None,
    gap_mm: float = 5.0,
) -> tuple[PrintFile, ...]:
    """Arrange parts on plates and return the 3MF files of each plate.

    Parameters
    ----------
    title
        Of the model.
    parts
        In their own frames, mm, as they lie on the bed.
    bed_mm
        Usable width and depth of the bed, mm.
    settings
        For slicers that read them; None where there are none.
    gap_mm
        Least distance between two parts, mm.
    """
    printed = [_print_meshes(part) for part in parts]
    plates = arrange_plates([part.size for part in printed], bed_mm, gap_mm)
    return tuple(_plate(title, printed, plate, settings) for plate in plates)


def mesh_print_files(
    title: str,
    meshes: Sequence[tuple[str, Mesh]],
    bed_mm: Size,
    settings: SlicerSettings | None = None,
    gap_mm: float = 5.0,
) -> tuple[PrintFile, ...]:
    """Arrange meshes without symbols, each with its name, as `print_files` arranges parts."""
    printed = []
    for name, mesh in meshes:
        shape = _join_meshes((mesh,))
        low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
        size = float(high[0] - low[0]), float(high[1] - low[1])
        printed.append(_Printed(name, shape, None, low, size))
    plates = arrange_plates([part.size for part in printed], bed_mm, gap_mm)
    return tuple(_plate(title, printed, plate, settings) for plate in plates)


def print_file(
    title: str, parts: Sequence[Part], plate: Plate, settings: SlicerSettings | None = None
) -> PrintFile:
    """Return the 3MF files of one plate; its places count `parts`, which are all on it."""
    return _plate(title, [_print_meshes(part) for part in parts], plate, settings)


def _plate(
    title: str, printed: Sequence[_Printed], plate: Plate, settings: SlicerSettings | None
) -> PrintFile:
    volumes: dict[str, Iterable[str]] = {
        _MODEL: _volumes(title, printed, plate),
        _CONFIG: _volume_settings(printed, plate, settings),
    }
    if settings is not None:
        volumes |= settings.files()
    components = _package({_MODEL: _components(title, printed, plate)})
    return PrintFile(plate, components, _package(volumes))


def _print_meshes(part: Part) -> _Printed:
    body = _join_meshes((body_mesh(part),))
    meshes = [mesh for mesh in symbol_meshes(part) if len(mesh.triangles)]
    symbols = _join_meshes(meshes) if meshes else None
    points = body.vertices if symbols is None else np.vstack([body.vertices, symbols.vertices])
    low, high = points.min(axis=0), points.max(axis=0)
    return _Printed(
        part.name, body, symbols, low, (float(high[0] - low[0]), float(high[1] - low[1]))
    )


def _join_meshes(meshes: Sequence[Mesh]) -> _Shape:
    """Return meshes as one, with the vertices that a triangle uses."""
    vertices, triangles = [], []
    first = 0
    for mesh in meshes:
        used, numbers = np.unique(mesh.triangles, return_inverse=True)
        vertices.append(mesh.vertices[used])
        triangles.append(numbers.reshape(-1, 3) + first)
        first += len(used)
    return _Shape(np.concatenate(vertices), np.concatenate(triangles))


def _components(title: str, printed: Sequence[_Printed], plate: Plate) -> Iterator[str]:
    """Yield the model of a plate, an object of two components for each part."""
    yield _header(title)
    items = []
    number = 2
    for place in plate.places:
        part = printed[place.part]
        components = []
        for name, material, shape in part.shapes():
            yield from _mesh_object(number, name, material, [(material, shape)])
            components.append(f'<component objectid="{number}"/>')
            number += 1
        yield (
            f'<object id="{number}" type="model" name={quoteattr(part.name)}>'
            f"<components>{''.join(components)}</components></object>\n"
        )
        turn, shift = _motion(place, part)
        matrix = " ".join(f"{value:.9g}" for value in (*turn.T.ravel().tolist(), *shift.tolist()))
        items.append(f'<item objectid="{number}" transform="{matrix}"/>\n')
        number += 1
    yield _footer(items)


def _volumes(title: str, printed: Sequence[_Printed], plate: Plate) -> Iterator[str]:
    """Yield the model of a plate, one mesh for each part.

    The vertices are written where they lie on the bed: PrusaSlicer applies the transform of
    a build item to the first volume alone.
    """
    yield _header(title)
    items = []
    for number, place in enumerate(plate.places, 2):
        part = printed[place.part]
        turn, shift = _motion(place, part)
        moved = [
            (material, _Shape(shape.vertices @ turn.T + shift, shape.triangles))
            for _, material, shape in part.shapes()
        ]
        yield from _mesh_object(number, part.name, 0, moved)
        items.append(f'<item objectid="{number}"/>\n')
    yield _footer(items)


def _volume_settings(
    printed: Sequence[_Printed], plate: Plate, settings: SlicerSettings | None
) -> Iterator[str]:
    """Yield PrusaSlicer's settings of a plate: the ranges of triangles that are volumes."""
    own = {} if settings is None else settings.of_object
    yield f"{_XML}<config>\n"
    for number, place in enumerate(plate.places, 2):
        part = printed[place.part]
        yield (
            f'<object id="{number}" instances_count="1">\n'
            f'<metadata type="object" key="name" value={quoteattr(part.name)}/>\n'
        )
        for key, value in own.items():
            yield f'<metadata type="object" key="{key}" value="{value}"/>\n'
        first = 0
        for name, material, shape in part.shapes():
            last = first + len(shape.triangles) - 1
            yield (
                f'<volume firstid="{first}" lastid="{last}">\n'
                f'<metadata type="volume" key="name" value={quoteattr(name)}/>\n'
                '<metadata type="volume" key="volume_type" value="ModelPart"/>\n'
                f'<metadata type="volume" key="extruder" value="{material + 1}"/>\n</volume>\n'
            )
            first = last + 1
        yield "</object>\n"
    yield "</config>\n"


def _header(title: str) -> str:
    return (
        f'{_XML}<model unit="millimeter" xml:lang="en-US" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">\n'
        f'<metadata name="Title">{quoteattr(title)[1:-1]}</metadata>\n'
        '<metadata name="Application">encoded-objects</metadata>\n<resources>\n'
        '<basematerials id="1">'
        f'<base name="body" displaycolor="{hexadecimal(BODY_RGB)}"/>'
        f'<base name="symbols" displaycolor="{hexadecimal(SYMBOL_RGB)}"/></basematerials>\n'
    )


def _footer(items: list[str]) -> str:
    return f"</resources>\n<build>\n{''.join(items)}</build>\n</model>\n"


def _mesh_object(
    number: int, name: str, material: int, shapes: Sequence[tuple[int, _Shape]]
) -> Iterator[str]:
    """Yield one mesh object; triangles name their material where it is not the object's."""
    yield (
        f'<object id="{number}" type="model" name={quoteattr(name)} pid="1" pindex="{material}">'
        "<mesh><vertices>\n"
    )
    for _, shape in shapes:
        vertices = np.round(shape.vertices, 6) + 0.0
        yield from _lines('<vertex x="%.9g" y="%.9g" z="%.9g"/>\n', vertices)
    yield "</vertices><triangles>\n"
    first = 0
    for own, shape in shapes:
        property_text = "" if own == material else f' pid="1" p1="{own}"'
        line = f'<triangle v1="%d" v2="%d" v3="%d"{property_text}/>\n'
        yield from _lines(line, shape.triangles + first)
        first += len(shape.vertices)
    yield "</triangles></mesh></object>\n"


def _lines(line: str, rows: NDArray[np.float64] | NDArray[np.int64]) -> Iterator[str]:
    """Yield one line for each row of numbers."""
    for start in range(0, len(rows), _BLOCK):
        some = rows[start : start + _BLOCK]
        yield line * len(some) % tuple(some.ravel().tolist())


def _motion(place: BedPlace, part: _Printed) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return turn (3, 3) and shift (3,) mm from the part frame to the plate frame."""
    x, y, z = part.low.tolist()
    if place.turned:  # (x, y) -> (-y, x)
        turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        corner = (-(y + part.size[1]), x)
    else:
        turn, corner = np.eye(3), (x, y)
    shift = np.array([place.x_mm - corner[0], place.y_mm - corner[1], -z])
    return turn, np.round(shift, 6) + 0.0


def _package(entries: dict[str, Iterable[str]]) -> bytes:
    """Return the zip with the two files that every 3MF has and the given ones."""
    buffer = io.BytesIO()
    fixed = {"[Content_Types].xml": [_CONTENT_TYPES], "_rels/.rels": [_RELATIONSHIPS]}
    with zipfile.ZipFile(buffer, "w") as package:
        for name, pieces in (fixed | entries).items():
            entry = zipfile.ZipInfo(name, _DATE)
            entry.create_system = 3  # Unix, wherever the file is made
            entry.external_attr = 0o644 << 16
            content = io.BytesIO()
            for piece in pieces:  # the text of a large model is held once
                content.write(piece.encode())
            package.writestr(entry, content.getbuffer(), zipfile.ZIP_DEFLATED, _LEVEL)
    return buffer.getvalue()
