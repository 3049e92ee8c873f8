"""Parts -> 3MF: body and symbols as separate objects, arranged on the printer's bed.

Slicers read two ways to say that a body and its symbols belong together, so each plate is
made in both; the same meshes are written and deflated once:

- ``components`` (3MF core specification 1.3): each part is an object of two components,
  "<part> body" and "<part> symbols". Bambu Studio, Orca, Cura and 3D Builder keep them
  together; PrusaSlicer asks when a person opens the file, and headless it drops the symbols
  to the bed.
- ``volumes``: each part is one mesh, and a settings file that PrusaSlicer and SuperSlicer
  read names the two ranges of its triangles, and the slicer's settings. Others see one mesh of
  two materials.

Vertices are written where they lie on the bed: PrusaSlicer applies the transform of a build item
to the first volume alone. A part of two volumes lists the vertices of its symbols first, as they
are numbered where the symbols are an object. Part frame in, plate frame out; mm.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from generator.errors import WriteError
from generator.export.bed import BedPlace, Plate, Size, arrange_plates
from generator.export.colours import BODY_RGB, SYMBOL_RGB, hexadecimal
from generator.export.fixed_text import number_lines
from generator.export.formats import ExportedObject, Files
from generator.export.meshes import join_meshes
from generator.printers import Printer
from generator.solid.part import Part
from generator.solid.triangulate import Mesh, body_mesh, symbol_meshes

PLACES = 6  #: decimals of a coordinate in mm
BODY, SYMBOLS = 0, 1  #: materials
_BLOCK = 8_192  # vertices or triangles formatted at once: their text stays in the cache
_SETTINGS = "Metadata/Slic3r_PE.config"
_COLOUR_CHANGE = "Metadata/Prusa_Slicer_custom_gcode_per_print_z.xml"
_MODEL, _CONFIG = "3D/3dmodel.model", "Metadata/Slic3r_PE_model.config"

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
_TO_TRIANGLES, _TO_END = "</vertices><triangles>\n", "</triangles></mesh></object>\n"


class SlicerSettings(NamedTuple):
    """How one plate is printed in filament, by the slicer's own names."""

    of_object: tuple[tuple[str, str], ...]  #: of each object, over any print settings
    files: tuple[tuple[str, str], ...]  #: name and text of those added to a package


@dataclass(frozen=True, slots=True)
class PrintFile:
    """One plate as two 3MF files; see the module."""

    plate: Plate
    content: bytes  #: body and symbols as components
    prusaslicer: bytes  #: as volumes


def slicer_settings(
    printer: Printer, *, supports: bool, colour_change_mm: float = 0.0
) -> SlicerSettings | None:
    """Return the settings of a plate, or None for a printer without a nozzle.

    The filament is changed at a height of `colour_change_mm`; 0: nowhere.
    """
    if not printer.nozzle_mm:
        return None
    width, depth = (f"{side:g}" for side in printer.bed_mm)
    own = {"layer_height": f"{printer.layer_mm:g}", "support_material": str(int(supports))}
    entries = {
        "printer_technology": "FFF",
        "printer_settings_id": "encoded-objects",
        "bed_shape": f"0x0,{width}x0,{width}x{depth},0x{depth}",
        "nozzle_diameter": f"{printer.nozzle_mm:g}",
        "filament_diameter": "1.75",
        "filament_density": "1.24",
        "filament_type": "PLA",
        "first_layer_temperature": "215",
        "temperature": "210",
        "first_layer_bed_temperature": "60",
        "bed_temperature": "60",
        "layer_height": own["layer_height"],
        "first_layer_height": f"{printer.first_layer_mm:g}",
        "fill_density": "15%",
        "support_material": own["support_material"],
    }
    lines = [f"; {name} = {value}\n" for name, value in entries.items()]
    files = {_SETTINGS: "; made by encoded-objects\n\n" + "".join(lines)}
    change = printer.printed_mm(colour_change_mm) if colour_change_mm else 0.0
    if change > 0:
        # The slicer changes before the layer that ends at or above this height.
        files[_COLOUR_CHANGE] = (
            '<?xml version="1.0" encoding="utf-8"?>\n<custom_gcodes_per_print_z>\n'
            f'<code print_z="{change + printer.layer_mm:.6g}" type="0" extruder="1" '
            f'color="{hexadecimal(SYMBOL_RGB)}" '
            'extra="" gcode="M600"/>\n<mode value="SingleExtruder"/>\n'
            "</custom_gcodes_per_print_z>\n"
        )
    return SlicerSettings(tuple(own.items()), tuple(files.items()))


