"""Parts -> files: everything that belongs to one object, staged to appear together.

`NAME-F1.step`, `NAME-F1.stl`, ... one per part in its local origin; `NAME.step`, the panels as an
assembly (`.stpz`: gzipped); `NAME.3mf` and `NAME-prusaslicer.3mf` for each plate of the printer;
`NAME-bambu.3mf` with all plates; `NAME.glb` assembled; `NAME.xml`, `NAME.urdf`, `NAME.sdf` with
their meshes and `NAME.usdc` for robots; the picture `NAME.png`, the build sheet
`NAME-build.html`, and `NAME-array.svg`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.output import some_of
from generator.alphabet.figures import in_figures
from generator.database.registered import RegisteredPart
from generator.export.array_svg import FaceOnArray, array_svg
from generator.export.atomic import Staging
from generator.export.bambu import PLATES_MAX
from generator.export.bed import arrange_plates
from generator.export.formats import EXPORTERS, ExportedObject, stage_formats
from generator.export.preview import preview_png
from generator.export.threemf import SlicerSettings
from generator.layout.placement import Layout, object_code
from generator.pipeline.faces import face_reports
from generator.pipeline.made import MadeObject, describe_object, overhangs, stance_of
from generator.pipeline.place import BuiltParts
from generator.pipeline.plan import TAG_BACK, ObjectPlan
from generator.pipeline.progress import Progress
from generator.pipeline.sheet import SheetPlate, build_sheet
from generator.polyhedron import Polyhedron, face_polygon
from generator.polyhedron.shapes import FRAME_STEP_MM
from generator.solid import Mesh, Part, box, emboss_whole, panels, prove_closed, triangles
from generator.solid.marks import NameMark
from generator.solid.panels import with_name
from generator.spec.problem import error_location


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
) -> tuple[MadeObject, tuple[RegisteredPart, ...]]:
    """Write all files of an object into the staging folder: `formats` of `EXPORTERS`, and pictures.

    Return the object as it will be made, still without files, and what is registered of its parts.
    Without formats nothing is written.

    Parameters
    ----------
    built
        From `parts_of`.
    verify
        Read files back by independent programs before anything is kept.
    slice_plates
        Ask PrusaSlicer for the cost of printing, for the build sheet.

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
    exported = ExportedObject(
        spec.name, plan.polyhedron, parts, meshes, plan.printer.bed_mm,
        settings_of(plan, layout),
        density_kg_m3=spec.density_kg_m3, stroke_mm=spec.style.stroke_mm,
        touch=spec.collision == "touch",
    )  # fmt: skip
    staged = stage_formats(exported, formats, staging, verify=verify, progress=progress)
    registered = tuple(
        RegisteredPart(part.name, kind, str(file.path), file.sha256, part.T_object_part)
        for number, part in enumerate(parts)
        for kind in staged
        if EXPORTERS[kind].registered
        for file in [staged[kind][number]]
    )
    fit = None
    if verify and "stl" in staged and len(parts) > 1:
        from generator.export.check import verify_fit  # loads the readers of models

        progress("putting the panels together", 0.8)
        fit = verify_fit(parts, [file.staged for file in staged["stl"]], spec.gap_mm)
    on_sheet: list[SheetPlate] = []
    plates = exported.plates if {"3mf", "bambu"} & staged.keys() else ()
    if plates:
        for number, plate in enumerate(plates):
            cost = None
            if slice_plates and "3mf" in staged:
                from generator.printed.slicer import slice_plate

                progress(f"slicing plate {number + 1}", 0.8)
                cost = slice_plate(staged["3mf"][2 * number + 1].staged)
            if "bambu" in staged:
                project = staged["bambu"][number // PLATES_MAX].path.name
                name = f"{project}, plate {number % PLATES_MAX + 1}"
            else:
                name = staged["3mf"][2 * number].path.name
            on_sheet.append(SheetPlate(name, plate.plate, cost))
    if any(EXPORTERS[name].robot for name in formats):
        warnings += exported.robot.warnings
    made = describe_object(plan, layout, len(parts), warnings, face_reports(plan, layout), fit=fit)
    if formats:
        progress("drawing", 0.85)
        _draw(plan, made, parts, meshes, on_sheet, staging)
    return made, registered


def _draw(
    plan: ObjectPlan, made: MadeObject, parts: Sequence[Part], meshes: Sequence[Mesh],
    plates: Sequence[SheetPlate], staging: Staging,
) -> None:  # fmt: skip
    name, layout = plan.spec.name, made.layout
    size = outer_size_mm(plan.polyhedron, parts).tolist()
    shares: dict[str, tuple[float, float | None]] = {}
    if made.promise is not None and not made.promise.one_side:  # blank faces answer nothing
        shares = dict.fromkeys([face.name for face in plan.polyhedron.faces], (0.0, None))
    shares |= {
        face.name: (face.promise.at_once, face.promise.within_three)
        for face in made.face_reports
        if face.promise is not None
    }
    picture = preview_png(name, size, parts, meshes, shares)
    staging.write(f"{name}.png", picture)
    page = build_sheet(plan, layout, parts, plates, picture, made.promise)
    staging.write(f"{name}-build.html", page.encode())
    staging.write(f"{name}-array.svg", _array_picture(plan, layout).encode())


def settings_of(plan: ObjectPlan, layout: Layout) -> SlicerSettings | None:
    """Return how a slicer prints the parts of an object; None: in resin."""
    spec = plan.spec
    panelled = spec.parts == "panels"
    if not plan.printer.nozzle_mm:
        return None
    return SlicerSettings(
        plan.printer,
        supports=bool(overhangs(plan, layout).faces),
        colour_change_mm=spec.wall_mm if panelled and spec.colours > 1 else 0.0,
        symbols_apart=panelled or spec.colours > 1,  # of one body they share all layers with it
    )


def parts_of(plan: ObjectPlan, layout: Layout) -> BuiltParts:
    """Return the parts of an object, panels or the whole body, and what they lack."""
    parts, warnings = _built(plan, layout)
    width, depth = plan.printer.bed_mm
    sizes = [(high - low)[:2].tolist() for low, high in map(box, parts)]
    large = [
        part.name
        for part, size in zip(parts, sizes, strict=True)
        if not all(plate.fits for plate in arrange_plates([size], (width, depth)))
    ]
    if large:
        bed = f"the bed of {plan.printer.name}, {width:g} x {depth:g} mm"
        warnings += (f"larger than {bed}: {some_of(large)}; take a larger printer",)
    return parts, warnings


def _built(plan: ObjectPlan, layout: Layout) -> BuiltParts:
    spec = plan.spec
    if spec.parts == "whole":
        stance = stance_of(plan, layout)
        turned = None if stance is None or stance.as_modelled else stance.R_bed_object
        part = emboss_whole(plan.polyhedron, layout, plan.outlines, spec.name, turned)
        if plan.polyhedron.kind == "tag":
            mark = NameMark.of(in_figures(spec.name), _code(plan, layout), "F1")
            back = TAG_BACK, mark, spec.shape.parameters["thickness"] - FRAME_STEP_MM
            part = with_name(part, *back, plan.printer)
        return (part,), ()
    with error_location(plan.spec.source, "print.wall, print, shape"):
        made = panels(
            plan.polyhedron,
            layout,
            plan.outlines,
            spec.wall_mm,
            plan.printer,
            name=spec.name,
            code=_code(plan, layout),
            gap_mm=spec.gap_mm,
        )
    return made.parts, made.warnings


def _code(plan: ObjectPlan, layout: Layout) -> str:
    return object_code(layout, plan.array.rows, plan.array.columns)


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


def outer_size_mm(polyhedron: Polyhedron, parts: Sequence[Part]) -> NDArray[np.float64]:
    """Return the lengths (3,) of the box, mm.

    The facets that stand for a round face leave it by their chord error (a can of 60 mm measures
    59.96 mm between their corners); where it goes all around, its circles count in their place.
    """
    closed = {face.name: (part, face) for part in parts for face in part.analytic if face.closed}
    kept = np.ones(len(polyhedron.vertices), bool)
    points = []
    for surface in polyhedron.surfaces:
        found = closed.get(polyhedron.faces[surface.carrier].name)
        if found is None:
            continue
        part, face = found
        for facet in surface.facets:
            kept[[v for loop in polyhedron.faces[facet].loops for v in loop]] = False
        T = part.T_object_part @ face.T_part_axis
        axis = T[:3, 2]
        across = np.sqrt(np.maximum(0.0, 1.0 - axis**2))  # of a circle of radius 1, along x, y, z
        for rim in (face.low, face.high):
            centre = T[:3, 3] + rim.height_mm * axis
            points += [centre - rim.radius_mm * across, centre + rim.radius_mm * across]
    return np.asarray(np.ptp([*polyhedron.vertices[kept], *points], axis=0))
