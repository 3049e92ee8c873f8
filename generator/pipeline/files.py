"""Parts -> files: everything that belongs to one object, staged to appear together.

`NAME-F1.step`, `NAME-F1.stl`, ... one per part in its local origin; `NAME.step`, the panels as an
assembly (`.stpz`: the same, gzipped); `NAME.3mf` and
`NAME-prusaslicer.3mf` for each plate of the printer; `NAME.glb` assembled; `NAME.xml`,
`NAME.urdf`, `NAME.sdf` with their meshes and `NAME.usda` for robots; `NAME.png`, the picture;
`NAME-build.html`, the build sheet; `NAME-array.svg`, the faces on the array.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from generator.database.registered import RegisteredPart
from generator.export.array_svg import FaceOnArray, array_svg
from generator.export.atomic import StagedFile, Staging
from generator.export.glb import glb_bytes
from generator.export.preview import preview_png
from generator.export.robot import ROBOT_FORMATS
from generator.export.slicer_settings import SlicerSettings, slicer_settings
from generator.export.step import assembly_chunks, gzip_chunks, step_chunks
from generator.export.stl import stl_chunks
from generator.export.threemf import print_files
from generator.layout.placement import Layout, object_code
from generator.pipeline.blame import errors_at
from generator.pipeline.faces import FaceReport, face_reports
from generator.pipeline.plan import ObjectPlan
from generator.pipeline.progress import Progress
from generator.pipeline.sheet import SheetPlate, build_sheet
from generator.pipeline.size import outer_size_mm
from generator.polyhedron import face_polygon
from generator.solid import (
    Mesh,
    Part,
    emboss_whole,
    panels,
    prove_closed,
    round_volume,
    triangles,
    volume,
)

if TYPE_CHECKING:
    from generator.export.fit_check import FitReport

BuiltParts = tuple[tuple[Part, ...], tuple[str, ...]]  #: of `parts_of`: the parts, what they lack


@dataclass(frozen=True, slots=True)
class StagedObject:
    """All files of one object, written but not yet under their final names."""

    registered: tuple[RegisteredPart, ...]
    parts: int
    warnings: tuple[str, ...]
    faces: tuple[FaceReport, ...]  #: what they show and promise
    fit: FitReport | None = None  #: of panels that were verified as STL


def stage(
    plan: ObjectPlan,
    layout: Layout,
    built: BuiltParts,
    formats: Sequence[str],
    staging: Staging,
    *,
    verify: bool,
    slice_plates: bool = False,
    progress: Progress,
) -> StagedObject:
    """Write all files of an object into the staging folder.

    Parameters
    ----------
    plan, layout
        The object and its symbols.
    built
        From `parts_of`.
    formats
        Of step, stl, 3mf, glb, stpz, mjcf, urdf, sdf, usd; the pictures are always made.
    verify
        Read files back by independent programs before anything is kept.
    slice_plates
        Ask PrusaSlicer what printing takes, for the build sheet.

    Raises
    ------
    SolidError
        A part did not pass its proof of closure or its verification.
    GeneratorError
        A file cannot be written.
    """
    spec = plan.spec
    parts, warnings = built
    for part in parts:
        prove_closed(part)
    meshes = [triangles(part) for part in parts]
    registered: list[RegisteredPart] = []
    panel_files: list[tuple[str, Path, NDArray[np.float64]]] = []
    for number, (part, mesh) in enumerate(zip(parts, meshes, strict=True)):
        progress(f"writing {part.name}", 0.1 + 0.6 * number / len(parts))
        step = stl = None
        if "step" in formats:
            step = staging.write(f"{part.name}.step", step_chunks(part), digest=True)
            registered.append(_part_entry(part, "step", step))
        if "stl" in formats:
            stl = staging.write(f"{part.name}.stl", stl_chunks(mesh), digest=True)
            registered.append(_part_entry(part, "stl", stl))
            panel_files.append((part.name, stl.staged, part.T_object_part))
        if verify and (step or stl):
            progress(f"verifying {part.name}", 0.1 + 0.6 * (number + 0.5) / len(parts))
            from generator.export.check import verify as read_back  # loads the CAD kernel

            read_back(
                part.name,
                volume(part),
                step=step.staged if step else None,
                stl=stl.staged if stl else None,
                round_mm3=round_volume(part),
            )
        if "stpz" in formats:
            staging.write(f"{part.name}.stpz", gzip_chunks(step_chunks(part)))
    if len(parts) > 1:
        progress("writing the assembly", 0.7)
        if "step" in formats:
            staging.write(f"{spec.name}.step", assembly_chunks(spec.name, parts))
        if "stpz" in formats:
            staging.write(f"{spec.name}.stpz", gzip_chunks(assembly_chunks(spec.name, parts)))
    fit = None
    if verify and len(panel_files) > 1:
        from generator.export.fit_check import PanelFile, verify_fit  # loads the readers of models

        progress("putting the panels together", 0.7)
        fit = verify_fit([PanelFile(*panel) for panel in panel_files], spec.gap_mm)
    on_sheet: list[SheetPlate] = []
    if "3mf" in formats:
        progress("arranging the bed", 0.7)
        plates = print_files(spec.name, parts, plan.printer.bed_mm, settings_of(plan))
        for number, plate in enumerate(plates, 1):
            suffix = f"-plate-{number}" if len(plates) > 1 else ""
            staging.write(f"{spec.name}{suffix}.3mf", plate.content)
            twin = staging.write(f"{spec.name}{suffix}-prusaslicer.3mf", plate.prusaslicer)
            cost = None
            if slice_plates:
                from generator.printed.sliced_plate import slice_plate

                progress(f"slicing plate {number}", 0.7)
                cost = slice_plate(twin.staged)
            on_sheet.append(SheetPlate(f"{spec.name}{suffix}.3mf", plate.plate, cost))
        large = [str(n) for n, plate in enumerate(plates, 1) if not plate.plate.fits]
        if large:
            width, depth = plan.printer.bed_mm
            bed = f"the bed of {plan.printer.name}, {width:g} x {depth:g} mm"
            warnings += (f"plate {', '.join(large)}: larger than {bed}; print it elsewhere",)
    if "glb" in formats:
        progress("writing the model", 0.8)
        staging.write(f"{spec.name}.glb", glb_bytes(spec.name, parts, meshes))
    if not set(ROBOT_FORMATS).isdisjoint(formats):
        progress("writing for robots", 0.82)
        warnings += _stage_robot(plan, parts, meshes, formats, staging, verify=verify)
    progress("drawing", 0.85)
    size = outer_size_mm(plan.polyhedron, parts).tolist()
    faces = face_reports(plan, layout)
    shares = {
        face.name: (face.promise.at_once, face.promise.within_three)
        for face in faces
        if face.promise is not None
    }
    staging.write(f"{spec.name}.png", preview_png(spec.name, size, parts, meshes, shares))
    page = build_sheet(plan, layout, parts, on_sheet)
    staging.write(f"{spec.name}-build.html", page.encode())
    staging.write(f"{spec.name}-array.svg", _array_picture(plan, layout).encode())
    return StagedObject(tuple(registered), len(parts), warnings, faces, fit)


def settings_of(plan: ObjectPlan) -> SlicerSettings | None:
    """Return how a slicer prints the parts of an object."""
    spec = plan.spec
    panelled = spec.parts == "panels"
    change = spec.wall_mm if panelled and spec.colours > 1 else 0.0
    return slicer_settings(plan.printer, supports=not panelled, colour_change_mm=change)


def _stage_robot(
    plan: ObjectPlan,
    parts: Sequence[Part],
    meshes: Sequence[Mesh],
    formats: Sequence[str],
    staging: Staging,
    *,
    verify: bool,
) -> tuple[str, ...]:
    """Write what robots and simulators load; return what it lacks."""
    from generator.export.robot.files import robot_files  # few want them
    from generator.export.robot.model import robot_model

    spec = plan.spec
    with errors_at(plan.located, "robot.collision, robot"):
        model = robot_model(
            spec.name, plan.polyhedron, parts, meshes, density_kg_m3=spec.density_kg_m3,
            symbols_collide=spec.collision == "symbols",
        )  # fmt: skip
    written = [staging.write(name, content).staged for name, content in robot_files(model, formats)]
    if verify:
        from generator.export.robot.check import verify_robot  # loads what reads them

        verify_robot(model, written)
    return model.warnings


def parts_of(plan: ObjectPlan, layout: Layout) -> BuiltParts:
    """Return the parts of an object, panels or the whole body, and what they lack."""
    spec = plan.spec
    if spec.parts == "whole":
        return (emboss_whole(plan.polyhedron, layout, plan.outlines, spec.name),), ()
    with errors_at(plan.located, "print.wall, print, shape"):
        made = panels(
            plan.polyhedron,
            layout,
            plan.outlines,
            spec.wall_mm,
            plan.printer,
            name=spec.name,
            code=object_code(layout, plan.array.rows, plan.array.columns),
            gap_mm=spec.gap_mm,
        )
    return made.parts, made.warnings


def _part_entry(part: Part, kind: str, written: StagedFile) -> RegisteredPart:
    return RegisteredPart(part.name, kind, str(written.path), written.sha256, part.T_object_part)


def _array_picture(plan: ObjectPlan, layout: Layout) -> str:
    faces = [
        FaceOnArray(
            plan.polyhedron.faces[face.face].name,
            face,
            tuple(plan.developed.get(face.face) or face_polygon(plan.polyhedron, face.face)),
        )
        for face in layout.faces
        if len(face.labels) or face.face not in plan.blank_faces
    ]
    array = plan.array
    title = f"{plan.spec.name} on the array {array.rows} x {array.columns}"
    return array_svg(title, array.rows, array.columns, layout.pitch_mm, faces, plan.outlines)
