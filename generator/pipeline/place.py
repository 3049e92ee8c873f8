"""An object's place on the array: its cells in the database, or free ones. Thesis 6.3."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sqlalchemy import Connection

from encoded_objects.base.output import three_digits
from generator.database.cells import cells_of, find_array, occupancy
from generator.database.open import part_path
from generator.database.read import find_object, read_layout, read_object
from generator.database.register import require_in_use, require_same_spec
from generator.database.registered import RegisteredObject
from generator.errors import LayoutError
from generator.layout.layout import lay_out
from generator.layout.occupancy import Cells, Occupancy
from generator.layout.placement import Layout
from generator.pipeline.plan import ObjectPlan
from generator.solid import Part
from generator.spec.problem import error_location

BuiltParts = tuple[tuple[Part, ...], tuple[str, ...]]  #: the parts, and what they lack

SMALL_MODEL_MM = 12.0  #: a model of another unit: no place can be told on it

NO_CELLS = (np.empty(0, np.int64), np.empty(0, np.int64))


@dataclass(frozen=True, slots=True)
class PlacedObject:
    """An object's layout among the cells that others hold."""

    layout: Layout
    taken: int  #: cells that other objects hold
    reused: bool  #: registered before, on these cells
    replaces: bool  #: registered before from another spec, which goes
    warnings: tuple[str, ...] = ()  #: what to do with printed parts of the replaced object
    old_files: tuple[Path, ...] = ()  #: of the replaced object
    built: BuiltParts | None = None  #: its parts, where a dry build made them


def place_object(
    connection: Connection | None, plan: ObjectPlan, replace: bool, taken: Occupancy | None = None
) -> PlacedObject:
    """Find the object's cells in the database, or choose free ones.

    Parameters
    ----------
    connection
        None where there is no database yet.
    replace
        Whether a changed spec may take the place of the registered one.
    taken
        Of the array, where that is known already: by the database and by other objects of the run.

    Raises
    ------
    GeneratorError
        The array is full, no place of the object can be identified, or another spec is registered
        under its name.
    """
    everything = occupancy_of(connection, plan) if taken is None else taken
    known = None if connection is None else find_object(connection, plan.spec.name)
    if connection is None or known is None:
        layout = _lay_out_at_shape(plan, everything)
        return PlacedObject(layout, everything.used, reused=False, replaces=False)
    require_in_use(connection, known)
    others = everything
    if (array_id := find_array(connection, plan.array)) is not None:
        others = others.without_cells(*cells_of(connection, known.object_id, array_id))
    if not replace or known.same_spec(plan.meaning):
        require_same_spec(connection, known, plan.meaning)
        layout = read_layout(connection, plan.spec.name)
        return PlacedObject(layout, others.used, reused=True, replaces=False)
    layout = _lay_out_at_shape(plan, others)
    warnings: tuple[str, ...] = ()
    before = read_object(connection, known.name)
    files = tuple(part_path(connection.engine.url, part.file) for part in before.parts)
    if known.array_id == array_id and _same_places(before, plan, layout):
        layout = before.layout  # its printed parts stay good
    else:
        note = (
            f"it replaces what was registered under this name ({known.utc}), whose cells are free "
            "for others: destroy its printed parts"
        )
        warnings = (note,)
        with suppress(LayoutError):  # beside it, so that its printed parts are not read as the new
            layout = lay_out_object(plan, everything)
    return PlacedObject(
        layout, others.used, reused=False, replaces=True, warnings=warnings, old_files=files
    )


def _same_places(before: RegisteredObject, plan: ObjectPlan, layout: Layout) -> bool:
    """Whether a changed spec has the same solid, with symbols at the same places."""
    old = before.layout
    return (
        np.array_equal(before.polyhedron.vertices, plan.polyhedron.vertices)
        and (old.pitch_mm, old.blank_faces) == (layout.pitch_mm, layout.blank_faces)
        and len(old.faces) == len(layout.faces)
        and all(
            np.array_equal(a.centres_mm, b.centres_mm)
            for a, b in zip(old.faces, layout.faces, strict=True)
        )
    )


def _lay_out_at_shape(plan: ObjectPlan, others: Occupancy) -> Layout:
    """Lay out as `lay_out_object`; errors name the line of the shape."""
    with error_location(plan.spec.source, "shape"):
        return lay_out_object(plan, others)


def occupancy_of(connection: Connection | None, plan: ObjectPlan) -> Occupancy:
    """Return the cells of a plan's array that the objects of a database hold."""
    if connection is None:
        return Occupancy.from_cells(*NO_CELLS, plan.array)
    return occupancy(connection, plan.array)


def place_in_turn(
    connection: Connection | None, plans: Sequence[ObjectPlan], *, replace: bool = False
) -> Iterator[PlacedObject]:
    """Yield the place of each object, on cells that those before it leave free."""
    taken: Occupancy | None = None
    for plan in plans:
        taken = occupancy_of(connection, plan) if taken is None else taken
        placed = place_object(connection, plan, replace, taken)
        if not placed.reused:
            cells = zip(*((face.rows, face.columns) for face in placed.layout.faces), strict=True)
            taken = taken.with_cells(*map(np.concatenate, cells))
        yield placed


def lay_out_object(plan: ObjectPlan, others: Occupancy | Cells) -> Layout:
    """Lay the object out; faces that show no identifiable place stay blank, unless all do."""

    def attempt(allow_blank_faces: bool) -> Layout:
        return lay_out(
            plan.polyhedron,
            plan.array,
            plan.spec.style.pitch_mm,
            plan.footprint_half_mm,
            plan.clearances_mm,
            others,
            plan.spec.layout,
            blank_faces=plan.blank_faces,
            allow_blank_faces=allow_blank_faces,
            developed=plan.developed,
            prints=lambda pitch_mm: plan.style_at(pitch_mm) is not None,
        )

    layout = attempt(allow_blank_faces=True)
    if len(layout.blank_faces) < len(plan.polyhedron.faces):
        return layout
    try:
        return attempt(allow_blank_faces=False)  # says what to change
    except LayoutError as error:
        size = np.ptp(plan.polyhedron.vertices, axis=0).tolist()
        if plan.spec.shape.file is None or max(size) > SMALL_MODEL_MM:
            raise
        fix = (
            f"check the model's unit: it is {' x '.join(map(three_digits, size))} mm; in inches "
            "it needs scale: 25.4, in metres 1000"
        )
        raise LayoutError(error.cause, fix=fix, place=error.place) from None
