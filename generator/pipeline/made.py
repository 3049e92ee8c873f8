"""What a run made, as values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from generator.array.contract import touches_needed
from generator.layout.placement import Layout
from generator.pipeline.faces import FaceReport
from generator.pipeline.overhang import overhang_of
from generator.pipeline.plan import ObjectPlan

if TYPE_CHECKING:
    from generator.export.check import FitReport


@dataclass(frozen=True, slots=True)
class MadeObject:
    """One object that was made, or would be."""

    name: str
    faces: int
    symbols: int
    places: int  #: how many places of it can be told apart by touch
    parts: int
    files: tuple[Path, ...]
    warnings: tuple[str, ...]
    reused: bool  #: registered before, so the same cells again
    skipped: bool = False  #: registered before, and all its files stand unchanged
    touches: int = 1  #: about so many that overlap name a place; 1: no scan is needed
    face_reports: tuple[FaceReport, ...] = ()  #: of what was made or would be, face by face
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
    files: tuple[Path, ...],
    faces: tuple[FaceReport, ...] = (),
    *,
    reused: bool,
    skipped: bool = False,
    fit: FitReport | None = None,
) -> MadeObject:
    """Return what is told of an object; a round face counts as one."""
    return MadeObject(
        name=plan.spec.name,
        faces=len({face.name.partition(".")[0] for face in plan.polyhedron.faces}),
        symbols=sum(len(face.labels) for face in layout.faces),
        places=sum(face.places for face in layout.faces),
        parts=parts,
        files=files,
        warnings=(*plan.polyhedron.notes, *plan.notes, *layout.warnings, *warnings),
        reused=reused,
        skipped=skipped,
        fit=fit,
        lying=str(overhang_of(plan, layout)) if plan.spec.parts == "whole" else None,
        touches=touches_needed(
            plan.array.order,
            plan.array.rows * plan.array.columns,
            plan.spec.style.pitch_mm,
            sensor_mm=plan.spec.sensor.across_mm,
        ),
        face_reports=faces,
    )
