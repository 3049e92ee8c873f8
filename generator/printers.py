"""What a printer can make: the limits that symbols and panels must respect.

Figures for a 0.4 mm nozzle and for resin: measured with a slicer and a resin
printer's data sheet; a stroke under two nozzle widths may print nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from generator.errors import GeneratorError


@dataclass(frozen=True, slots=True)
class Printer:
    """One printer and nozzle."""

    name: str
    description: str
    bed_mm: tuple[float, float]  #: usable x and y of the bed, mm
    layer_mm: float  #: layer height, mm; symbol heights are best a multiple of it
    stroke_min_mm: float  #: narrowest stroke that prints at its full volume, mm
    gap_min_mm: float  #: narrowest gap between two strokes that stays open, mm
    height_min_mm: float  #: lowest symbol that can be felt after printing, mm
    edge_min_mm: float  #: least distance from a symbol's foot to a face edge, mm
    overhang_max_rad: float  #: steepest overhang, from the vertical, that needs no support


PRINTERS: dict[str, Printer] = {
    printer.name: printer
    for printer in (
        Printer("fdm-0.4", "filament, 0.4 mm nozzle, 0.2 mm layers", (250.0, 210.0), 0.2, 0.8, 0.8,
                0.4, 0.8, math.radians(45)),
        Printer("fdm-0.25", "filament, 0.25 mm nozzle, 0.1 mm layers", (250.0, 210.0), 0.1, 0.5,
                0.5, 0.3, 0.5, math.radians(45)),
        Printer("resin", "resin, 0.05 mm pixels and layers", (140.0, 85.0), 0.05, 0.4, 0.3, 0.1,
                0.3, math.radians(60)),
    )
}  # fmt: skip


def printer_named(name: str) -> Printer:
    """Return the printer called `name`; raises `GeneratorError` that lists the known ones."""
    try:
        return PRINTERS[name]
    except KeyError:
        known = ", ".join(PRINTERS)
        raise GeneratorError(f"unknown printer '{name}'", fix=f"choose one of {known}") from None
