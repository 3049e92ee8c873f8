"""A set on the printer's bed: plates, a labelled overview, a packing list, a build sheet.

Objects with their layouts -> `SET-plate-1.3mf`, `SET-plate-1-prusaslicer.3mf`, ...,
`SET-bambu.3mf`, `SET-build.html`, `SET-overview.pdf`, `SET-packing.csv`. Objects for one printer
share its plates. The packing list is made each time; where the one that stands there is equal,
and all plates are there, they stay.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Collection, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from generator.export.atomic import Staging
from generator.export.bambu import PLATES_MAX, project_3mf, project_names
from generator.export.bed import Plate, arrange_plates
from generator.export.drawing import draw_plate, rectangle
from generator.export.set_files import SetPart, SetPlate, can_draw, overview_pdf, packing_csv
from generator.export.sheet import Figure, Mark, Section, sheet_html
from generator.export.threemf import PrintFile, SlicerSettings, print_file
from generator.layout.placement import Layout, object_code
from generator.pipeline.files import parts_of, settings_of
from generator.pipeline.made import overhangs
from generator.pipeline.make import MakeJob
from generator.pipeline.parallel import Task, Workers
from generator.pipeline.plan import ObjectPlan
from generator.pipeline.progress import Progress, part_of_progress
from generator.pipeline.sheet import Rows, cost_text, layers_text, material_text
from generator.printers import Printer
from generator.solid import Part, box, volume

if TYPE_CHECKING:
    from generator.printed.slicer import PlateCost

SetObject = tuple[MakeJob, Layout]  #: one object of a set, as it was made


def write_set(
    objects: Sequence[SetObject],
    folder: Path,
    workers: Workers,
    progress: Progress,
    *,
    slice_plates: bool = False,
    replace: bool = False,
) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Write the files of a set; return their paths, and those that print all plates.

    Raises
    ------
    FileThereError
        Another file has the name of one, and may not be replaced.
    """
    name = _name(objects)
    measured: list[SetPart] = []
    for number, (job, layout) in enumerate(objects):
        progress(f"measuring {job.plan.spec.name}", 0.3 * number / len(objects))
        measured += _measure(number, job.plan, layout)
    plates = _plates(objects, measured)
    listed = packing_csv(plates)
    with_models = any("3mf" in job.formats for job, _ in objects)
    of_bambu = {job.plan.printer for job, _ in objects if "bambu" in job.formats}
    models = [f"{name}-plate-{number}" for number in range(1, len(plates) + 1)]
    written = [f"{m}{kind}.3mf" for m in models for kind in ("", "-prusaslicer") if with_models]
    projects = _projects(name, plates, of_bambu)
    written += projects
    packed_in = {number for numbers in projects.values() for number in numbers}
    alone = [f"{m}.3mf" for k, m in enumerate(models) if with_models and k not in packed_in]
    to_print = tuple(folder / each for each in (*projects, *alone))
    overview = [f"{name}-overview.pdf"] if can_draw() else []
    names = [f"{name}-packing.csv", f"{name}-build.html", *overview, *written]
    if not slice_plates and _same_files(folder, names, listed):
        return tuple(folder / each for each in names), to_print
    costs: list[PlateCost | None] = [None] * len(plates)
    with Staging(folder) as staging:
        contents = workers.done(
            [
                Task(f"plate {number}", _plate_files, _plate_task(objects, name, plate))
                for number, plate in enumerate(plates if written else (), 1)
            ],
            part_of_progress(progress, 0.3, 0.9),
        )
        for project, numbers in projects.items():
            staging.write(project, project_3mf(name, [contents[k] for k in numbers]))
        for k, content in enumerate(contents if with_models else ()):
            staging.write(f"{models[k]}.3mf", content.content)
            twin = staging.write(f"{models[k]}-prusaslicer.3mf", content.prusaslicer)
            if slice_plates:
                progress(f"slicing plate {k + 1}", 0.9)
                from generator.printed.slicer import slice_plate

                costs[k] = slice_plate(twin.staged)
        files = [f"{model}.3mf" for model in models]
        for project, numbers in projects.items():
            for k, number in enumerate(numbers, 1):
                files[number] = f"{project}, plate {k}"
        page = _set_sheet(name, objects, folder, plates, costs, files)
        staging.write(f"{name}-build.html", page.encode())
        if overview:
            progress("drawing the overview", 0.9)
            staging.write(overview[0], overview_pdf(name, plates))
        staging.write(f"{name}-packing.csv", listed)  # last: it says that the others are there
        if not replace:
            staging.refuse_others()
        staging.commit()
    return tuple(folder / each for each in names), to_print


def build_sheet_path(job: MakeJob) -> Path:
    """Return where the build sheet of an object stands."""
    return job.folder / f"{job.plan.spec.name}-build.html"


def _name(objects: Sequence[SetObject]) -> str:
    """Return the name of the set's files: that of the spec file it comes from."""
    names = {job.plan.spec.origin for job, _ in objects}
    return names.pop() if len(names) == 1 and all(names) else "set"


def _measure(number: int, plan: ObjectPlan, layout: Layout) -> list[SetPart]:
    found = []
    for part in parts_of(plan, layout)[0]:
        low, high = box(part)
        x, y, z = (high - low).tolist()
        own = plan.spec.name, part.name, (x, y, z), part.symbols, volume(part)
        found.append(SetPart(number, *own))
    return found


