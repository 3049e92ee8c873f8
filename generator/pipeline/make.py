"""One object: place, stage, commit, and let the files appear.

Either under the lock of the database from beginning to end (`make_under_lock`), or with a
place chosen before, so that several processes build at once and only the rows wait for
their turn (`make_at`). Whoever chose cells that another writer took meanwhile makes his
object again under the lock.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from sqlalchemy import Connection, Engine

from generator.database.open import part_file
from generator.database.read import find_object
from generator.database.register import ObjectRecord, register
from generator.database.transaction import WriteConflictError, write_transaction
from generator.export.atomic import Staging
from generator.pipeline.files import BuiltParts, StagedObject, parts_of, stage
from generator.pipeline.made import MadeObject, describe_object
from generator.pipeline.place import ObjectPlacement, occupancy_of, place_object
from generator.pipeline.plan import ObjectPlan
from generator.pipeline.progress import Progress, no_progress, part_of_progress


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """An object built before there was a database: alone on its array."""

    place: ObjectPlacement
    built: BuiltParts


@dataclass(frozen=True, slots=True)
class Order:
    """One object to make: its plan and what is wanted of it."""

    plan: ObjectPlan
    folder: Path
    formats: tuple[str, ...]
    verify: bool = False
    replace: bool = False
    slice_plates: bool = False
    rehearsal: Rehearsal | None = None


@dataclass(frozen=True, slots=True)
class Product:
    """What became of an order."""

    made: MadeObject
    placed: ObjectPlacement


def make_under_lock(engine: Engine, order: Order, progress: Progress = no_progress) -> Product:
    """Make one object; nobody else writes to the database meanwhile."""
    name = order.plan.spec.name
    with Staging(order.folder) as staging:
        with write_transaction(engine) as connection:
            progress(f"placing {name}", 0.0)
            place = _place(connection, order)
            files = _stage(order, place, staging, part_of_progress(progress, 0.1, 0.9))
            progress(f"registering {name}", 0.9)
            _register(connection, order, place, files)
        return _finish(order, place, files, staging)


def make_at(
    engine: Engine, order: Order, place: ObjectPlacement, progress: Progress = no_progress
) -> Product:
    """Make one object at a place chosen before, or anew where that was lost to another writer."""
    try:
        with Staging(order.folder) as staging:
            files = _stage(order, place, staging, part_of_progress(progress, 0.0, 0.9))
            with write_transaction(engine) as connection:
                known = find_object(connection, order.plan.spec.name)
                if (known is not None) != (place.reused or place.replaces):
                    raise WriteConflictError("an object of this name came or went meanwhile")
                _register(connection, order, place, files)
            return _finish(order, place, files, staging)
    except WriteConflictError:
        return make_under_lock(engine, order, progress)


def _place(connection: Connection, order: Order) -> ObjectPlacement:
    """Find the object's place: that of the rehearsal where the array is as empty as it was then."""
    plan, rehearsal = order.plan, order.rehearsal
    if rehearsal is not None:
        known = find_object(connection, plan.spec.name)
        if known is None and not occupancy_of(connection, plan).used:
            return rehearsal.place
    return place_object(connection, plan, order.replace)


def _stage(
    order: Order, place: ObjectPlacement, staging: Staging, progress: Progress
) -> StagedObject:
    progress("building the parts", 0.0)
    rehearsal = order.rehearsal
    if rehearsal is not None and place is rehearsal.place:
        built = rehearsal.built
    else:
        built = parts_of(order.plan, place.layout)
    return stage(
        order.plan, place.layout, built, order.formats, staging, verify=order.verify,
        slice_plates=order.slice_plates, progress=progress,
    )  # fmt: skip


def _register(
    connection: Connection, order: Order, place: ObjectPlacement, files: StagedObject
) -> None:
    plan, url = order.plan, connection.engine.url
    registration = ObjectRecord(
        name=plan.spec.name,
        polyhedron=plan.polyhedron,
        layout=place.layout,
        array=plan.array,
        profile=plan.spec.profile,
        lab_key=plan.spec.array_key,
        alphabet=plan.alphabet,
        style=plan.spec.style,
        spec=plan.meaning,
        tool_version=version("encoded-objects"),
        parts=tuple(
            dataclasses.replace(part, file=part_file(url, part.file)) for part in files.registered
        ),
    )
    register(connection, registration, replace=place.replaces)


def _finish(order: Order, place: ObjectPlacement, files: StagedObject, staging: Staging) -> Product:
    written = tuple(w.path for w in staging.commit())
    made = describe_object(
        order.plan, place.layout, files.parts, files.warnings, written, files.faces,
        reused=place.reused, fit=files.fit,
    )  # fmt: skip
    return Product(made, place)
