"""Parts -> 3MF: body and symbols as separate objects, arranged on the printer's bed.

Slicers read three ways to say that a body and its symbols belong together. The same meshes are
written and deflated once for all; the third, projects of Bambu Studio, is `generator.export.bambu`:

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
from dataclasses import dataclass
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
MODEL, _CONFIG = "3D/3dmodel.model", "Metadata/Slic3r_PE_model.config"
_OF_OBJECT = ("layer_height", "support_material")  #: settings of each object, over any of a print

XML = '<?xml version="1.0" encoding="UTF-8"?>\n'
_CONTENT_TYPES = (
    XML + '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    '<Default Extension="config" ContentType="text/xml"/></Types>\n'
)
_RELATIONSHIPS = (
    f'{XML}<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
)
_TO_TRIANGLES, _TO_END = "</vertices><triangles>\n", "</triangles></mesh></object>\n"


# Of PLA, as every project says it.
INFILL = "15%"
FILAMENT_MM = "1.75"
FIRST_LAYER_C, LAYERS_C, BED_C = "215", "210", "60"  #: of the nozzle, then of the bed


@dataclass(frozen=True, slots=True)
class SlicerSettings:
    """How a plate is printed in filament; projects say it by their slicer's names."""

    printer: Printer  #: with a nozzle
    supports: bool = False
    colour_change_mm: float = 0.0  #: height at which the filament is changed; 0: nowhere
    symbols_apart: bool = True  #: symbols in another filament, where the slicer can change it

    @property
    def entries(self) -> dict[str, str]:
        """What PrusaSlicer reads as the settings of a project."""
        printer = self.printer
        width, depth = (f"{side:g}" for side in printer.bed_mm)
        return {
            "printer_technology": "FFF",
            "printer_settings_id": "encoded-objects",
            "bed_shape": f"0x0,{width}x0,{width}x{depth},0x{depth}",
            "nozzle_diameter": f"{printer.nozzle_mm:g}",
            "filament_diameter": FILAMENT_MM,
            "filament_density": "1.24",
            "filament_type": "PLA",
            "first_layer_temperature": FIRST_LAYER_C,
            "temperature": LAYERS_C,
            "first_layer_bed_temperature": BED_C,
            "bed_temperature": BED_C,
            "layer_height": f"{printer.layer_mm:g}",
            "first_layer_height": f"{printer.first_layer_mm:g}",
            "fill_density": INFILL,
            "support_material": str(int(self.supports)),
        }


@dataclass(frozen=True, slots=True)
class MeshText:
    """A mesh where it lies on the bed, as the elements of a 3MF."""

    name: str
    material: int  #: `BODY` or `SYMBOLS`
    vertices: DeflatedText
    triangles: DeflatedText
    count: int  #: of its triangles


@dataclass(frozen=True, slots=True)
class PartText:
    """A part on a plate: its body, and its symbols where it has any."""

    name: str
    centre_mm: Size  #: of its box
    meshes: tuple[MeshText, ...]
    body_after: DeflatedText | None  #: triangles of the body, numbered after the symbols' vertices


@dataclass(frozen=True, slots=True)
class PrintFile:
    """One plate, its texts deflated once for all files that hold it; see the module."""

    plate: Plate
    title: str
    parts: tuple[PartText, ...]  #: in the order of the plate's places
    settings: SlicerSettings | None

    @property
    def content(self) -> bytes:
        """The 3MF with each part as an object of one or two components."""
        pieces: list[str | DeflatedText] = [_header(self.title)]
        items, number = [], 2  # of the next object; 1 are the materials
        for part in self.parts:
            references = ""
            for mesh in part.meshes:
                pieces += mesh_object(number, mesh, f'pid="1" pindex="{mesh.material}"')
                references += f'<component objectid="{number}"/>'
                number += 1
            pieces.append(
                f'<object id="{number}" type="model" name={quoteattr(part.name)}>'
                f"<components>{references}</components></object>\n"
            )
            items.append(number)
            number += 1
        return _package(_model(pieces, items))

    @property
    def prusaslicer(self) -> bytes:
        """The 3MF with each part as one mesh of one or two volumes, and PrusaSlicer's files."""
        pieces: list[str | DeflatedText] = [_header(self.title)]
        for number, part in enumerate(self.parts, 2):
            body, *symbols = part.meshes
            head = _mesh_head(number, part.name, f'pid="1" pindex="{len(symbols)}"')
            points = [mesh.vertices for mesh in (*symbols, body)]
            faces = [part.body_after or body.triangles, *(mesh.triangles for mesh in symbols)]
            pieces += [head, *points, _TO_TRIANGLES, *faces, _TO_END]
        more = {_CONFIG: _volume_settings(self)}
        if self.settings is not None:
            more |= _prusaslicer_files(self.settings)
        return _package(_model(pieces, range(2, len(self.parts) + 2)), more)


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
    corner = settings.printer.blocked_mm if settings else (0.0, 0.0)
    plates = arrange_plates([part.size for part in held], bed_mm, blocked_mm=corner)
    return tuple(_print_file(title, held, plate, settings) for plate in plates)


