"""Parts -> 3MF: body and symbols as separate objects, arranged on the printer's bed.

Slicers read two ways to say that a body and its symbols belong together, so each plate is
made in both; the same meshes are written and deflated once:

- ``components`` (3MF core specification 1.3): each part is an object of two components,
  "<part> body" and "<part> symbols". Bambu Studio, Orca, Cura and 3D Builder keep them
  together; PrusaSlicer asks when a person opens the file, and headless it drops the symbols
  beside the body.
- ``volumes``: each part is one mesh, and a settings file that PrusaSlicer and SuperSlicer
  read names the two ranges of its triangles, beside `SlicerSettings`. Others see one mesh of
  two materials.

Body and symbols have a material each. The file is a zip whose dates are fixed; mm.

::

    meshes.py   a part's body and symbols, on the bed, as text
    model.py    the two models of a plate
    package.py  deflated pieces -> zip
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from generator.export.bed import Plate, Size, arrange_plates
from generator.export.formats import ExportedObject, Files
from generator.export.slicer_settings import SlicerSettings
from generator.export.threemf.meshes import BedPart, bed_part, bed_part_of_mesh
from generator.export.threemf.model import plate_packages
from generator.solid.part import Part
from generator.solid.triangulate import Mesh


@dataclass(frozen=True, slots=True)
class PrintFile:
    """One plate as two 3MF files; see the module."""

    plate: Plate
    content: bytes  #: body and symbols as components
    prusaslicer: bytes  #: as volumes


def write_plates(exported: ExportedObject) -> Files:
    """Yield both 3MF files of each plate of an object."""
    for number, plate in enumerate(exported.plates, 1):
        stem = exported.name + (f"-plate-{number}" if len(exported.plates) > 1 else "")
        yield f"{stem}.3mf", plate.content
        yield f"{stem}-prusaslicer.3mf", plate.prusaslicer


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
    return _arrange(title, [bed_part(part) for part in parts], bed_mm, settings, gap_mm)


def mesh_print_files(
    title: str,
    meshes: Sequence[tuple[str, Mesh]],
    bed_mm: Size,
    settings: SlicerSettings | None = None,
    gap_mm: float = 5.0,
) -> tuple[PrintFile, ...]:
    """Arrange meshes without symbols, each with its name, as `print_files` arranges parts."""
    parts = [bed_part_of_mesh(name, mesh) for name, mesh in meshes]
    return _arrange(title, parts, bed_mm, settings, gap_mm)


def print_file(
    title: str, parts: Sequence[Part], plate: Plate, settings: SlicerSettings | None = None
) -> PrintFile:
    """Return the 3MF files of one plate; its places count `parts`, which are all on it."""
    return _print_file(title, [bed_part(part) for part in parts], plate, settings)


def _arrange(
    title: str,
    parts: Sequence[BedPart],
    bed_mm: Size,
    settings: SlicerSettings | None,
    gap_mm: float,
) -> tuple[PrintFile, ...]:
    plates = arrange_plates([part.size for part in parts], bed_mm, gap_mm)
    return tuple(_print_file(title, parts, plate, settings) for plate in plates)


def _print_file(
    title: str, parts: Sequence[BedPart], plate: Plate, settings: SlicerSettings | None
) -> PrintFile:
    return PrintFile(plate, *plate_packages(title, parts, plate, settings))
