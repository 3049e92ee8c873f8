"""Plates -> a project of Bambu Studio and OrcaSlicer: `NAME-bambu.3mf`.

All plates are in one file. A part is an object of one or two parts, body and symbols, in filament
1 and 2. What the slicers ask for, as their source has it (`bbs_3mf.cpp`, `PartPlate`, `Preset.cpp`
of Bambu Studio 2.6 and OrcaSlicer 2.3.1):

- `Application` begins with "BambuStudio-". Settings are read if the major version is that of the
  slicer; a newer version than its own brings a warning.
- Meshes stand in files of their own (3MF production extension 1.1), their ids unique in the
  package: objects of one id share a mesh, whatever their file.
- `Metadata/model_settings.config` says which filament prints a part and what lies on which plate.
- Plates stand in rows of as many as the root of their number, rounded up, a fifth of a plate
  apart: the first at the origin, the next row in front of it.
- A setting is taken from the system presets that `*_settings_id` name, unless
  `different_settings_to_system` has it. Without known presets all settings count as they stand.
"""

from __future__ import annotations

import json
import math
import uuid
from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

from generator.errors import WriteError
from generator.export.bed import Size
from generator.export.colours import BODY_RGB, SYMBOL_RGB, hexadecimal
from generator.export.formats import ExportedObject, Files
from generator.export.threemf import (
    BED_C,
    FILAMENT_MM,
    FIRST_LAYER_C,
    INFILL,
    LAYERS_C,
    MODEL,
    PLACES,
    SYMBOLS,
    XML,
    DeflatedText,
    PartText,
    PrintFile,
    SlicerSettings,
    deflate_pieces,
    mesh_object,
    package_head,
    relationships,
    zip_package,
)

PLATES_MAX = 36  #: of one project
_VERSION = "02.00.00.00"  # that both slicers accept
_PLATE_STEP = 1.2  # from one plate to the next, in plates
_FLUSH_MM3 = "280"  # of plastic at a change of filament, as the slicers have it unasked
#: How system presets call the machines of these models; others are called as their last word.
_CODES = {"Bambu Lab X1 Carbon": "X1C", "Bambu Lab P1S": "X1C", "Bambu Lab A1 mini": "A1M"}
_HEAD = (
    f'{XML}<model unit="millimeter" xml:lang="en-US" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06" '
    'requiredextensions="p">\n'
)


def write_projects(exported: ExportedObject) -> Files:
    """Yield the projects of an object: one, or as many as its plates need.

    Raises `WriteError` for a printer without a nozzle.
    """
    plates, name = exported.plates, exported.name
    batches = [plates[k : k + PLATES_MAX] for k in range(0, len(plates), PLATES_MAX)]
    for file, batch in zip(project_names(name, len(batches)), batches, strict=True):
        yield file, project_3mf(name, batch)


def project_names(name: str, count: int) -> list[str]:
    """Return the names of so many projects."""
    return [f"{name}-bambu{f'-{k}' * (count > 1)}.3mf" for k in range(1, count + 1)]