def print_file(
    title: str, parts: Sequence[Part], plate: Plate, settings: SlicerSettings | None = None
) -> PrintFile:
    """Return the 3MF files of one plate; its places count `parts`, which are all on it."""
    return _print_file(title, [_bed_part(part) for part in parts], plate, settings)


@dataclass(frozen=True, slots=True)
class _BedPart:
    name: str
    #: vertices (N, 3) mm, all in use, and triangles (M, 3): of the body, and of symbols if any
    meshes: tuple[tuple[NDArray[np.float64], NDArray[np.int64]], ...]
    low: NDArray[np.float64]  #: (3,) lowest x, y, z, mm
    size: Size


def _bed_part(part: Part | tuple[str, Mesh]) -> _BedPart:
    symbols: list[Mesh] = []
    if isinstance(part, Part):
        name, body = part.name, body_mesh(part)
        symbols = [mesh for mesh in symbol_meshes(part) if len(mesh.triangles)]
    else:
        name, body = part
    joined = [
        join_meshes((mesh.vertices, mesh.triangles) for mesh in own)
        for own in ([body], symbols)
        if own
    ]
    points = np.vstack([vertices for vertices, _ in joined])
    low, high = points.min(axis=0), points.max(axis=0)
    return _BedPart(name, tuple(joined), low, (float(high[0] - low[0]), float(high[1] - low[1])))


def _print_file(
    title: str, parts: Sequence[_BedPart], plate: Plate, settings: SlicerSettings | None
) -> PrintFile:
    texts = tuple(_part_text(parts[place.part], place) for place in plate.places)
    return PrintFile(plate, title, texts, settings)


def _part_text(part: _BedPart, place: BedPlace) -> PartText:
    """Return a part where it lies on the bed."""
    x, y, z = part.low.tolist()
    corner = (-(y + part.size[1]), x) if place.turned else (x, y)
    shift = np.array([place.x_mm - corner[0], place.y_mm - corner[1], -z])
    texts = []
    for material, (points, triangles) in enumerate(part.meshes):
        if place.turned:  # (x, y) -> (-y, x)
            points = np.column_stack([-points[:, 1], points[:, 0], points[:, 2]])
        words = ('<vertex x="', '" y="', '" z="', '"/>\n')
        name = f"{part.name} {('body', 'symbols')[material]}"
        vertices = _lines(words, points + shift, PLACES)
        texts.append(MeshText(name, material, vertices, _triangles(triangles), len(triangles)))
    after = None
    if len(part.meshes) > 1:
        (_, triangles), (stuck, _) = part.meshes
        after = _triangles(triangles + len(stuck), f' pid="1" p1="{BODY}"')
    width, depth = part.size[::-1] if place.turned else part.size
    middle = round(place.x_mm + width / 2, PLACES), round(place.y_mm + depth / 2, PLACES)
    return PartText(part.name, middle, tuple(texts), after)


def _triangles(triangles: NDArray[np.int64], properties: str = "") -> DeflatedText:
    return _lines(('<triangle v1="', '" v2="', '" v3="', f'"{properties}/>\n'), triangles, 0)


def _lines(
    words: tuple[str, ...], rows: NDArray[np.float64] | NDArray[np.int64], places: int
) -> DeflatedText:
    """Return an element for each row of numbers, `words` around them."""
    blocks = (rows[start : start + _BLOCK] for start in range(0, len(rows), _BLOCK))
    return deflate_text(number_lines(words, some, places) for some in blocks)


