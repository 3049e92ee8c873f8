"""G-code file -> Toolpath: where a nozzle goes and how much plastic leaves it.

Reads G0-G3, G10/G11, G20/G21, G28, G90-G92, M82/M83, M200 in absolute and relative
coordinates, of Marlin, Klipper and RepRapFirmware, from PrusaSlicer, Cura, Bambu Studio and
OrcaSlicer (see `dialect`). As in Klipper and PrusaSlicer, G91 makes E relative too and M83
does so alone. M221, a machine's own correction of its extruder, is left out: the volume is
what the slicer meant. A `.gcode.3mf` of Bambu Studio is opened, binary G-code is refused.
"""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path

import numpy as np

from generator.errors import PrintError
from generator.printed.dialect import dialect_of
from generator.printed.machine import COLUMNS, Machine
from generator.printed.toolpath import LEVEL_MM, Floats, Toolpath, role_number

FILAMENT_MM = 1.75  #: diameter where a file does not tell
_HEAD = 4096  # characters of a file in which its slicer gives its name
# Announced widths are kept to a few percent; filament of 2.85 mm read as 1.75 is out by 2.65.
_WIDTHS_AGREE = (0.7, 1.5)


def read_gcode(path: Path | str, *, filament_mm: float | None = None) -> Toolpath:
    """Read a file.

    Parameters
    ----------
    path
        `.gcode`, `.gco`, `.g`, or Bambu Studio's `.gcode.3mf` (its first plate).
    filament_mm
        Diameter of the filament; else as the file says, else 1.75.

    Raises
    ------
    PrintError
        A file that cannot be read, a word that is no number or an arc that leads nowhere (with
        file:line), nothing extruded, or volumes that contradict the widths announced.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise PrintError(
            f"cannot read the G-code: {error.strerror}", fix="check the name", place=str(path)
        ) from None
    return toolpath_of(_text(content, str(path)), str(path), filament_mm=filament_mm)


def toolpath_of(text: str, name: str = "G-code", *, filament_mm: float | None = None) -> Toolpath:
    """Return the moves of G-code that was read; `name` stands in errors. See `read_gcode`."""
    machine = Machine(name)
    for number, line in enumerate(io.StringIO(text), 1):
        machine.line_number = number
        machine.line(line)
    head = next((found for line in text[:_HEAD].splitlines() if (found := dialect_of(line))), "")
    return _toolpath(machine, head or "unknown", filament_mm)


def _text(content: bytes, name: str) -> str:
    if content[:4] == b"GCDE":
        raise PrintError(
            "this is binary G-code", fix="switch 'binary G-code' off and export again", place=name
        )
    if content[:4] == b"PK\x03\x04":
        try:
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                plates = sorted(n for n in archive.namelist() if n.endswith(".gcode"))
                content = archive.read(plates[0]) if plates else b""
        except (zipfile.BadZipFile, NotImplementedError, RuntimeError):
            content = b""
        if not content:
            raise PrintError(
                "no plate in it is sliced", fix="slice, then export the G-code", place=name
            )
    return content.decode("utf-8", errors="replace")


def _toolpath(machine: Machine, dialect: str, filament_mm: float | None) -> Toolpath:
    """Return the moves that a machine made."""
    rows = np.array(machine.rows, np.float64).reshape(-1, COLUMNS)
    diameter = filament_mm or (machine.filament if machine.filament > 0 else FILAMENT_MM)
    area = math.pi * diameter**2 / 4
    volume = rows[:, 6] * np.where(rows[:, 11] > 0, 1.0, area)
    role = rows[:, 10].astype(np.int64)
    if machine.features:  # what comes before the first feature is the machine's own beginning
        role[rows[:, 12] == 0] = role_number("custom")
    role[volume == 0] = role_number("travel")
    path = Toolpath(
        name=machine.name,
        dialect=dialect,
        start_mm=rows[:, :3],
        end_mm=rows[:, 3:6],
        volume_mm3=volume,
        height_mm=rows[:, 7],
        width_mm=rows[:, 8],
        speed_mm_s=rows[:, 9],
        role=role,
    )
    laid = path.of_part
    if not laid.any():
        raise PrintError(
            f"nothing is printed in {machine.line_number} lines",
            fix="give G-code as a slicer writes it, with E",
            place=machine.name,
        )
    path.height_mm[:] = np.where(path.height_mm > 0, path.height_mm, _heights(path))
    _check_widths(path, diameter)
    return path


def _heights(path: Toolpath) -> Floats:
    """Return the height of each move's layer: its z less that of the layer below."""
    laid = path.of_part
    levels = np.unique(np.round(path.end_mm[laid, 2] / LEVEL_MM)) * LEVEL_MM
    layer = np.searchsorted(levels, path.end_mm[:, 2] + LEVEL_MM / 2, "right") - 1
    below = np.concatenate([[0.0], levels])
    heights: Floats = path.end_mm[:, 2] - below[layer.clip(0)]
    np.maximum(heights, LEVEL_MM, out=heights)
    return heights


def _check_widths(path: Toolpath, diameter: float) -> None:
    """Refuse volumes that contradict the widths announced: another filament was meant."""
    told = path.of_part & (path.width_mm > 0) & (path.length_mm > 1.0)
    if np.count_nonzero(told) < 10:
        return
    h = path.height_mm[told]
    width = path.volume_mm3[told] / path.length_mm[told] / h + h * (1 - math.pi / 4)
    ratio = float(np.median(width / path.width_mm[told]))
    if not _WIDTHS_AGREE[0] <= ratio <= _WIDTHS_AGREE[1]:
        raise PrintError(
            f"beads of {ratio:.2f} times the widths announced, with filament of {diameter:g} mm",
            fix="give the diameter of the filament, 1.75 or 2.85 mm",
            place=path.name,
        )
