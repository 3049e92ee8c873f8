"""A set on the printer's bed: plates, a labelled overview, a packing list.

Objects with their layouts -> `SET-plate-1.3mf`, `SET-plate-1-prusaslicer.3mf`, ...,
`SET-build.html`, `SET-overview.pdf`, `SET-packing.csv`. Objects for one printer share its
plates. The packing list is made each time; where it is what stands there already, and all plates
are there, they stay.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from generator.export.atomic import Staging
from generator.export.bed import Plate, arrange_plates
from generator.export.set_files import PackedPart, can_draw, overview_pdf, packing_csv
from generator.export.threemf import PrintFile, SlicerSettings, print_file
from generator.layout.placement import Layout
from generator.pipeline.files import parts_of, settings_of
from generator.pipeline.parallel import Task, Workers
from generator.pipeline.plan import ObjectPlan
from generator.pipeline.progress import Progress, part_of_progress
from generator.pipeline.set_sheet import SetObject, SetPart, SetPlate, set_sheet
from generator.solid import Part, box, volume

if TYPE_CHECKING:
    from generator.printed.slicer import PlateCost


def write_set(
    objects: Sequence[SetObject],
    sheets: Sequence[Path],
    folder: Path,
    workers: Workers,
    progress: Progress,
    *,
    slice_plates: bool = False,
) -> tuple[Path, ...]:
    """Write the files of a set; return their paths.

    Parameters
    ----------
    sheets
        The build sheet of each object.

    Raises
    ------
    GeneratorError
        A file cannot be written.
    """
    name = _name(objects)
    measured: list[SetPart] = []
    for number, one in enumerate(objects):
        progress(f"measuring {one.plan.spec.name}", 0.3 * number / len(objects))
        measured += _measure(number, one.plan, one.layout)
    plates = _plates(objects, measured)
    packed = [_packing_rows(objects, plate, number) for number, plate in enumerate(plates, 1)]
    rows = sorted((row for some in packed for row in some), key=lambda row: row.order)
    listed = packing_csv(rows)
    with_models = any("3mf" in one.formats for one in objects)
    models = [
        f"{name}-plate-{number}{kind}.3mf"
        for number in range(1, len(plates) + 1)
        for kind in ("", "-prusaslicer")
        if with_models
    ]
    overview = [f"{name}-overview.pdf"] if can_draw() else []
    names = [f"{name}-packing.csv", f"{name}-build.html", *overview, *models]
    if not slice_plates and _same_files(folder, names, listed):
        return tuple(folder / each for each in names)
    costs: list[PlateCost | None] = [None] * len(plates)
    with Staging(folder) as staging:
        if with_models:
            contents = workers.done(
                [
                    Task(f"plate {number}", _plate_files, _plate_task(objects, name, plate))
                    for number, plate in enumerate(plates, 1)
                ],
                part_of_progress(progress, 0.3, 0.9),
            )
            for number, content in enumerate(contents, 1):
                staging.write(f"{name}-plate-{number}.3mf", content.content)
                file = f"{name}-plate-{number}-prusaslicer.3mf"
                twin = staging.write(file, content.prusaslicer)
                if slice_plates:
                    progress(f"slicing plate {number}", 0.9)
                    from generator.printed.slicer import slice_plate

                    costs[number - 1] = slice_plate(twin.staged)
        page = set_sheet(name, objects, sheets, folder, plates, costs)
        staging.write(f"{name}-build.html", page.encode())
        if overview:
            progress("drawing the overview", 0.9)
            beds = [plate.printer.bed_mm for plate in plates]
            staging.write(overview[0], overview_pdf(name, packed, beds))
        staging.write(f"{name}-packing.csv", listed)  # last: it says that the others are there
        staging.commit()
    return tuple(folder / each for each in names)


def _name(objects: Sequence[SetObject]) -> str:
    """Return what the files of the set are called: as the spec file that it comes from."""
    names = {one.plan.located.origin for one in objects}
    return names.pop() if len(names) == 1 and all(names) else "set"


def _measure(number: int, plan: ObjectPlan, layout: Layout) -> list[SetPart]:
    """Return the parts of one object with their sizes."""
    found = []
    for part in parts_of(plan, layout)[0]:
        low, high = box(part)
        x, y, z = (high - low).tolist()
        found.append(SetPart(number, part.name, (x, y, z), part.symbols, volume(part)))
    return found


def _plates(objects: Sequence[SetObject], parts: Sequence[SetPart]) -> list[SetPlate]:
    """Arrange all parts: what one printer prints with the same settings lies together."""
    plates: list[SetPlate] = []
    kinds = dict.fromkeys((one.plan.printer, settings_of(one.plan)) for one in objects)
    for printer, settings in kinds:
        own = tuple(
            part
            for part in parts
            if (objects[part.number].plan.printer, settings_of(objects[part.number].plan))
            == (printer, settings)
        )
        sizes = [part.size_mm[:2] for part in own]
        groups = [part.number for part in own]
        for plate in arrange_plates(sizes, printer.bed_mm, groups=groups):
            plates.append(SetPlate(printer, settings, plate, own))
    return plates


def _packing_rows(objects: Sequence[SetObject], plate: SetPlate, number: int) -> list[PackedPart]:
    rows = []
    for place in plate.plate.places:
        part = plate.parts[place.part]
        rows.append(
            PackedPart(
                order=(part.number, place.part),
                object=objects[part.number].plan.spec.name,
                part=part.name,
                plate=number,
                printer=plate.printer.name,
                place=place,
                size_mm=part.size_mm,
                symbols=part.symbols,
                fits=plate.plate.fits,
            )
        )
    return rows


def _plate_task(
    objects: Sequence[SetObject], title: str, plate: SetPlate
) -> tuple[str, list[tuple[ObjectPlan, Layout, list[str]]], Plate, SlicerSettings | None]:
    """Return what `_plate_files` needs: the objects on a plate, and the plate of them alone."""
    places = plate.plate.places
    numbers = dict.fromkeys(plate.parts[place.part].number for place in places)
    wanted: list[tuple[ObjectPlan, Layout, list[str]]] = []
    position: dict[str, int] = {}
    for number in numbers:
        names = [p.name for p in (plate.parts[q.part] for q in places) if p.number == number]
        position |= {name: len(position) + k for k, name in enumerate(names)}
        wanted.append((objects[number].plan, objects[number].layout, names))
    moved = tuple(
        dataclasses.replace(place, part=position[plate.parts[place.part].name]) for place in places
    )
    return title, wanted, Plate(moved, plate.plate.overhang_mm), plate.settings


def _plate_files(
    title: str,
    objects: list[tuple[ObjectPlan, Layout, list[str]]],
    plate: Plate,
    settings: SlicerSettings | None,
) -> PrintFile:
    """Build the parts of one plate and return its 3MF files."""
    parts: list[Part] = []
    for plan, layout, names in objects:
        by_name = {part.name: part for part in parts_of(plan, layout)[0]}
        parts += [by_name[name] for name in names]
    return print_file(title, parts, plate, settings)


def _same_files(folder: Path, names: Sequence[str], listed: bytes) -> bool:
    """Whether all files of the set are there, and the packing list is the same."""
    try:
        same = (folder / names[0]).read_bytes() == listed
    except OSError:
        return False
    return same and all((folder / name).is_file() for name in names)