def mesh_object(number: int, mesh: MeshText, properties: str = "") -> list[str | DeflatedText]:
    """Return a mesh as an object, in pieces; `properties` are more attributes of it."""
    head = _mesh_head(number, mesh.name, properties)
    return [head, mesh.vertices, _TO_TRIANGLES, mesh.triangles, _TO_END]


def _model(pieces: Iterable[str | DeflatedText], items: Iterable[int]) -> list[DeflatedText]:
    """Return a model of objects, of which `items` lie on the bed, where their vertices are."""
    built = "".join(f'<item objectid="{number}"/>\n' for number in items)
    return deflate_pieces([*pieces, f"</resources>\n<build>\n{built}</build>\n</model>\n"])


def _mesh_head(number: int, name: str, properties: str) -> str:
    more = f" {properties}" if properties else ""
    return f'<object id="{number}" type="model" name={quoteattr(name)}{more}><mesh><vertices>\n'


def _header(title: str) -> str:
    return (
        f'{XML}<model unit="millimeter" xml:lang="en-US" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">\n'
        f'<metadata name="Title">{quoteattr(title)[1:-1]}</metadata>\n'
        '<metadata name="Application">encoded-objects</metadata>\n<resources>\n'
        '<basematerials id="1">'
        f'<base name="body" displaycolor="{hexadecimal(BODY_RGB)}"/>'
        f'<base name="symbols" displaycolor="{hexadecimal(SYMBOL_RGB)}"/></basematerials>\n'
    )


def _prusaslicer_files(settings: SlicerSettings) -> dict[str, str]:
    """Return the files that hold PrusaSlicer's settings, by name."""
    lines = [f"; {name} = {value}\n" for name, value in settings.entries.items()]
    files = {_SETTINGS: "; made by encoded-objects\n\n" + "".join(lines)}
    printer, change = settings.printer, settings.colour_change_mm
    change = printer.printed_mm(change) if change else 0.0
    if change > 0:
        # The slicer changes before the layer that ends at or above this height.
        files[_COLOUR_CHANGE] = (
            '<?xml version="1.0" encoding="utf-8"?>\n<custom_gcodes_per_print_z>\n'
            f'<code print_z="{change + printer.layer_mm:.6g}" type="0" extruder="1" '
            f'color="{hexadecimal(SYMBOL_RGB)}" '
            'extra="" gcode="M600"/>\n<mode value="SingleExtruder"/>\n'
            "</custom_gcodes_per_print_z>\n"
        )
    return files


def _volume_settings(file: PrintFile) -> str:
    """Return PrusaSlicer's settings of a plate: the ranges of triangles that are volumes."""
    entries = file.settings.entries if file.settings else {}
    own = {name: entries[name] for name in _OF_OBJECT if name in entries}
    text = [f"{XML}<config>\n"]
    for number, part in enumerate(file.parts, 2):
        text.append(
            f'<object id="{number}" instances_count="1">\n'
            f'<metadata type="object" key="name" value={quoteattr(part.name)}/>\n'
        )
        text += [
            f'<metadata type="object" key="{key}" value="{value}"/>\n' for key, value in own.items()
        ]
        first = 0
        for mesh in part.meshes:
            last = first + mesh.count - 1
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


def _package(model: Sequence[DeflatedText], more: Mapping[str, str] | None = None) -> bytes:
    """Return the zip of a model, of the two files that every 3MF has, and of some more."""
    texts = {name: deflate_pieces([text]) for name, text in (more or {}).items()}
    return zip_package(package_head() | {MODEL: model} | texts)


def package_head() -> dict[str, Sequence[DeflatedText]]:
    """Return the two files that every 3MF begins with."""
    return {
        "[Content_Types].xml": deflate_pieces([_CONTENT_TYPES]),
        "_rels/.rels": deflate_pieces([relationships([f"/{MODEL}"])]),
    }


def relationships(models: Iterable[str]) -> str:
    """Return the file that names the models of a package, or those that a model refers to."""
    found = "".join(
        f'<Relationship Target="{target}" Id="rel{number}" '
        'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
        for number, target in enumerate(models)
    )
    return f"{_RELATIONSHIPS}{found}</Relationships>\n"


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


def deflate_pieces(pieces: Iterable[str | DeflatedText]) -> list[DeflatedText]:
    """Return pieces of a text, each deflated."""
    return [deflate_text([one.encode()]) if isinstance(one, str) else one for one in pieces]


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
