"""The results of a run, and how a whole body lies on the bed, with its overhangs."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from generator.array.contract import touches_needed
from generator.errors import SolidError
from generator.layout.placement import Layout
from generator.layout.recognition_rate import PartRate
from generator.pipeline.faces import FaceReport, whole_rate
from generator.pipeline.plan import ObjectPlan
from generator.plane.polygon import face_vector
from generator.polyhedron.standing import DOWN, FLAT, LEVEL, Stance, bridges
from generator.solid.plate import plain_panels

if TYPE_CHECKING:
    from generator.export.check import FitReport


@dataclass(frozen=True, slots=True)
class MadeObject:
    """One object that was made, or would be."""

    name: str
    faces: int
    symbols: int
    places: int  #: how many places of it can be distinguished by touch
    parts: int
    warnings: tuple[str, ...]
    layout: Layout = field(repr=False, compare=False)  #: its symbols
    files: tuple[Path, ...] = ()
    reused: bool = False  #: registered before, so the same cells again
    skipped: bool = False  #: registered before, and all its files stand unchanged
    touches: int = 1  #: about so many that overlap name a place; 1: no scan is needed
    face_reports: tuple[FaceReport, ...] = ()  #: of what was made or would be, face by face
    promise: PartRate | None = None  #: of the whole part; None: none was measured
    fit: FitReport | None = None  #: how its panels fit, where they were verified
    lying: str | None = None  #: of a whole body: what is on the bed, what hangs over

    @property
    def folder(self) -> Path | None:
        """Where the files stand; None where none were written."""
        return self.files[0].parent if self.files else None

    def __str__(self) -> str:
        where = f", {len(self.files)} files in {self.folder}" if self.files else ""
        return f"{self.name}: {self.faces} faces, {self.symbols:,} symbols{where}"


@dataclass(frozen=True, slots=True)
class Encoded:
    """What one run made."""

    objects: tuple[MadeObject, ...]
    database: str
    rows: int  #: of the array
    columns: int
    used_cells: int  #: of the array, by all objects in the database
    seconds: float
    set_files: tuple[Path, ...] = ()  #: of a set: its plates, overview and packing list
    to_print: tuple[Path, ...] = ()  #: of these, what is opened to print all plates

    @property
    def name(self) -> str:
        """Names of the objects, commas between."""
        return ", ".join(one.name for one in self.objects)

    @property
    def faces(self) -> int:
        """How many faces all objects have."""
        return sum(one.faces for one in self.objects)

    @property
    def symbols(self) -> int:
        """How many symbols all objects bear."""
        return sum(one.symbols for one in self.objects)

    @property
    def files(self) -> tuple[Path, ...]:
        """All that was written, object by object, and of the set."""
        return (*(file for one in self.objects for file in one.files), *self.set_files)

    @property
    def folder(self) -> Path | None:
        """Where the files stand: of a set the folder that holds its objects' own."""
        if len(self.objects) == 1:
            return self.objects[0].folder
        return self.set_files[0].parent if self.set_files else None

    def __str__(self) -> str:
        return "\n".join(map(str, self.objects))


def describe_object(
    plan: ObjectPlan,
    layout: Layout,
    parts: int,
    warnings: tuple[str, ...],
    faces: tuple[FaceReport, ...] = (),
    *,
    fit: FitReport | None = None,
) -> MadeObject:
    """Return an object as it is made, without its files; a round face counts as one."""
    return MadeObject(
        name=plan.spec.name,
        faces=len({face.name.partition(".")[0] for face in plan.polyhedron.faces}),
        symbols=sum(len(face.labels) for face in layout.faces),
        places=sum(face.places for face in layout.faces),
        parts=parts,
        warnings=(*plan.polyhedron.notes, *plan.notes, *layout.warnings, *warnings),
        fit=fit,
        lying=overhangs(plan, layout).text if plan.spec.parts == "whole" else None,
        touches=touches_needed(
            plan.array.order,
            plan.array.rows * plan.array.columns,
            plan.spec.style.pitch_mm,
            sensor_mm=plan.spec.sensor.across_mm,
        ),
        face_reports=faces,
        promise=whole_rate(plan, layout, faces),
        layout=layout,
    )


def stance_of(plan: ObjectPlan, layout: Layout) -> Stance | None:
    """Return how a whole body stands on the bed; None: with z of the object frame up.

    An object that was registered with symbols on the face chosen now lies as it did then.
    """
    stance = plan.stance
    bears = any(len(face.labels) for face in layout.faces if stance and face.face in stance.on_bed)
    return None if bears and not plan.spec.down else stance


@dataclass(frozen=True, slots=True)
class Overhangs:
    """How parts lie, and what hangs over: sheets, advice and slicer projects take it from here."""

    text: str
    faces: tuple[str, ...] = ()  #: that hang over: a slicer must make supports under them


def overhangs(plan: ObjectPlan, layout: Layout) -> Overhangs:
    """Return how the parts lie, and what hangs over of a whole body."""
    if plan.spec.parts == "panels":
        return Overhangs("every panel on its back, symbols up; no supports")
    polyhedron, limit = plan.polyhedron, math.sin(plan.printer.overhang_max_rad)
    counts = {face.face: len(face.labels) for face in layout.faces}
    stance = stance_of(plan, layout)
    vertices = polyhedron.vertices
    if stance is not None and not stance.as_modelled:
        vertices = vertices @ stance.R_bed_object.T
    lowest = float(vertices[:, 2].min())
    size = float(np.ptp(vertices, axis=0).max())
    down = -stance.R_bed_object[2] if stance is not None else DOWN
    carried = bridges(polyhedron, down)
    bottom, faces, symbols, upright = "", [], 0, 0
    for number, face in enumerate(polyhedron.faces):
        loops = [vertices[list(loop)] for loop in face.loops]
        normal = face_vector(loops)
        up = float(normal[2] / np.linalg.norm(normal))
        name, count = face.name.partition(".")[0], counts.get(number, 0)
        on_bed = up < -FLAT and abs(loops[0][:, 2].min() - lowest) < LEVEL * size
        if on_bed:
            bottom = bottom or name
        if up < -limit - 1e-9 and (count or not (on_bed or number in carried)):
            faces.append(name)
            symbols += count
        elif abs(up) <= limit:
            upright += count
    lies = f"{bottom} down" if bottom else "as the file has it"
    over = tuple(dict.fromkeys(faces))
    if not plan.printer.nozzle_mm:  # resin
        return Overhangs(f"{lies}, supports where no symbols are", over)
    needed = "no supports needed"
    if over:
        counted = f"{symbols} symbols hang over" if symbols else "they hang over"
        needed = f"supports needed under {', '.join(over)} ({counted})"
    if upright:  # their lower sides hang over by their height
        needed += f", {upright} symbols stand out sideways"
    flat = not (polyhedron.surfaces or polyhedron.blank) and (over or upright)
    spec, better = plan.spec, ""
    if flat:
        with suppress(SolidError):  # panels would be too small for their wall
            plain_panels(polyhedron, spec.wall_mm, plan.printer, spec.gap_mm, spec.name)
            better = "; with  parts: panels  nothing hangs over"
    return Overhangs(f"{lies}, {needed}{better}", over)
