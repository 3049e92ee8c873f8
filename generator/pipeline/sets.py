"""Several objects that share one array: placed together, made in parallel, resumed where ended.

All places are chosen first, each after the ones before it; then every process builds and
registers objects of its own (`make.make_at`). An object that is registered from an equal
spec, with all its files in place and unchanged, is skipped.
"""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from sqlalchemy import Connection, Engine

from encoded_objects.base.errors import install_line
from generator.database.part_file import part_state
from generator.database.read import find_object, natural_key, read_layout, read_parts
from generator.database.register import require_in_use
from generator.database.transaction import read_transaction
from generator.export.formats import EXPORTERS
from generator.export.set_files import can_draw
from generator.pipeline.made import MadeObject, describe_object
from generator.pipeline.make import MakeJob, has_files_in, make_at
from generator.pipeline.parallel import ENGINES, Task, Workers, engine_of
from generator.pipeline.place import PlacedObject, place_in_turn
from generator.pipeline.plates import build_sheet_path, write_set
from generator.pipeline.progress import Progress, part_of_progress


def make_set(
    engine: Engine,
    url: str,
    to_make: Sequence[MakeJob],
    folder: Path,
    processes: int | None,
    progress: Progress,
    *,
    slice_plates: bool = False,
) -> tuple[list[MadeObject], tuple[Path, ...], tuple[Path, ...]]:
    """Make the objects of a set, and the files of the set in `folder`; return both, in order.

    Last come those of the files that are opened to print all plates.

    Processes open the database at `url` for themselves; `processes` None: one on each processor,
    if there is enough to do.

    Raises
    ------
    GeneratorError
        Of the first object that cannot be made; others may be made already.
    """
    made: dict[int, MadeObject] = {}
    tasks: dict[int, Task[MadeObject]] = {}
    with read_transaction(engine) as connection:
        for number, job in enumerate(to_make):
            if not job.verify and (skipped := _intact_object(connection, job)) is not None:
                made[number] = skipped
                progress(f"{skipped.name} is there, with all its files: skipped", 0.0)
        left = {number: job for number, job in enumerate(to_make) if number not in made}
        plans = [job.plan for job in left.values()]
        ours = to_make[0].replace or any(
            has_files_in(connection, job.plan.spec.name, job.folder) for job in to_make
        )
        places = place_in_turn(connection, plans, replace=to_make[0].replace)
        for number, job in left.items():
            name = job.plan.spec.name
            progress(f"placing {name}", 0.1 * number / len(to_make))
            tasks[number] = Task(f"making {name}", _make, (url, job, next(places)))
    ENGINES[url] = engine
    with Workers(processes) as workers:
        found = workers.done(list(tasks.values()), part_of_progress(progress, 0.1, 0.8))
        made |= dict(zip(tasks, found, strict=True))
        objects = [made[number] for number in range(len(to_make))]
        files, to_print = ((), ()) if not any(job.formats for job in to_make) else write_set(
            [(job, one.layout) for job, one in zip(to_make, objects, strict=True)],
            folder, workers, part_of_progress(progress, 0.8, 1.0), slice_plates=slice_plates,
            replace=ours,
        )  # fmt: skip
    if files and not can_draw():
        notice = f"the set has no overview: matplotlib is not installed; {install_line('report')}"
        objects[0] = replace(objects[0], warnings=(*objects[0].warnings, notice))
    return objects, files, to_print


def set_folder(to_make: Sequence[MakeJob], folder: Path | None) -> Path:
    """Return where the files of the set go: `folder`, or what the objects' folders share."""
    if folder is not None:
        return folder
    common = Path(os.path.commonpath([job.folder.absolute() for job in to_make]))
    if common == Path(common.anchor):  # objects on different disks
        return to_make[0].folder
    return Path(os.path.relpath(common)) if common.is_relative_to(Path.cwd()) else common


def _make(url: str, job: MakeJob, placed: PlacedObject) -> MadeObject:
    """Make one object; runs in any process."""
    return make_at(engine_of(url), job, placed)


def _intact_object(connection: Connection, job: MakeJob) -> MadeObject | None:
    """Return the object if it is registered from an equal spec and all its files stand.

    What robots load is no part of a registered spec, and gzipped STEP is not registered, so both
    are always written again.
    """
    if not all(EXPORTERS[name].kept for name in job.formats):
        return None
    plan, url = job.plan, connection.engine.url
    known = find_object(connection, plan.spec.name)
    if known is None or not known.same_spec(plan.meaning):
        return None
    require_in_use(connection, known)
    states = [part_state(url, part) for part in read_parts(connection, known.object_id)]
    states = [state for state in states if state.part.format in job.formats]
    for kind in job.formats:
        if EXPORTERS[kind].registered and not any(state.part.format == kind for state in states):
            return None
    here = job.folder.absolute()
    if any(state.state != "ok" or state.path.parent != here for state in states):
        return None
    parts = {state.part.name for state in states}
    stem = job.folder / plan.spec.name
    others = [Path(f"{stem}.png"), build_sheet_path(job), Path(f"{stem}-array.svg")]
    if not job.formats:
        others = []
    if "step" in job.formats and len(parts) > 1:
        others.append(Path(f"{stem}.step"))
    if "glb" in job.formats:
        others.append(Path(f"{stem}.glb"))
    if "3mf" in job.formats:
        found = job.folder.glob(f"{glob.escape(plan.spec.name)}-plate-*.3mf")
        plates = sorted(found, key=lambda plate: natural_key(plate.name))
        others += plates or [Path(f"{stem}.3mf"), Path(f"{stem}-prusaslicer.3mf")]
    if "bambu" in job.formats:
        found = job.folder.glob(f"{glob.escape(plan.spec.name)}-bambu*.3mf")
        others += sorted(found) or [Path(f"{stem}-bambu.3mf")]
    if not all(other.is_file() for other in others):
        return None
    files = (*(state.path for state in states), *others)
    layout = read_layout(connection, plan.spec.name)
    made = describe_object(plan, layout, len(parts), ())
    return replace(made, files=files, reused=True, skipped=True)
