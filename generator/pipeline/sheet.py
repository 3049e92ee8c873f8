"""The build sheet of an object: its parts, plates, gluing and check -> `NAME-build.html`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from generator.export.bed import Plate
from generator.export.drawing import draw_back, draw_front, draw_plate, draw_step, is_panel
from generator.export.sheet import Figure, Section, sheet_html
from generator.layout.placement import FaceLayout, Layout, object_code
from generator.layout.recognition_rate import PartRate
from generator.pipeline.made import overhangs
from generator.pipeline.plan import ObjectPlan
from generator.polyhedron import face_polygon
from generator.polyhedron.assembly import AssemblyStep, assembly_order, distinct_faces
from generator.polyhedron.frame import face_frame
from generator.printers import Printer
from generator.solid import Part, box, volume

if TYPE_CHECKING:
    from generator.printed.slicer import PlateCost

Floats = NDArray[np.float64]

PLA_G_CM3 = 1.24
PICTURES_MAX = 60  # steps of gluing that are drawn
_PARTS = (
    "Left: from the front, edges with their numbers. Right: the back, as engraved. A panel lies "
    "on its back, symbols up."
)
_GLUE = (
    "Edges with the same number meet. Put the panels together dry first: all marks must name the "
    "same object."
)
_MIXED = (
    " Another object: a panel of another copy is glued in. Another face: panels are exchanged. "
    "A turn of a quarter or more: the panel sits turned."
)
Rows = Sequence[tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class SheetPlate:
    """One plate on the build sheet."""

    file: str
    plate: Plate
    cost: PlateCost | None = None


def build_sheet(
    plan: ObjectPlan,
    layout: Layout,
    parts: Sequence[Part],
    plates: Sequence[SheetPlate],
    promise: PartRate | None,
) -> str:
    """Return the page of one object, with what it promises."""
    panelled = is_panel(parts[0])
    code = object_code(layout, plan.array.rows, plan.array.columns)
    rows = _facts(plan, layout, code, parts, plates)
    if promise is not None:
        rows = (*rows, ("promise", promise.text))
    sections = [Section(rows=rows)]
    if plates:
        figures = [
            Figure(
                draw_plate(parts, plate.plate, plan.printer.bed_mm),
                f"{len(plate.plate.places)} part{'s' * (len(plate.plate.places) != 1)}"
                + (f"; {plate.cost}" if plate.cost else ""),
                plate.file,
            )
            for plate in plates
        ]
        sections.append(Section("Print", figures=figures, wide=True))
    if panelled:
        cards = [_card(plan, part, face) for face, part in enumerate(parts)]
        sections += [
            Section("Parts", _PARTS, figures=cards),
            Section("Glue", _GLUE, figures=_steps(plan)),
        ]
    if checks := _checks(plan, layout):
        title = f"Check by {'three touches' if len(checks) == 3 else 'touch'}"
        text = "recognize-object or open-bench, 20 N or more." + (_MIXED if panelled else "")
        sections.append(Section(title, text, ("", "touch", "must answer"), checks))
    return sheet_html(f"{plan.spec.name}: build sheet", sections)


def layers_text(printer: Printer) -> str:
    """Return how thick a printer's layers are."""
    return f"{printer.layer_mm:g} mm, the first {printer.first_layer_mm:g} mm"


def material_text(volume_mm3: float, *, resin: bool) -> str:
    """Return how much material parts of this volume take."""
    cm3 = volume_mm3 / 1000
    if resin:
        return f"resin, {cm3:.0f} ml in all"
    return f"PLA, {cm3:.0f} cm3 in all; {cm3 * PLA_G_CM3:.0f} g if solid"


def cost_text(costs: Sequence[PlateCost | None]) -> str:
    """Return what printing of plates takes; empty where that is not known of all."""
    known = [cost for cost in costs if cost is not None]
    if len(known) < len(costs):
        return ""
    minutes, grams = sum(cost.minutes for cost in known), sum(cost.filament_g for cost in known)
    return f"{minutes // 60} h {minutes % 60} min, {grams:.0f} g"


def _facts(
    plan: ObjectPlan, layout: Layout, code: str, parts: Sequence[Part], plates: Sequence[SheetPlate]
) -> Rows:
    spec, printer = plan.spec, plan.printer
    rows = [
        ("short code", code),
        ("printer", f"{printer.name}: {printer.description}"),
        ("layers", layers_text(printer)),
        ("lies", overhangs(plan, layout).text),
        ("scale", "100 %"),
    ]
    if spec.colours > 1 and is_panel(parts[0]):
        rows.append(("colours", f"2: change the filament at {spec.wall_mm:g} mm"))
    solid_mm3 = sum(volume(part) for part in parts)
    rows.append(("material", material_text(solid_mm3, resin=not printer.nozzle_mm)))
    if printing := cost_text([plate.cost for plate in plates]):
        rows.append(("printing", f"{printing} of PLA"))
    return tuple(rows)