def write_plates(exported: ExportedObject) -> Files:
    """Yield both 3MF files of each plate of an object."""
    for number, plate in enumerate(exported.plates, 1):
        stem = exported.name + (f"-plate-{number}" if len(exported.plates) > 1 else "")
        yield f"{stem}.3mf", plate.content
        yield f"{stem}-prusaslicer.3mf", plate.prusaslicer


def print_files(
    title: str,
    parts: Sequence[Part | tuple[str, Mesh]],
    bed_mm: Size,
    settings: SlicerSettings | None = None,
) -> tuple[PrintFile, ...]:
    """Arrange parts on plates and return the 3MF files of each plate.

    Parts lie in their own frames, mm, as on the bed; of one without symbols name and mesh.
    """
    held = [_bed_part(part) for part in parts]
    plates = arrange_plates([part.size for part in held], bed_mm)
    return tuple(
        PrintFile(plate, *_plate_packages(title, held, plate, settings)) for plate in plates
    )


def print_file(
    title: str, parts: Sequence[Part], plate: Plate, settings: SlicerSettings | None = None
) -> PrintFile:
    """Return the 3MF files of one plate; its places count `parts`, which are all on it."""
    held = [_bed_part(part) for part in parts]
    return PrintFile(plate, *_plate_packages(title, held, plate, settings))


@dataclass(frozen=True, slots=True)
class _BedMesh:
    """A mesh whose vertices are all in use."""

    name: str
    material: int  #: `BODY` or `SYMBOLS`
    vertices: NDArray[np.float64]  #: (N, 3) mm
    triangles: NDArray[np.int64]  #: (M, 3)

    def vertex_text(self) -> DeflatedText:
        words = ('<vertex x="', '" y="', '" z="', '"/>\n')
        blocks = range(0, len(self.vertices), _BLOCK)
        rows = (self.vertices[start : start + _BLOCK] for start in blocks)
        return deflate_text(number_lines(words, some, PLACES) for some in rows)

    def triangle_text(self, first: int = 0, properties: str = "") -> DeflatedText:
        """Return the elements of its triangles, whose vertices are numbered from `first`."""
        words = ('<triangle v1="', '" v2="', '" v3="', f'"{properties}/>\n')
        blocks = range(0, len(self.triangles), _BLOCK)
        rows = (self.triangles[start : start + _BLOCK] + first for start in blocks)
        return deflate_text(number_lines(words, some, 0) for some in rows)


@dataclass(frozen=True, slots=True)
class _BedPart:
    """What one part puts on the bed: body and symbols (None without symbols)."""

    name: str
    body: _BedMesh
    symbols: _BedMesh | None
    low: NDArray[np.float64]  #: (3,) lowest x, y, z, mm
    size: Size

    @property
    def meshes(self) -> tuple[_BedMesh, ...]:
        return (self.body,) if self.symbols is None else (self.body, self.symbols)


def _bed_part(part: Part | tuple[str, Mesh]) -> _BedPart:
    symbols: list[tuple[NDArray[np.float64], NDArray[np.int64]]] = []
    if isinstance(part, Part):
        name, body = part.name, body_mesh(part)
        stands = symbol_meshes(part)
        symbols = [(one.vertices, one.triangles) for one in stands if len(one.triangles)]
    else:
        name, body = part
    own = _BedMesh(f"{name} body", BODY, *join_meshes([(body.vertices, body.triangles)]))
    points, stuck = own.vertices, None
    if symbols:
        stuck = _BedMesh(f"{name} symbols", SYMBOLS, *join_meshes(symbols))
        points = np.vstack([points, stuck.vertices])
    low, high = points.min(axis=0), points.max(axis=0)
    return _BedPart(name, own, stuck, low, (float(high[0] - low[0]), float(high[1] - low[1])))


