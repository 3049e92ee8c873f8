"""The build sheet of a set: how its plates are printed, and which object lies on which.

Objects + plates -> `SET-build.html`; each object has a sheet of its own.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from generator.export.bed import Plate
from generator.export.sheet.drawing import draw_boxes
from generator.export.sheet.page import sheet_html
from generator.export.sheet.values import BuildSheet, Rows
from generator.export.threemf import SlicerSettings
from generator.layout.placement import Layout, object_code
from generator.pipeline.plan import ObjectPlan
from generator.pipeline.sheet import layers_text, lies_text, material_text
from generator.printers import Printer

if TYPE_CHECKING:
    from generator.printed.slicer import PlateCost


@dataclass(frozen=True, slots=True)
class SetObject:
    """One object of a set, as it was made."""

    plan: ObjectPlan
    layout: Layout
    formats: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SetPart:
    """One part and the room it takes."""

    number: int  #: of the object
    name: str
    size_mm: tuple[float, float, float]
    symbols: int
    volume_mm3: float


@dataclass(frozen=True, slots=True)
class SetPlate:
    """One plate, and the parts that its places count."""

    printer: Printer
    settings: SlicerSettings | None
    plate: Plate
    parts: tuple[SetPart, ...]


def set_sheet(
    name: str,
    objects: Sequence[SetObject],
    sheets: Sequence[Path],
    folder: Path,
    plates: Sequence[SetPlate],
    costs: Sequence[PlateCost | None],
) -> str:
    """Return the build sheet of a set: its plates, and the objects with their codes."""
    printers = list(dict.fromkeys(plate.printer for plate in plates))
    drawings, lying = [], [list[str]() for _ in objects]
    for number, (plate, cost) in enumerate(zip(plates, costs, strict=True), 1):
        held = sorted({plate.parts[place.part].number for place in plate.plate.places})
        for one in held:
            lying[one].append(str(number))
        what = ", ".join(objects[one].plan.spec.name for one in held)
        if len(printers) > 1:
            what = f"{plate.printer.name}: {what}"
        drawings.append(
            (
                f"{name}-plate-{number}.3mf",
                what + (f"; {cost}" if cost else ""),
                draw_boxes(
                    [(p.name, p.size_mm[:2]) for p in plate.parts],
                    plate.plate,
                    plate.printer.bed_mm,
                ),
            )
        )
    listed = tuple(
        (
            one.plan.spec.name,
            object_code(one.layout, one.plan.array.rows, one.plan.array.columns),
            ", ".join(on),
            Path(os.path.relpath(sheet, folder)).as_posix(),
        )
        for one, sheet, on in zip(objects, sheets, lying, strict=True)
    )
    facts = _facts(objects, plates, costs, printers)
    sort = (
        "Every back names its object, or bears the object's short code: sort the parts by object "
        "before anything is glued."
    )
    again = (
        "The plates above hold everything. Each folder has plates of its object alone, too: for "
        "one that is printed again."
    )
    return sheet_html(BuildSheet(name, facts, tuple(drawings), notes=(sort, again), objects=listed))


def _facts(
    objects: Sequence[SetObject],
    plates: Sequence[SetPlate],
    costs: Sequence[PlateCost | None],
    printers: Sequence[Printer],
) -> Rows:
    parts = [plate.parts[place.part] for plate in plates for place in plate.plate.places]
    rows = [("objects", str(len(objects))), ("parts", str(len(parts)))]
    rows.append(("plates", str(len(plates))))
    for printer in printers:
        rows += [("printer", f"{printer.name}: {printer.description}")]
        rows += [("layers", layers_text(printer))]
    by_way: dict[str, list[str]] = {}
    for one in objects:
        by_way.setdefault(lies_text(one.plan, one.layout), []).append(one.plan.spec.name)
    for way, names in by_way.items():
        rows.append(("lies", way if len(by_way) == 1 else f"{', '.join(names)}: {way}"))
    rows.append(("scale", "100 %"))
    for resin in sorted({not printer.nozzle_mm for printer in printers}):
        volume_mm3 = sum(
            plate.parts[place.part].volume_mm3
            for plate in plates
            for place in plate.plate.places
            if (not plate.printer.nozzle_mm) == resin
        )
        rows.append(("material", material_text(volume_mm3, resin=resin)))
    if plates and all(cost is not None for cost in costs):
        minutes = sum(cost.minutes for cost in costs if cost)
        grams = sum(cost.filament_g for cost in costs if cost)
        rows.append(("printing", f"{minutes // 60} h {minutes % 60} min, {grams:.0f} g"))
    return tuple(rows)
