"""Spec -> array -> layout -> solid -> files + database: the whole of making an object.

One object is one transaction: its place on the array is chosen, its files are staged, its
rows are committed, and then its files appear. Whatever interrupts the run, the database
holds the object whole or not at all, and no file stands under its final name that the
database does not know. The next run of the same spec finishes what was interrupted: it
finds the cells in the database and makes the same bytes again.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Engine

from generator.database.cells import find_array, occupied
from generator.database.open import database_exists, open_database
from generator.database.read import find_object, read_layout
from generator.database.register import Registration, register, require_same_spec
from generator.database.transaction import reading, writing
from generator.database.url import part_file
from generator.export.atomic import Staging
from generator.layout.layout import lay_out
from generator.layout.placement import Layout
from generator.pipeline.files import parts_of, stage
from generator.pipeline.plan import Plan, blaming, planned
from generator.pipeline.progress import Progress, silent, within
from generator.spec import Located

Cells = tuple[NDArray[np.int64], NDArray[np.int64]]  #: rows (n,) and columns (n,)

NO_CELLS: Cells = (np.empty(0, np.int64), np.empty(0, np.int64))


@dataclass(frozen=True, slots=True)
class Made:
    """One object that was made, or would be."""

    name: str
    faces: int
    symbols: int
    places: int  #: how many places of it can be told apart by touch
    parts: int
    files: tuple[Path, ...]
    warnings: tuple[str, ...]
    reused: bool  #: registered before, so the same cells again


@dataclass(frozen=True, slots=True)
class Encoded:
    """What one run made."""

    objects: tuple[Made, ...]
    database: str
    rows: int  #: of the array
    columns: int
    used_cells: int  #: of the array, by all objects in the database
    seconds: float


@dataclass(frozen=True, slots=True)
class _Placed:
    """Where an object's symbols are, and what is around them."""

    layout: Layout
    others: Cells  #: cells that other objects hold
    reused: bool


def encode(
    specs: Sequence[Located],
    *,
    folder: Path | None = None,
    formats: Sequence[str] | None = None,
    database: str | None = None,
    dry_run: bool = False,
    verify: bool = False,
    replace: bool = False,
    progress: Progress = silent,
) -> Encoded:
    """Make objects: files that print, and an entry in the database for each.

    Parameters
    ----------
    specs
        From `generator.spec.read_specs`; one or more, all on one array.
    folder
        For the files, in place of the specs' own; several objects get a folder each in it.
    formats
        In place of the specs' own: step, stl, 3mf, glb.
    database
        URL in place of the specs' own.
    dry_run
        Plan, lay out and build, but write nothing: no file, no row, no new database.
    verify
        Read STEP and STL back through the CAD kernel and the mesh library before anything
        is kept; needs the extras `cad` and `mesh`.
    replace
        Allow a changed spec under a registered name; its old cells become free.
    progress
        Called with what is being done and the share of the run that is done.

    Raises
    ------
    GeneratorError
        See `generator.errors`. Objects before the one at fault stay made.
    """
    began = time.perf_counter()
    url = database or specs[0].spec.database
    plans: list[Plan] = []
    for number, located in enumerate(specs):
        progress(f"planning {located.spec.name}", 0.1 * number / len(specs))
        plans.append(planned(located))
    steps = [
        within(progress, 0.1 + 0.9 * number / len(plans), 0.1 + 0.9 * (number + 1) / len(plans))
        for number in range(len(plans))
    ]
    if dry_run:
        made, used = _rehearsed(plans, url, replace, steps)
    else:
        if not database_exists(url):  # an object that cannot be made leaves no database behind
            _rehearse(None, plans[:1], replace, [silent])
        engine = open_database(url)
        made = []
        for plan, step in zip(plans, steps, strict=True):
            place = _folder(plan, folder, len(plans))
            wanted = tuple(formats) if formats is not None else plan.spec.formats
            made.append(_make(engine, plan, place, wanted, verify, replace, step))
        with reading(engine) as connection:
            used = len(occupied(connection, find_array(connection, plans[0].array))[0])
    array = plans[0].array
    seconds = time.perf_counter() - began
    return Encoded(tuple(made), url, array.rows, array.columns, used, seconds)