def _move_to_bed(mesh: _BedMesh, part: _BedPart, place: BedPlace) -> _BedMesh:
    """Return a mesh of a part where it lies on the bed."""
    x, y, z = part.low.tolist()
    points = mesh.vertices
    if place.turned:  # (x, y) -> (-y, x)
        points = np.column_stack([-points[:, 1], points[:, 0], points[:, 2]])
        corner = (-(y + part.size[1]), x)
    else:
        corner = (x, y)
    shift = np.array([place.x_mm - corner[0], place.y_mm - corner[1], -z])
    return _BedMesh(mesh.name, mesh.material, points + shift, mesh.triangles)


@dataclass(slots=True)
class _Model:
    """The text of one model so far."""

    pieces: list[DeflatedText] = field(default_factory=list)
    items: list[str] = field(default_factory=list)
    number: int = 2  #: of the next object; 1 are the materials

    def add(self, *pieces: str | DeflatedText) -> None:
        self.pieces += [
            deflate_text([piece.encode()]) if isinstance(piece, str) else piece for piece in pieces
        ]

    def item(self) -> None:
        """Put the next object on the bed, where its vertices are."""
        self.items.append(f'<item objectid="{self.number}"/>\n')
        self.number += 1


def _plate_packages(
    title: str, parts: Sequence[_BedPart], plate: Plate, settings: SlicerSettings | None
) -> tuple[bytes, bytes]:
    """Return one plate as components and as volumes; its places count `parts`."""
    components, volumes = _Model(), _Model()
    for model in (components, volumes):
        model.add(_header(title))
    for place in plate.places:
        part = parts[place.part]
        body = _move_to_bed(part.body, part, place)
        symbols = None if part.symbols is None else _move_to_bed(part.symbols, part, place)
        _add_part(part.name, body, symbols, components, volumes)
    for model in (components, volumes):
        model.add(f"</resources>\n<build>\n{''.join(model.items)}</build>\n</model>\n")
    more = {_CONFIG: _volume_settings(parts, plate, settings)}
    if settings is not None:
        more |= dict(settings.files)
    return _package(components.pieces), _package(volumes.pieces, more)


def _add_part(
    name: str, body: _BedMesh, symbols: _BedMesh | None, components: _Model, volumes: _Model
) -> None:
    """Add a part as an object of one or two components, and as one mesh of as many volumes."""
    points, faces = body.vertex_text(), body.triangle_text()
    references = [_add_mesh(components, body, points, faces)]
    if symbols is None:
        volumes.add(_mesh_head(volumes.number, name, BODY), points, _TO_TRIANGLES, faces, _TO_END)
    else:
        own, sides = symbols.vertex_text(), symbols.triangle_text()
        references.append(_add_mesh(components, symbols, own, sides))
        moved = body.triangle_text(len(symbols.vertices), f' pid="1" p1="{BODY}"')
        head = _mesh_head(volumes.number, name, SYMBOLS)
        volumes.add(head, own, points, _TO_TRIANGLES, moved, sides, _TO_END)
    volumes.item()
    components.add(
        f'<object id="{components.number}" type="model" name={quoteattr(name)}>'
        f"<components>{''.join(references)}</components></object>\n"
    )
    components.item()


def _add_mesh(model: _Model, mesh: _BedMesh, points: DeflatedText, faces: DeflatedText) -> str:
    """Add a mesh as an object; return the component that refers to it."""
    head = _mesh_head(model.number, mesh.name, mesh.material)
    model.add(head, points, _TO_TRIANGLES, faces, _TO_END)
    model.number += 1
    return f'<component objectid="{model.number - 1}"/>'


def _mesh_head(number: int, name: str, material: int) -> str:
    return (
        f'<object id="{number}" type="model" name={quoteattr(name)} pid="1" pindex="{material}">'
        "<mesh><vertices>\n"
    )


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


def _volume_settings(
    parts: Sequence[_BedPart], plate: Plate, settings: SlicerSettings | None
) -> str:
    """Return PrusaSlicer's settings of a plate: the ranges of triangles that are volumes."""
    own = {} if settings is None else dict(settings.of_object)
    text = [f"{_XML}<config>\n"]
    for number, place in enumerate(plate.places, 2):
        part = parts[place.part]
        text.append(
            f'<object id="{number}" instances_count="1">\n'
            f'<metadata type="object" key="name" value={quoteattr(part.name)}/>\n'
        )
        text += [
            f'<metadata type="object" key="{key}" value="{value}"/>\n' for key, value in own.items()
        ]
        first = 0
        for mesh in part.meshes:
            last = first + len(mesh.triangles) - 1
            text.append(
                f'<volume firstid="{first}" lastid="{last}">\n'
                f'<metadata type="volume" key="name" value={quoteattr(mesh.name)}/>\n'
                '<metadata type="volume" key="volume_type" value="ModelPart"/>\n'
                f'<metadata type="volume" key="extruder" value="{mesh.material + 1}"/>\n'
                "</volume>\n"
            )
            first = last + 1
        text.append("</object>\n")
    text.append("</config>\n")
    return "".join(text)