def _plates(objects: Sequence[SetObject], parts: Sequence[SetPart]) -> list[SetPlate]:
    """Arrange all parts: those that one printer prints with the same settings lie together."""
    plates: list[SetPlate] = []
    ways = [(job.plan.printer, settings_of(job.plan, layout)) for job, layout in objects]
    for printer, settings in dict.fromkeys(ways):
        own = tuple(part for part in parts if ways[part.number] == (printer, settings))
        sizes = [part.size_mm[:2] for part in own]
        groups = [part.number for part in own]
        for plate in arrange_plates(sizes, printer.bed_mm, groups, printer.blocked_mm):
            plates.append(SetPlate(printer, settings, plate, own))
    return plates


def _projects(
    name: str, plates: Sequence[SetPlate], printers: Collection[Printer]
) -> dict[str, list[int]]:
    """Return the projects for Bambu Studio of some printers' plates, with the plates' numbers."""
    by_printer: dict[Printer, list[int]] = {}
    for number, plate in enumerate(plates):
        by_printer.setdefault(plate.printer, []).append(number)
    batches = [
        own[k : k + PLATES_MAX]
        for printer, own in by_printer.items()
        if printer in printers
        for k in range(0, len(own), PLATES_MAX)
    ]
    return dict(zip(project_names(name, len(batches)), batches, strict=True))


def _plate_task(
    objects: Sequence[SetObject], title: str, plate: SetPlate
) -> tuple[str, list[tuple[ObjectPlan, Layout, list[str]]], Plate, SlicerSettings | None]:
    """Return the arguments of `_plate_files`: objects on a plate, and the plate of them alone."""
    wanted = [
        (objects[number][0].plan, objects[number][1], [part.name for part, _ in own])
        for number, own in groupby(plate.held, key=lambda held: held[0].number)
    ]
    places = plate.plate.places
    alone = tuple(dataclasses.replace(place, part=k) for k, place in enumerate(places))
    return title, wanted, Plate(alone, plate.plate.overhang_mm), plate.settings


def _plate_files(
    title: str,
    objects: list[tuple[ObjectPlan, Layout, list[str]]],
    plate: Plate,
    settings: SlicerSettings | None,
) -> PrintFile:
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


def _set_sheet(
    name: str,
    objects: Sequence[SetObject],
    folder: Path,
    plates: Sequence[SetPlate],
    costs: Sequence[PlateCost | None],
    files: Sequence[str],
) -> str:
    printers = list(dict.fromkeys(plate.printer for plate in plates))
    drawings, lying = [], [list[str]() for _ in objects]
    for number, (plate, cost, file) in enumerate(zip(plates, costs, files, strict=True), 1):
        held = sorted({part.number for part, _ in plate.held})
        for one in held:
            lying[one].append(str(number))
        what = ", ".join(objects[one][0].plan.spec.name for one in held)
        if len(printers) > 1:
            what = f"{plate.printer.name}: {what}"
        boxes = [(p.name, [rectangle((0, 0), p.size_mm[:2])]) for p in plate.parts]
        drawing = draw_plate(boxes, plate.plate, plate.printer.bed_mm)
        text = what + (f"; {cost}" if cost else "")
        drawings.append(Figure(drawing, text, file))
    listed = []
    for (job, layout), on in zip(objects, lying, strict=True):
        link = Path(os.path.relpath(build_sheet_path(job), folder)).as_posix()
        code = object_code(layout, job.plan.array.rows, job.plan.array.columns)
        listed.append((job.plan.spec.name, Mark(code), ", ".join(on), Mark(link, quote(link))))
    facts = _facts(objects, plates, costs, printers)
    sort = (
        "Every back names its object, or bears its mark where the name has no room: sort the parts "
        "by object before anything is glued."
    )
    again = (
        "The plates above hold everything. Each folder has plates of its object alone, too: for "
        "one that is printed again."
    )
    head = ("object", "mark on small parts", "plates", "sheet")
    return sheet_html(
        f"{name}: build sheet",
        [
            Section(rows=facts),
            Section("Objects and their marks", head=head, rows=listed),
            Section("Print", figures=drawings, notes=(sort, again)),
        ],
    )


def _facts(
    objects: Sequence[SetObject],
    plates: Sequence[SetPlate],
    costs: Sequence[PlateCost | None],
    printers: Sequence[Printer],
) -> Rows:
    counts = len(objects), sum(len(plate.held) for plate in plates), len(plates)
    rows = list(zip(("objects", "parts", "plates"), map(str, counts), strict=True))
    for printer in printers:
        rows.append(("printer", f"{printer.name}: {printer.description}"))
        rows.append(("layers", layers_text(printer)))
    by_way: dict[str, list[str]] = {}
    for job, layout in objects:
        by_way.setdefault(overhangs(job.plan, layout).text, []).append(job.plan.spec.name)
    for way, names in by_way.items():
        rows.append(("on the bed", way if len(by_way) == 1 else f"{', '.join(names)}: {way}"))
    rows.append(("scale", "100 %"))
    for resin in sorted({not printer.nozzle_mm for printer in printers}):
        alike = [plate for plate in plates if (not plate.printer.nozzle_mm) == resin]
        volume_mm3 = sum(part.volume_mm3 for plate in alike for part, _ in plate.held)
        rows.append(("material", material_text(volume_mm3, resin=resin)))
    if plates and (printing := cost_text(costs)):
        rows.append(("printing", printing))
    return tuple(rows)