def _make(
    engine: Engine,
    plan: Plan,
    folder: Path,
    formats: Sequence[str],
    verify: bool,
    replace: bool,
    progress: Progress,
) -> Made:
    """Make one object: place, stage, commit, and let the files appear."""
    with Staging(folder) as staging:
        with writing(engine) as connection:
            progress(f"placing {plan.spec.name}", 0.0)
            placed = _place(connection, plan, replace)
            files = stage(
                plan,
                placed.layout,
                formats,
                staging,
                verify=verify,
                progress=within(progress, 0.1, 0.9),
            )
            progress(f"registering {plan.spec.name}", 0.9)
            registration = Registration(
                name=plan.spec.name,
                polyhedron=plan.polyhedron,
                layout=placed.layout,
                array=plan.array,
                profile=plan.spec.profile,
                alphabet=plan.alphabet,
                style=plan.spec.style,
                spec=plan.spec.meaning,
                tool_version=version("encoded-objects"),
                parts=tuple(
                    dataclasses.replace(part, file=part_file(engine.url, part.file))
                    for part in files.registered
                ),
            )
            register(connection, registration, replace=replace and not placed.reused)
        written = staging.commit()
    return _made(plan, placed, files.parts, files.warnings, tuple(w.path for w in written))


def _rehearsed(
    plans: Sequence[Plan], url: str, replace: bool, steps: Sequence[Progress]
) -> tuple[list[Made], int]:
    """Return what `encode` would make: each object beside the ones before it."""
    if not database_exists(url):
        return _rehearse(None, plans, replace, steps)
    with reading(open_database(url, writable=False)) as connection:
        return _rehearse(connection, plans, replace, steps)


def _rehearse(
    connection: Connection | None, plans: Sequence[Plan], replace: bool, steps: Sequence[Progress]
) -> tuple[list[Made], int]:
    made: list[Made] = []
    new: list[Layout] = []
    used = 0
    for plan, progress in zip(plans, steps, strict=True):
        progress(f"placing {plan.spec.name}", 0.0)
        placed = _place(connection, plan, replace, new)
        progress(f"building {plan.spec.name}", 0.5)
        parts, warnings = parts_of(plan, placed.layout)
        made.append(_made(plan, placed, len(parts), warnings, ()))
        if not placed.reused:
            new.append(placed.layout)
        used = len(placed.others[0]) + made[-1].symbols
    return made, used


def _place(
    connection: Connection | None, plan: Plan, replace: bool, beside: Sequence[Layout] = ()
) -> _Placed:
    """Find the object's cells in the database, or choose free ones.

    Parameters
    ----------
    connection
        None where there is no database yet.
    beside
        Layouts that are not in the database but take cells all the same.
    """
    spec = plan.spec
    others = NO_CELLS
    if connection is not None:
        known = find_object(connection, spec.name)
        number = known.object_id if known else None
        others = occupied(connection, find_array(connection, plan.array), without=number)
        if known and not (replace and not known.same_spec(spec.meaning)):
            require_same_spec(connection, known, spec.meaning)
            return _Placed(read_layout(connection, spec.name), others, reused=True)
    faces = [face for layout in beside for face in layout.faces]
    others = (
        np.concatenate([others[0], *(face.rows for face in faces)]),
        np.concatenate([others[1], *(face.columns for face in faces)]),
    )
    with blaming(plan.located, "shape"):
        return _Placed(laid_out(plan, others), others, reused=False)


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
            allow_blank_faces=allow_blank_faces,
        )

    layout = attempt(allow_blank_faces=True)
    if len(layout.blank_faces) == len(plan.polyhedron.faces):
        return attempt(allow_blank_faces=False)  # says what to change
    return layout


def _made(
    plan: Plan, placed: _Placed, parts: int, warnings: tuple[str, ...], files: tuple[Path, ...]
) -> Made:
    faces = placed.layout.faces
    return Made(
        name=plan.spec.name,
        faces=len(plan.polyhedron.faces),
        symbols=sum(len(face.labels) for face in faces),
        places=sum(face.places for face in faces),
        parts=parts,
        files=files,
        warnings=(*plan.polyhedron.notes, *placed.layout.warnings, *warnings),
        reused=placed.reused,
    )


def _folder(plan: Plan, folder: Path | None, objects: int) -> Path:
    if folder is None:
        return plan.spec.folder
    return folder / plan.spec.name if objects > 1 else folder