def _package(model: Sequence[DeflatedText], more: dict[str, str] | None = None) -> bytes:
    """Return the zip of a model, of the two files that every 3MF has, and of some more."""
    before = {"[Content_Types].xml": _CONTENT_TYPES, "_rels/.rels": _RELATIONSHIPS}
    entries = {name: [deflate_text([text.encode()])] for name, text in before.items()}
    entries[_MODEL] = list(model)
    for name, text in (more or {}).items():
        entries[name] = [deflate_text([text.encode()])]
    return zip_package(entries)


_LEVEL = 4  # of compression: 6 takes twice as long for a few percent
_LAST = b"\x03\x00"  #: an empty block that ends a stream
_ZEROS = bytes(1 << 16)
_LARGEST = (1 << 32) - 1  #: bytes that a zip without extensions can hold
_VERSION, _UNIX, _DEFLATE = 20, 3, 8
_DATE = 0x21  #: 1980-01-01, the earliest that a zip can hold
_MODE = 0o644 << 16
_LOCAL = struct.Struct("<4s5H3L2H")
_CENTRAL = struct.Struct("<4s4B4H3L5H2L")
_END = struct.Struct("<4s4H2LH")


@dataclass(frozen=True, slots=True)
class DeflatedText:
    """A text as deflate blocks that can stand anywhere in a stream."""

    blocks: bytes
    size: int  #: bytes of the text
    crc: int  #: CRC-32 of the text


def deflate_text(pieces: Iterable[bytes]) -> DeflatedText:
    """Return the text of all pieces deflated; no more than one of them is held at a time."""
    packer = zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    blocks, size, crc = [], 0, 0
    for piece in pieces:
        blocks.append(packer.compress(piece))
        size += len(piece)
        crc = zlib.crc32(piece, crc)
    blocks.append(packer.flush(zlib.Z_FULL_FLUSH))
    return DeflatedText(b"".join(blocks), size, crc)


def zip_package(entries: Mapping[str, Sequence[DeflatedText]]) -> bytes:
    """Return the zip of entries, each by its name (ASCII) and the pieces of its text, in order.

    Raises `WriteError` beyond 4 GiB.
    """
    package = bytearray()
    central = bytearray()
    for name, pieces in entries.items():
        path = name.encode("ascii")
        crc, size = 0, 0
        for piece in pieces:
            crc, size = _crc_of_both(crc, piece), size + piece.size
        if max(size, len(package)) > _LARGEST:
            raise WriteError(
                "a plate exceeds 4 GiB, the most that a 3MF can hold here",
                fix="make smaller objects, or leave 3mf out of formats",
            )
        stored = sum(len(piece.blocks) for piece in pieces) + len(_LAST)
        place = len(package)
        package += _LOCAL.pack(
            b"PK\3\4", _VERSION, 0, _DEFLATE, 0, _DATE, crc, stored, size, len(path), 0
        )
        package += path
        for piece in pieces:
            package += piece.blocks
        package += _LAST
        central += _CENTRAL.pack(
            b"PK\1\2", _VERSION, _UNIX, _VERSION, 0, 0, _DEFLATE, 0, _DATE, crc, stored, size,
            len(path), 0, 0, 0, 0, _MODE, place,
        )  # fmt: skip
        central += path
    count = len(entries)
    end = _END.pack(b"PK\5\6", 0, 0, count, count, len(central), len(package), 0)
    return bytes(package + central + end)


def _crc_of_both(before: int, piece: DeflatedText) -> int:
    """Return the CRC of a text and the piece behind it.

    A CRC is affine in its start: over as many zeros it gives the share of `before`.
    """
    moved, own = before, 0
    for start in range(0, piece.size, len(_ZEROS)):
        zeros = _ZEROS[: piece.size - start]
        moved, own = zlib.crc32(zeros, moved), zlib.crc32(zeros, own)
    return moved ^ own ^ piece.crc
