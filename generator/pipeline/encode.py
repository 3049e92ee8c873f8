"""Make objects: one run from specs to files and database.

One object is one transaction: its place on the array is chosen, its files are staged, its rows are
committed, and then its files appear. Whatever interrupts the run, the database holds the object
whole or not at all, and no file stands under its final name that the database does not know. The
next run finds the cells in the database and makes the same bytes again.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace as replace_fields
from pathlib import Path

from sqlalchemy import Connection, Engine

from generator.database.cells import occupancy
from generator.database.lab import lab_key as stored_lab_key
from generator.database.open import open_database, open_if_there, without_unused
from generator.database.register import register
from generator.database.transaction import read_transaction, write_transaction
from generator.errors import DatabaseError, PrintError
from generator.export.atomic import remove_leftovers
from generator.pipeline.choose import ArrayChoice, choose_array, lab_of
from generator.pipeline.faces import face_reports
from generator.pipeline.files import parts_of
from generator.pipeline.made import Encoded, MadeObject, describe_object
from generator.pipeline.make import MakeJob, make_under_lock, object_record
from generator.pipeline.place import PlacedObject, place_in_turn, place_object
from generator.pipeline.plan import ObjectPlan
from generator.pipeline.progress import Progress, no_progress, part_of_progress
from generator.polyhedron import Polyhedron
from generator.spec import ObjectSpec
from generator.spec.problem import error_location


def encode(
    specs: Sequence[ObjectSpec],
    *,
    folder: Path | None = None,
    formats: Sequence[str] | None = None,
    database: str | None = None,
    lab_key: str = "",
    dry_run: bool = False,
    trial: Path | None = None,
    verify: bool = False,
    slice_plates: bool = False,
    replace: bool = False,
    jobs: int | None = None,
    progress: Progress = no_progress,
) -> Encoded:
    """Make objects: files that print, and an entry in the database for each.

    Parameters
    ----------
    specs
        From `generator.spec.read_specs`; one or more, all on one array.
    folder
        For the files, in place of the specs' own; several objects get a folder each in it.
    formats, database
        In place of the specs' own: names of `EXPORTERS`, a URL.
    lab_key
        Of a new database, in place of the specs' own; drawn where neither says one.
    dry_run
        Plan, lay out and build, but write nothing: no file, no row, no new database.
    trial
        Of a dry run: a new database file that takes the objects down, to touch them in simulation.
    verify
        Read STEP and STL back through the CAD kernel and the mesh library before anything
        is kept; needs the extras `cad` and `mesh`.
    slice_plates
        Slice the plates with the installed PrusaSlicer: time and filament on the build sheet.
    replace
        Allow a changed spec under a registered name; its old cells become free. Also files that
        no object of the database has made.
    jobs
        Processes that make the objects of a set; left out, one for each processor.

    Raises
    ------
    GeneratorError
        See `generator.errors`. Objects before the one at fault stay made.
    """
    began = time.perf_counter()
    url = database or specs[0].database
    if trial is not None and trial.exists():
        fix = "name a new file, or remove this one"
        raise DatabaseError("a trial makes a database, and there is one", fix=fix, place=str(trial))
    with without_unused(url):
        progress("planning", 0.0)
        engine, plans, dry_build = plan_in_lab(
            specs, url, lab_key=lab_key, make=not dry_run, replace_changed=replace
        )
        for plan in plans:
            wanted = plan.spec.formats if formats is None else formats
            if "bambu" in wanted and not plan.printer.nozzle_mm:
                with error_location(plan.spec.source, "print.printer"):
                    fix = "leave bambu out of formats, or choose a printer of filament"
                    name = plan.printer.name
                    cause = f"Bambu Studio and OrcaSlicer print filament, and {name} prints resin"
                    raise PrintError(cause, fix=fix)
        rest = part_of_progress(progress, 0.1, 1.0)
        files: tuple[Path, ...] = ()
        to_print: tuple[Path, ...] = ()
        if engine is None or dry_run:
            with read_transaction(engine) if engine else nullcontext() as connection:
                made, used = _dry_run(connection, plans, replace, rest)
            if trial is not None:
                with write_transaction(open_database(str(trial))) as connection:
                    for plan, one in zip(plans, made, strict=True):
                        register(connection, object_record(plan, one.layout), replace=False)
        else:
            to_make = [
                MakeJob(
                    plan, _folder(plan, folder, len(plans)),
                    plan.spec.formats if formats is None else tuple(formats),
                    verify, replace, slice_plates and len(plans) == 1,
                )
                for plan in plans
            ]  # fmt: skip
            for parent in sorted({job.folder.parent for job in to_make}):
                remove_leftovers(parent, below=True)
            if len(to_make) == 1:
                made = [make_under_lock(engine, to_make[0], rest, dry_build)]
            else:
                from generator.pipeline.sets import (
                    make_set,
                    set_folder,
                )  # loads what sets alone need

                made, files, to_print = make_set(
                    engine, url, to_make, set_folder(to_make, folder), jobs, rest,
                    slice_plates=slice_plates,
                )  # fmt: skip
            with read_transaction(engine) as connection:
                used = occupancy(connection, plans[0].array).used
        array = plans[0].array
        seconds = time.perf_counter() - began
        return Encoded(tuple(made), url, array.rows, array.columns, used, seconds, files, to_print)


def plan_in_lab(
    specs: Sequence[ObjectSpec],
    url: str,
    *,
    lab_key: str = "",
    make: bool,
    replace_changed: bool,
    solid: Polyhedron | None = None,
) -> tuple[Engine | None, tuple[ObjectPlan, ...], PlacedObject | None]:
    """Return a lab's database, the plans of objects on its array, and a dry build of one object.

    `make` makes the database if it is new and the first object can be made; a key drawn for it
    gives way to that of another program which made it meanwhile. For the others see `encode` and
    `choose_array`.
    """
    while True:
        engine = open_if_there(url, writable=make)
        with read_transaction(engine) if engine else nullcontext() as connection:
            lab = lab_of(specs, connection, lab_key)
            choice = choose_array(specs, lab, connection, solid, replace_changed=replace_changed)
        if engine is not None or not make:
            return engine, choice.noted_plans, None
        dry_build = _dry_build(choice)
        engine = open_database(url, lab_key=lab.key)
        with read_transaction(engine) as connection:
            if stored_lab_key(connection) == lab.key:
                return engine, choice.noted_plans, dry_build


def _dry_build(choice: ArrayChoice) -> PlacedObject | None:
    """Lay out and build one object of each kind, so that a refusal leaves no empty database.

    Where they fill more than half of the array, places are found for all. A single object is
    returned with its parts.
    """
    kinds: dict[str, int] = {}
    needed = 0
    plans = choice.plans
    for number, plan in enumerate(plans):
        kind = json.dumps(plan.meaning, sort_keys=True, default=str)
        if kind not in kinds:
            if choice.alone:
                layout = choice.alone[number]
            else:
                layout = place_object(None, plan, replace=False).layout
            built = parts_of(plan, layout)
            kinds[kind] = sum(len(face.labels) for face in layout.faces)
        needed += kinds[kind]
    if 2 * needed > plans[0].array.rows * plans[0].array.columns:
        for _ in place_in_turn(None, plans):
            pass
    if len(plans) > 1:
        return None
    return PlacedObject(layout, taken=0, reused=False, replaces=False, built=built)


def _dry_run(
    connection: Connection | None, plans: Sequence[ObjectPlan], replace: bool, progress: Progress
) -> tuple[list[MadeObject], int]:
    """Return what `encode` would make, each object after the ones before it, and cells used."""
    made: list[MadeObject] = []
    used = 0
    places = place_in_turn(connection, plans, replace=replace)
    for number, plan in enumerate(plans):
        step = part_of_progress(progress, number / len(plans), (number + 1) / len(plans))
        step(f"placing {plan.spec.name}", 0.0)
        placed = next(places)
        step(f"building {plan.spec.name}", 0.5)
        parts, warnings = parts_of(plan, placed.layout)
        faces = face_reports(plan, placed.layout, smallest=True)
        warnings += placed.warnings
        one = describe_object(plan, placed.layout, len(parts), warnings, faces)
        made.append(replace_fields(one, reused=placed.reused))
        used = placed.taken + made[-1].symbols
    return made, used


def _folder(plan: ObjectPlan, folder: Path | None, objects: int) -> Path:
    if folder is None:
        return plan.spec.folder
    return folder / plan.spec.name if objects > 1 else folder
