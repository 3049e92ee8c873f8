"""The build sheet of an object -> `NAME-build.html`: picture, purchases, plates, gluing, check.

It stands alone: one page of paper for a part in one piece, two for the panels of a cube.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from encoded_objects.base.output import three_digits
from encoded_objects.base.sensor_type import force_share
from generator.export.bed import Plate
from generator.export.drawing import (
    Assembly,
    draw_back,
    draw_front,
    draw_plate,
    draw_steps,
    is_panel,
    outline_of,
)
from generator.export.sheet import Figure, Section, picture_html, sheet_html
from generator.layout.placement import Layout, object_code
from generator.layout.recognition_rate import PartRate, percent
from generator.pipeline.made import overhangs
from generator.pipeline.plan import ObjectPlan
from generator.plane.polygon import face_vector, points_inside
from generator.polyhedron import face_polygon
from generator.polyhedron.assembly import AssemblyStep, assembly_order, distinct_faces
from generator.polyhedron.mount import fasteners
from generator.printers import Printer
from generator.solid import Part, box, volume

if TYPE_CHECKING:
    from generator.printed.slicer import PlateCost

PLA_G_CM3 = 1.24
LIGHT_N = 20.0  #: on `fsr-16`: touches as light are answered nearly as often as harder ones
USUAL_PRINT = np.array([[0.694, 0.407], [0.0805, 0.221]])
"""Minutes and grams that a cm2 of surface (without symbols) and a cm3 take in layers of 0.2 mm by a
nozzle of 0.4 mm, without supports: within 10 % of what PrusaSlicer 2.5 says of
`NAME-prusaslicer.3mf` of eight objects (panels of six shapes, a cylinder, a cone)."""
PICTURES_MAX = 60  # steps of gluing that are drawn
_PARTS = (
    "Left: from the front, with the numbers of its edges. Right: the back, as it is engraved. "
    "Panels are printed on their backs, symbols up."
)
_GLUE = (
    "All seen from one side. Orange: the panel to glue now; light: a back. Edges with the same "
    "number meet. Put the panels together dry first: all backs must name the same object."
)
_MIXED = (
    " Another object: a panel of another copy is glued in. Another face: panels are exchanged. "
    "A turn of a quarter or more: the panel sits turned."
)
_CHECK = (
    "Hold the sensor flat on the part, {force:.2g} N or more. recognize-object --port URL --follow "
    "--database lab.db answers, or open-bench; lab.db stands for the database that the part was "
    "made with, and probe-sensor list gives the URL of the probe."
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
    picture: bytes,
    promise: PartRate | None,
) -> str:
    """Return the page of one object; `picture`: PNG, of its faces and what they promise."""
    panelled = is_panel(parts[0])
    code = object_code(layout, plan.array.rows, plan.array.columns)
    facts = _facts(plan, layout, code, parts, plates)
    sections = [Section(drawing=picture_html(picture)), Section(rows=facts)]
    if plates:
        outlines = [(part.name, outline_of(part)) for part in parts]
        figures = [
            Figure(
                draw_plate(outlines, plate.plate, plan.printer.bed_mm),
                f"{len(plate.plate.places)} part{'s' * (len(plate.plate.places) != 1)}"
                + (f"; {plate.cost}" if plate.cost else ""),
                plate.file,
            )
            for plate in plates
        ]
        sections.append(Section("Print", figures=figures, across=min(len(figures), 2)))
    if panelled:
        cards = [_card(plan, part, face) for face, part in enumerate(parts)]
        sections += [
            Section("Parts", _PARTS, figures=cards, across=3, new_page=True),
            Section("Glue", _GLUE, figures=_steps(plan), across=4),
        ]
    if checks := _checks(plan, layout):
        title = f"Check by {'three touches' if len(checks) == 3 else 'touch'}"
        text = _CHECK.format(force=LIGHT_N * force_share(plan.spec.sensor)) + _MIXED * panelled
        if promise is not None:
            where = "on its encoded side" if promise.one_side else "anywhere"
            share = percent(promise.at_once / promise.touched)
            text += f" {share} of touches {where} are answered at once."
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
    return f"{_hours(minutes)}, {grams:.0f} g"


def _hours(minutes: float) -> str:
    return "{} h {} min".format(*divmod(round(minutes), 60))


def _facts(
    plan: ObjectPlan,
    layout: Layout,
    code: str,
    parts: Sequence[Part],
    plates: Sequence[SheetPlate],
) -> Rows:
    spec, printer, lying = plan.spec, plan.printer, overhangs(plan, layout)
    rows = [
        ("printer", f"{printer.name}: {printer.description}"),
        ("layers", layers_text(printer)),
        ("on the bed", lying.text),
        ("scale", "100 %: never scale a part"),
    ]
    if spec.colours > 1 and is_panel(parts[0]):
        rows.append(("colours", f"2: change the filament at {spec.wall_mm:g} mm"))
    volume_mm3 = sum(map(volume, parts))
    cost, source = cost_text([plate.cost for plate in plates]) if plates else "", "PrusaSlicer"
    usual = (printer.nozzle_mm, printer.layer_mm) == (0.4, 0.2)
    if not cost and usual and not lying.faces:
        minutes, grams = USUAL_PRINT @ [_body_mm2(parts) / 100, volume_mm3 / 1000]
        cost, source = (
            f"about {_hours(minutes)}, {grams:.0f} g",
            "estimated by what PrusaSlicer takes",
        )
    buy = [material_text(volume_mm3, resin=not printer.nozzle_mm)]
    if is_panel(parts[0]):
        buy.append("superglue or two-component epoxy")
        marks = "backs say the object and the face"
        if any(_mark(part).startswith(code) for part in parts):
            marks = f"backs say {code}, which stands for {spec.name} on small parts, and the face"
        rows.append(("marks", marks))
    buy += fasteners(spec.mount) if spec.mount else ()
    rows.append(("to buy", "; ".join(buy)))
    if cost:
        rows.append(("printing", f"{cost} ({source}, 15 % infill)"))
    return tuple(rows)


def _body_mm2(parts: Sequence[Part]) -> float:
    facets = ([part.vertices[list(p)] for p in one.loops] for part in parts for one in part.facets)
    return float(sum(np.linalg.norm(face_vector(loops)) for loops in facets))


def _mark(part: Part) -> str:
    """Return what the back of a panel says, without the numbers of its edges."""
    lines = [one.names[0].rpartition(" figure")[0] for one in part.embossings if one.face is None]
    return " / ".join(line for line in lines if not line.isdecimal())


def _card(plan: ObjectPlan, part: Part, face: int) -> Figure:
    polyhedron = plan.polyhedron
    inverse = np.linalg.inv(part.T_object_part)
    edges = []
    for number, edge in enumerate(polyhedron.edges):
        if face in (edge.left, edge.right):
            ends = polyhedron.vertices[[edge.start, edge.end]]
            edges.append((str(number + 1), (ends @ inverse[:3, :3].T + inverse[:3, 3])[:, :2]))
    mark = _mark(part)
    sides = np.ptp(np.array(box(part)), axis=0).tolist()
    size = f"{' x '.join(map(three_digits, sides))} mm"
    drawings = draw_front(part, edges) + draw_back(part)
    return Figure(drawings, size, part.name, mark or "no mark", small=True)


def _steps(plan: ObjectPlan) -> list[Figure]:
    polyhedron = plan.polyhedron
    order = assembly_order(polyhedron)
    names = [face.name for face in polyhedron.faces]
    drawings = [""] * len(order)
    if len(order) <= PICTURES_MAX:
        polygons = [[polyhedron.vertices[list(p)] for p in f.loops] for f in polyhedron.faces]
        ends = [polyhedron.vertices[[edge.start, edge.end]] for edge in polyhedron.edges]
        edges = [[(str(n + 1), ends[n]) for n in step.edges] for step in order]
        drawings = draw_steps(Assembly(names, polygons, [step.face for step in order], edges))
    return [
        Figure(drawing, f"{number}. {_step_text(plan, step, names)}", small=True)
        for number, (drawing, step) in enumerate(zip(drawings, order, strict=True), 1)
    ]


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


def _checks(plan: ObjectPlan, layout: Layout) -> Rows:
    round_faces = {surface.carrier for surface in plan.polyhedron.surfaces}
    middles: dict[int, tuple[float, float]] = {}  # of flat faces that have one, face frame
    for one in layout.faces:
        if len(one.labels) and one.face not in round_faces | plan.blank_faces:
            loops = face_polygon(plan.polyhedron, one.face)
            middle = (loops[0].min(axis=0) + loops[0].max(axis=0)) / 2
            if points_inside(middle[None], loops).all():  # an L has its middle beside it
                middles[one.face] = (float(middle[0]), float(middle[1]))
    numbers = {
        (edge.start, edge.end): number + 1 for number, edge in enumerate(plan.polyhedron.edges)
    }
    found: list[tuple[str, ...]] = []
    for face in distinct_faces(plan.polyhedron, sorted(middles)):
        name = plan.polyhedron.faces[face].name
        loop = plan.polyhedron.faces[face].loops[0]
        first = numbers.get((loop[0], loop[1])) or numbers[loop[1], loop[0]]
        where = f"{name} in the middle"
        x, y = middles[face]
        answer = f"{plan.spec.name}/{name} at about ({x:.0f}, {y:.0f}) mm"
        if plan.spec.parts == "panels":
            where += f", the sensor's lower side along edge {first}"
            answer += ", turned about 0 degrees"
        found.append((f"{len(found) + 1}.", where, answer))
    return found