def _card(plan: ObjectPlan, part: Part, face: int) -> Figure:
    polyhedron = plan.polyhedron
    inverse = np.linalg.inv(part.T_object_part)
    edges = []
    for number, edge in enumerate(polyhedron.edges):
        if face in (edge.left, edge.right):
            ends = polyhedron.vertices[[edge.start, edge.end]]
            edges.append((str(number + 1), (ends @ inverse[:3, :3].T + inverse[:3, 3])[:, :2]))
    lines = [one.names[0].rpartition(" figure")[0] for one in part.embossings if one.face is None]
    mark = " / ".join(line for line in lines if not line.isdecimal())
    x, y, z = np.ptp(np.array(box(part)), axis=0).tolist()
    size = f"{x:.1f} x {y:.1f} x {z:.1f} mm, {part.symbols} symbols"
    drawings = draw_front(part, edges) + draw_back(part)
    return Figure(drawings, size, part.name, mark or "no mark", small=True)


def _steps(plan: ObjectPlan) -> list[Figure]:
    polyhedron = plan.polyhedron
    order = assembly_order(polyhedron)
    names = [face.name for face in polyhedron.faces]
    polygons = [
        [polyhedron.vertices[list(loop)] for loop in face.loops] for face in polyhedron.faces
    ]
    kinds = [0] * len(names)
    down = face_frame(polyhedron, order[0].face)[:3, 2]
    found = []
    for number, step in enumerate(order, 1):
        kinds[step.face] = 2
        normal = face_frame(polyhedron, step.face)[:3, 2]
        drawing = ""
        if len(order) <= PICTURES_MAX:
            drawing = draw_step(polygons, kinds, names, _eye(down, normal))
        found.append(Figure(drawing, f"{number}. {_step_text(plan, step, names)}"))
        kinds[step.face] = 1
    return found


def _step_text(plan: ObjectPlan, step: AssemblyStep, names: Sequence[str]) -> str:
    name = names[step.face]
    if not step.edges:
        return f"Lay {name} on the table, symbols down."
    others: dict[int, list[str]] = {}
    for number in step.edges:
        edge = plan.polyhedron.edges[number]
        other = edge.left if edge.right == step.face else edge.right
        others.setdefault(other, []).append(str(number + 1))
    where = ", ".join(f"{names[face]} along {' and '.join(n)}" for face, n in others.items())
    return f"Glue {name} to {where}."


def _eye(down: Floats, normal: Floats) -> Floats:
    """Return the view (3, 3) on an object that lies with `down` down: a new face from in front."""
    up = -down
    side = normal - (normal @ up) * up
    if np.linalg.norm(side) < 1e-6:
        side = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    side = side / np.linalg.norm(side)
    across = np.cross(up, side)
    eye = 0.75 * side + 0.45 * across + 0.6 * up
    eye = eye / np.linalg.norm(eye)
    right = np.cross(up, eye)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye])


def _checks(plan: ObjectPlan, layout: Layout) -> Rows:
    round_faces = {surface.carrier for surface in plan.polyhedron.surfaces}
    by_face = {
        face.face: face
        for face in layout.faces
        if len(face.labels) and face.face not in round_faces | plan.blank_faces
    }
    numbers = {
        (edge.start, edge.end): number + 1 for number, edge in enumerate(plan.polyhedron.edges)
    }
    found: list[tuple[str, ...]] = []
    for face in distinct_faces(plan.polyhedron, sorted(by_face)):
        name = plan.polyhedron.faces[face].name
        loop = plan.polyhedron.faces[face].loops[0]
        first = numbers.get((loop[0], loop[1])) or numbers[loop[1], loop[0]]
        where = f"{name} in the middle"
        answer = f"{plan.spec.name}, {name}, near cell {_middle_cell(plan, by_face[face])}"
        if plan.spec.parts == "panels":
            where += f", the sensor's lower side along edge {first}"
            answer += ", turned by 0 degrees"
        found.append((f"{len(found) + 1}.", where, answer))
    return found


def _middle_cell(plan: ObjectPlan, face: FaceLayout) -> str:
    outline = face_polygon(plan.polyhedron, face.face)[0]
    middle = (outline.min(axis=0) + outline.max(axis=0)) / 2
    nearest = int(np.argmin(np.round(((face.centres_mm - middle) ** 2).sum(axis=1), 6)))
    return f"[{face.rows[nearest]}, {face.columns[nearest]}]"
