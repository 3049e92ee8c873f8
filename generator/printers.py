"""What a printer can make: the limits that symbols and panels must respect.

Figures for nozzles of 0.4 and 0.6 mm and for resin: measured with a slicer and a resin
printer's data sheet. Strokes and gaps inside symbols are the narrowest of which all survive on the
simulated print with bad faults (docs/pitches.md): of 4 mm symbols on 0.4 mm, of 4.5 mm ones on
0.6 mm, where 34 of 81 symbols of 4 mm survive; of 0.8 mm they are in proportion to 0.4 mm. A
machine is a bed with the limits of its nozzle: `prusa-mk4`, `prusa-mk4-0.6`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from generator.errors import GeneratorError


@dataclass(frozen=True, slots=True)
class Printer:
    """One printer and nozzle."""

    name: str
    description: str
    bed_mm: tuple[float, float]  #: usable x and y of the bed, mm
    layer_mm: float  #: layer height, mm; symbol heights are best a multiple of it
    stroke_min_mm: float  #: narrowest stroke that prints at its full volume, mm
    gap_min_mm: float  #: narrowest gap between two symbols or plates that stays open, mm
    gap_inside_mm: float  #: narrowest gap between two strokes of one symbol at their tops, mm
    height_min_mm: float  #: lowest symbol that can be felt after printing, mm
    edge_min_mm: float  #: least distance from a symbol's foot to a face edge, mm
    overhang_max_rad: float  #: steepest overhang, from the vertical, that needs no support
    nozzle_mm: float = 0.0  #: 0 of resin printers
    density_kg_m3: float = 1240.0  #: of its plastic, printed solid: PLA, or a usual resin
    blocked_mm: tuple[float, float] = (0.0, 0.0)  #: front left corner of the bed, not printed on
    model: str = ""  #: by which Bambu Studio and OrcaSlicer know a printer of Bambu Lab

    @property
    def first_layer_mm(self) -> float:
        """Height of the first layer, mm; what a slicer takes for it."""
        return max(self.layer_mm, FIRST_LAYER_MM) if self.nozzle_mm else self.layer_mm

    def printed_mm(self, z_mm: float) -> float:
        """Return the height at which what is designed to end at `z_mm` ends in whole layers."""
        layers = max(0, round((z_mm - self.first_layer_mm) / self.layer_mm))
        return round(self.first_layer_mm + layers * self.layer_mm, 6)


PRINTERS: dict[str, Printer] = {
    printer.name: printer
    for printer in (
        Printer("fdm-0.4", "filament, 0.4 mm nozzle, 0.2 mm layers", (250.0, 210.0), 0.2, 0.8, 0.8,
                0.24, 0.4, 0.8, math.radians(45), 0.4),
        Printer("fdm-0.25", "filament, 0.25 mm nozzle, 0.1 mm layers", (250.0, 210.0), 0.1, 0.5,
                0.5, 0.24, 0.3, 0.5, math.radians(45), 0.25),
        Printer("fdm-0.6", "filament, 0.6 mm nozzle, 0.3 mm layers", (250.0, 210.0), 0.3, 0.9, 1.0,
                0.27, 0.6, 1.2, math.radians(45), 0.6),
        Printer("fdm-0.8", "filament, 0.8 mm nozzle, 0.4 mm layers", (250.0, 210.0), 0.4, 1.6, 1.6,
                0.48, 0.8, 1.6, math.radians(45), 0.8),
        Printer("resin", "resin, 0.05 mm pixels and layers", (140.0, 85.0), 0.05, 0.4, 0.3,
                0.15, 0.1, 0.3, math.radians(60), 0.0, 1180.0),
    )
}  # fmt: skip


#: Machines that people have: name, description, usable bed in mm; with a filament nozzle or resin.
MACHINES: dict[str, tuple[str, tuple[float, float], str]] = {
    "prusa-mk4": ("Prusa MK4, MK4S, MK3.9", (250.0, 210.0), "fdm-0.4"),
    "prusa-mk3s": ("Prusa i3 MK3S", (250.0, 210.0), "fdm-0.4"),
    "prusa-mini": ("Prusa MINI", (180.0, 180.0), "fdm-0.4"),
    "prusa-xl": ("Prusa XL", (360.0, 360.0), "fdm-0.4"),
    "ender-3": ("Creality Ender 3, all of them", (220.0, 220.0), "fdm-0.4"),
    "bambu-x1c": ("Bambu Lab X1C, X1", (256.0, 256.0), "fdm-0.4"),
    "bambu-p1s": ("Bambu Lab P1S, P1P", (256.0, 256.0), "fdm-0.4"),
    "bambu-a1": ("Bambu Lab A1", (256.0, 256.0), "fdm-0.4"),
    "bambu-a1-mini": ("Bambu Lab A1 mini", (180.0, 180.0), "fdm-0.4"),
    "voron-250": ("Voron 2.4 or Trident, 250 mm", (250.0, 250.0), "fdm-0.4"),
    "voron-300": ("Voron 2.4 or Trident, 300 mm", (300.0, 300.0), "fdm-0.4"),
    "voron-350": ("Voron 2.4 or Trident, 350 mm", (350.0, 350.0), "fdm-0.4"),
    "prusa-sl1s": ("Prusa SL1S, resin", (127.0, 80.0), "resin"),
    "elegoo-mars": ("Elegoo Mars 3 and its like, resin", (143.0, 89.0), "resin"),
    "elegoo-saturn": ("Elegoo Saturn and its like, resin", (192.0, 120.0), "resin"),
}
#: Machines of Bambu Lab: the name in their slicer, and the corner of the bed where a cutter stands.
_BAMBU: dict[str, tuple[str, tuple[float, float]]] = {
    "bambu-x1c": ("Bambu Lab X1 Carbon", (18.0, 28.0)),
    "bambu-p1s": ("Bambu Lab P1S", (18.0, 28.0)),
    "bambu-a1": ("Bambu Lab A1", (0.0, 0.0)),
    "bambu-a1-mini": ("Bambu Lab A1 mini", (0.0, 0.0)),
}
NOZZLES_MM = (0.2, 0.25, 0.4, 0.6, 0.8)
FIRST_LAYER_MM = 0.2
_MACHINE = "ender-3"  #: that error messages give as an example


def printer_named(name: str) -> Printer:
    """Return the printer called `name`; raises `GeneratorError` that lists the known ones.

    >>> printer_named("prusa-mini-0.6").bed_mm, printer_named("prusa-mini-0.6").nozzle_mm
    ((180.0, 180.0), 0.6)
    """
    if name in PRINTERS:
        return PRINTERS[name]
    machine, _, nozzle = name.rpartition("-")
    sized = name not in MACHINES and nozzle in [f"{n:g}" for n in NOZZLES_MM]
    machine = machine if sized else name
    if machine in MACHINES and (not sized or PRINTERS[MACHINES[machine][2]].nozzle_mm):
        description, bed, limits = MACHINES[machine]
        model, blocked = _BAMBU.get(machine, ("", (0.0, 0.0)))
        return replace(
            printer_of_nozzle(float(nozzle)) if sized else PRINTERS[limits],
            name=name, description=description + (f", {nozzle} mm nozzle" if sized else ""),
            bed_mm=bed, model=model, blocked_mm=blocked,
        )  # fmt: skip
    known = ", ".join([*PRINTERS, *MACHINES])
    fix = f"choose one of {known}; with another nozzle as {_MACHINE}-0.6"
    raise GeneratorError(f"unknown printer '{name}'", fix=fix)


def printer_of_nozzle(nozzle_mm: float) -> Printer:
    """Return the limits of a nozzle: those of the next larger one that is known."""
    sized = {one.nozzle_mm: one for one in PRINTERS.values() if one.nozzle_mm}
    known = min((size for size in sized if size >= nozzle_mm - 1e-9), default=max(sized))
    layer = sized[known].layer_mm if known == nozzle_mm else round(nozzle_mm / 2, 2)
    return replace(sized[known], nozzle_mm=nozzle_mm, layer_mm=layer)


def known_printers() -> Iterator[Printer]:
    """Yield all printers that have a name of their own."""
    for name in (*PRINTERS, *MACHINES):
        yield printer_named(name)
