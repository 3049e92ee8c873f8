"""Parts on a plate -> the two models that slicers read, from the same pieces of text.

Vertices are written where they lie on the bed: PrusaSlicer applies the transform of a build
item to the first volume alone. A part of two volumes lists the vertices of its symbols first,
as they are numbered where the symbols are an object; so only the body's triangles differ, which
are few. 3MF core specification 1.3.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

from generator.export.bed import Plate
from generator.export.colours import BODY_RGB, SYMBOL_RGB, hexadecimal
from generator.export.slicer_settings import SlicerSettings
from generator.export.threemf.meshes import BODY, SYMBOLS, BedMesh, BedPart, move_to_bed
from generator.export.threemf.package import DeflatedText, deflate_text, zip_package

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


def plate_packages(
    title: str, parts: Sequence[BedPart], plate: Plate, settings: SlicerSettings | None
) -> tuple[bytes, bytes]:
    """Return one plate as components and as volumes; its places count `parts`."""
    components, volumes = _Model(), _Model()
    for model in (components, volumes):
        model.add(_header(title))
    for place in plate.places:
        part = parts[place.part]
        body = move_to_bed(part.body, part, place)
        symbols = None if part.symbols is None else move_to_bed(part.symbols, part, place)
        _add_part(part.name, body, symbols, components, volumes)
    for model in (components, volumes):
        model.add(f"</resources>\n<build>\n{''.join(model.items)}</build>\n</model>\n")
    more = {_CONFIG: _volume_settings(parts, plate, settings)}
    if settings is not None:
        more |= {name: "".join(lines) for name, lines in settings.files().items()}
    return _package(components.pieces), _package(volumes.pieces, more)


def _add_part(
    name: str, body: BedMesh, symbols: BedMesh | None, components: _Model, volumes: _Model
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


def _add_mesh(model: _Model, mesh: BedMesh, points: DeflatedText, faces: DeflatedText) -> str:
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
    parts: Sequence[BedPart], plate: Plate, settings: SlicerSettings | None
) -> str:
    """Return PrusaSlicer's settings of a plate: the ranges of triangles that are volumes."""
    own = {} if settings is None else settings.of_object
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
    texts: dict[str, Iterable[str]] = {
        "[Content_Types].xml": [_CONTENT_TYPES],
        "_rels/.rels": [_RELATIONSHIPS],
    }
    entries = {
        name: [deflate_text(piece.encode() for piece in pieces)] for name, pieces in texts.items()
    }
    entries[_MODEL] = list(model)
    for name, text in (more or {}).items():
        entries[name] = [deflate_text([text.encode()])]
    return zip_package(entries)
