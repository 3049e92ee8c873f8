"""An object's place on the array: its cells in the database, or free ones.

Plan + cells of others -> Placed. Thesis 6.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection

from generator.database.cells import find_array, occupied
from generator.database.read import find_object, read_layout
from generator.database.register import require_same_spec
from generator.layout.layout import lay_out
from generator.layout.placement import Layout
from generator.pipeline.blame import blaming
from generator.pipeline.plan import Plan

Cells = tuple[NDArray[np.int64], NDArray[np.int64]]  #: rows (n,) and columns (n,)

NO_CELLS: Cells = (np.empty(0, np.int64), np.empty(0, np.int64))


@dataclass(frozen=True, slots=True)
class Placed:
    """Where an object's symbols are, and what is around them."""

    layout: Layout
    taken: int  #: cells that other objects hold
    reused: bool  #: registered before, on these cells
    replaces: bool  #: registered before from another spec, which goes


def placed(
    connection: Connection | None, plan: Plan, replace: bool, beside: Sequence[Layout] = ()
) -> Placed:
    """Find the object's cells in the database, or choose free ones.

    Parameters
    ----------
    connection
        None where there is no database yet.
    plan
        The object.
    replace
        Whether a changed spec may take the place of the registered one.
    beside
        Layouts that are not in the database but take cells all the same.

    Raises
    ------
    GeneratorError
        The array is full, no place of the object can be told, or another spec is registered
        under its name.
    """
    spec = plan.spec
    others, replaces = NO_CELLS, False
    if connection is not None:
        known = find_object(connection, spec.name)
        number = known.object_id if known else None
        others = occupied(connection, find_array(connection, plan.array), without=number)
        if known and not (replace and not known.same_spec(plan.meaning)):
            require_same_spec(connection, known, plan.meaning)
            layout = read_layout(connection, spec.name)
            return Placed(layout, len(others[0]), reused=True, replaces=False)
        replaces = known is not None
    others = joined(others, beside)
    with blaming(plan.located, "shape"):
        return Placed(laid_out(plan, others), len(others[0]), reused=False, replaces=replaces)


def joined(cells: Cells, layouts: Sequence[Layout]) -> Cells:
    """Return cells together with those of some layouts."""
    faces = [face for layout in layouts for face in layout.faces]
    return (
        np.concatenate([cells[0], *(face.rows for face in faces)]),
        np.concatenate([cells[1], *(face.columns for face in faces)]),
    )


def laid_out(plan: Plan, others: Cells) -> Layout:
    """Lay the object out; faces too small to be told stay blank, unless all are."""

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
        )

    layout = attempt(allow_blank_faces=True)
    if len(layout.blank_faces) == len(plan.polyhedron.faces):
        return attempt(allow_blank_faces=False)  # says what to change
    return layout
