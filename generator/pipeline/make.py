"""One object: place, stage, commit, and let the files appear.

Either under the lock of the database from beginning to end (`make_under_lock`), or at a place
chosen before, so that several processes build at once and only the rows wait for their turn
(`make_at`). Where another writer took the cells meanwhile, the object is made again under the lock.
"""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from sqlalchemy import Connection, Engine

from encoded_objects.base.output import some_of
from generator.database.open import part_file, part_path
from generator.database.read import find_object, read_parts
from generator.database.register import ObjectRecord, register
from generator.database.registered import RegisteredPart
from generator.database.transaction import WriteConflictError, write_transaction
from generator.export.atomic import Staging
from generator.layout.placement import Layout
from generator.pipeline.files import parts_of, stage
from generator.pipeline.made import MadeObject
from generator.pipeline.place import PlacedObject, occupancy_of, place_object
from generator.pipeline.plan import ObjectPlan
from generator.pipeline.progress import Progress, no_progress, part_of_progress


@dataclass(frozen=True, slots=True)
class MakeJob:
    """One object to make."""

    plan: ObjectPlan
    folder: Path
    formats: tuple[str, ...]
    verify: bool = False
    replace: bool = False
    slice_plates: bool = False


def make_under_lock(
    engine: Engine,
    job: MakeJob,
    progress: Progress = no_progress,
    dry_build: PlacedObject | None = None,
) -> MadeObject:
    """Make one object; nobody else writes to the database meanwhile.

    `dry_build` is taken where the array is as empty as it was for the dry build.
    """
    plan, name = job.plan, job.plan.spec.name
    with Staging(job.folder) as staging:
        with write_transaction(engine) as connection:
            progress(f"placing {name}", 0.0)
            if (
                dry_build is not None
                and find_object(connection, name) is None
                and not occupancy_of(connection, plan).used
            ):
                placed = dry_build
            else:
                placed = place_object(connection, plan, job.replace)
            made, parts = _stage(job, placed, staging, part_of_progress(progress, 0.1, 0.9))
            progress(f"registering {name}", 0.9)
            _register(connection, job, placed, parts, staging)
        return _commit(made, placed, staging)


def make_at(
    engine: Engine, job: MakeJob, placed: PlacedObject, progress: Progress = no_progress
) -> MadeObject:
    """Make one object at a place chosen before, or under the lock if another writer took it."""
    try:
        with Staging(job.folder) as staging:
            made, parts = _stage(job, placed, staging, part_of_progress(progress, 0.0, 0.9))
            with write_transaction(engine) as connection:
                known = find_object(connection, job.plan.spec.name)
                if (known is not None) != (placed.reused or placed.replaces):
                    raise WriteConflictError("an object of this name came or went meanwhile")
                _register(connection, job, placed, parts, staging)
            return _commit(made, placed, staging)
    except WriteConflictError:
        return make_under_lock(engine, job, progress)


def _stage(
    job: MakeJob, placed: PlacedObject, staging: Staging, progress: Progress
) -> tuple[MadeObject, tuple[RegisteredPart, ...]]:
    progress("building the parts", 0.0)
    return stage(
        job.plan, placed.layout, placed.built or parts_of(job.plan, placed.layout), job.formats,
        staging, verify=job.verify, slice_plates=job.slice_plates, progress=progress,
    )  # fmt: skip


def has_files_in(connection: Connection, name: str, folder: Path) -> bool:
    """Whether an object is registered with files of parts in this folder, which are ours then."""
    known, url = find_object(connection, name), connection.engine.url
    here = Path(os.path.normpath(folder.absolute()))
    return known is not None and any(
        part_path(url, part.file).parent == here for part in read_parts(connection, known.object_id)
    )


def _register(
    connection: Connection, job: MakeJob, placed: PlacedObject,
    parts: tuple[RegisteredPart, ...], staging: Staging,
) -> None:  # fmt: skip
    plan, url = job.plan, connection.engine.url
    if not (job.replace or has_files_in(connection, plan.spec.name, job.folder)):
        staging.refuse_others()
    named = tuple(dataclasses.replace(part, file=part_file(url, part.file)) for part in parts)
    record = object_record(plan, placed.layout, named)
    register(connection, record, replace=placed.replaces)


def object_record(
    plan: ObjectPlan, layout: Layout, parts: tuple[RegisteredPart, ...] = ()
) -> ObjectRecord:
    """Return what a database takes down of an object."""
    return ObjectRecord(
        name=plan.spec.name,
        polyhedron=plan.polyhedron,
        layout=layout,
        array=plan.array,
        profile=plan.spec.profile,
        lab_key=plan.spec.array_key,
        alphabet=plan.alphabet,
        style=plan.spec.style,
        spec=plan.meaning,
        tool_version=version("encoded-objects"),
        parts=parts,
    )


def _commit(made: MadeObject, placed: PlacedObject, staging: Staging) -> MadeObject:
    written = tuple(file.path for file in staging.commit())
    new = {os.path.normpath(path.absolute()) for path in written}
    left = [path for path in placed.old_files if str(path) not in new and path.is_file()]
    warnings = (*made.warnings, *placed.warnings)
    if left:
        names = some_of([path.name for path in left])
        warnings += (f"files of what it replaces stay in {left[0].parent}: {names}",)
    return dataclasses.replace(made, files=written, reused=placed.reused, warnings=warnings)