def plate_origins_mm(count: int, bed_mm: Size) -> list[Size]:
    """Return where the front left corner of each plate stands."""
    columns = math.isqrt(count - 1) + 1
    width, depth = (side * _PLATE_STEP for side in bed_mm)
    return [(k % columns * width, -(k // columns) * depth) for k in range(count)]


@dataclass(slots=True)
class _Texts:
    title: str
    files: dict[str, Sequence[DeflatedText]] = field(default_factory=dict)  #: of meshes, by path
    objects: list[str] = field(default_factory=list)
    items: list[str] = field(default_factory=list)
    settings: list[str] = field(default_factory=list)
    number: int = 1  #: of the next object

    def uuid(self, *numbers: int) -> str:
        """Return the attribute that names what these numbers stand for: the same in each run."""
        return f'p:UUID="{uuid.uuid5(uuid.NAMESPACE_OID, f"{self.title}/{numbers}")}"'

    def add(self, part: PartText, origin: Size, settings: SlicerSettings) -> int:
        """Add a part on the plate that begins at `origin`; return the number of its object."""
        path = f"3D/Objects/object_{len(self.files) + 1}.model"
        numbers = range(self.number, self.number + len(part.meshes))
        meshes: list[str | DeflatedText] = [_HEAD, "<resources>\n"]
        for number, mesh in zip(numbers, part.meshes, strict=True):
            meshes += mesh_object(number, mesh, self.uuid(number))
        self.files[path] = deflate_pieces([*meshes, "</resources>\n<build/>\n</model>\n"])
        own, (x, y) = numbers.stop, part.centre_mm
        components = "".join(
            f'<component p:path="/{path}" objectid="{number}" {self.uuid(own, number)} '
            f'transform="{_transform(-x, -y)}"/>'
            for number in numbers
        )
        self.objects.append(
            f'<object id="{own}" {self.uuid(own)} type="model" name={quoteattr(part.name)}>'
            f"<components>{components}</components></object>\n"
        )
        placed = _transform(x + origin[0], y + origin[1])
        self.items.append(f'<item objectid="{own}" {self.uuid(own, 0)} transform="{placed}"/>\n')
        supports = int(settings.supports)
        self.settings.append(
            f'<object id="{own}">\n{_values(name=part.name, extruder=1, enable_support=supports)}'
        )
        for number, mesh in zip(numbers, part.meshes, strict=True):
            filament = 2 if settings.symbols_apart and mesh.material == SYMBOLS else 1
            matrix = f"1 0 0 {_number(-x)} 0 1 0 {_number(-y)} 0 0 1 0 0 0 0 1"
            values = _values(name=mesh.name, matrix=matrix, extruder=filament)
            self.settings.append(f'<part id="{number}" subtype="normal_part">\n{values}</part>\n')
        self.settings.append("</object>\n")
        self.number = own + 1
        return own


def project_3mf(title: str, plates: Sequence[PrintFile]) -> bytes:
    """Return the project of plates of one printer; raises `WriteError` where it has no nozzle."""
    printers = {plate.settings.printer for plate in plates if plate.settings is not None}
    if not printers:
        fix = "leave bambu out of formats, or choose a printer of filament"
        raise WriteError("Bambu Studio and OrcaSlicer print filament, this printer resin", fix=fix)
    (printer,) = printers
    texts, on_plates = _Texts(title), []
    origins = plate_origins_mm(len(plates), printer.bed_mm)
    for number, (plate, origin) in enumerate(zip(plates, origins, strict=True), 1):
        settings = plate.settings or SlicerSettings(printer)
        held = [texts.add(part, origin, settings) for part in plate.parts]
        on_plates.append(f"<plate>\n{_values(plater_id=number, plater_name='', locked='false')}")
        on_plates += [
            f"<model_instance>\n{_values(object_id=k, instance_id=0, identify_id=k)}"
            "</model_instance>\n"
            for k in held
        ]
        on_plates.append("</plate>\n")
    build = f"<build {texts.uuid(0)}>\n{''.join(texts.items)}</build>\n"
    model = (
        f'{_HEAD}<metadata name="Title">{quoteattr(title)[1:-1]}</metadata>\n'
        f'<metadata name="Application">BambuStudio-{_VERSION}</metadata>\n'
        f"<resources>\n{''.join(texts.objects)}</resources>\n{build}</model>\n"
    )
    described = "".join([f"{XML}<config>\n", *texts.settings, *on_plates, "</config>\n"])
    supports = any(plate.settings.supports for plate in plates if plate.settings is not None)
    written = {
        MODEL: model,
        "3D/_rels/3dmodel.model.rels": relationships(f"/{path}" for path in texts.files),
        "Metadata/model_settings.config": described,
        "Metadata/project_settings.config": _print_settings(SlicerSettings(printer, supports)),
    }
    more = {name: deflate_pieces([text]) for name, text in written.items()}
    return zip_package(package_head() | more | texts.files)


def _print_settings(settings: SlicerSettings) -> str:
    """Return the settings of a project: ours, and the names of presets for the rest."""
    printer, nozzle = settings.printer, f"{settings.printer.nozzle_mm:g}"
    width, depth = (f"{side:g}" for side in printer.bed_mm)
    ours: dict[str, str | list[str]] = {
        "layer_height": f"{printer.layer_mm:g}",
        "initial_layer_print_height": f"{printer.first_layer_mm:g}",
        "sparse_infill_density": INFILL,
        "enable_support": str(int(settings.supports)),
        "enable_prime_tower": "0",  # plates are full: it would stand on parts
    }
    presets: dict[str, str | list[str]] = {}
    if printer.model:
        code = _CODES.get(printer.model, printer.model.split()[-1])
        sized = "" if nozzle == "0.4" else f" {nozzle} nozzle"
        plastic = f"Bambu PLA Basic @BBL {code}" + sized * (nozzle == "0.2")
        presets = {
            "printer_model": printer.model,
            "printer_settings_id": f"{printer.model} {nozzle} nozzle",
            "print_settings_id": f"{printer.nozzle_mm / 2:.2f}mm Standard @BBL {code}{sized}",
            "filament_settings_id": [plastic] * 2,
            "inherits_group": [""] * 4,
            "different_settings_to_system": [";".join(ours), "", "", ""],
        }
    rest: dict[str, str | list[str]] = {
        "version": _VERSION,
        "name": "project_settings",
        "from": "project",
        "printer_technology": "FFF",
        "printer_variant": nozzle,
        "nozzle_diameter": [nozzle],
        "extruder_type": ["Direct Drive"],
        "printable_area": ["0x0", f"{width}x0", f"{width}x{depth}", f"0x{depth}"],
        "curr_bed_type": "Textured PEI Plate",
        "filament_colour": [hexadecimal(BODY_RGB), hexadecimal(SYMBOL_RGB)],
        "filament_type": ["PLA"] * 2,
        "filament_diameter": [FILAMENT_MM] * 2,
        "nozzle_temperature_initial_layer": [FIRST_LAYER_C] * 2,
        "nozzle_temperature": [LAYERS_C] * 2,
        "textured_plate_temp_initial_layer": [BED_C] * 2,
        "textured_plate_temp": [BED_C] * 2,
        "flush_volumes_matrix": ["0", _FLUSH_MM3, _FLUSH_MM3, "0"],
    }
    return json.dumps(rest | presets | ours, indent=4) + "\n"


def _values(**values: str | int) -> str:
    return "".join(
        f'<metadata key="{key}" value={quoteattr(str(value))}/>\n' for key, value in values.items()
    )


def _transform(x_mm: float, y_mm: float) -> str:
    return f"1 0 0 0 1 0 0 0 1 {_number(x_mm)} {_number(y_mm)} 0"


def _number(value_mm: float) -> str:
    return f"{round(value_mm, PLACES) + 0.0:.{PLACES}f}"
