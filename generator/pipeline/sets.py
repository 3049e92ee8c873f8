"""Several objects that share one array: placed together, made in parallel, resumed where ended.

All places are chosen first, each beside the ones before it; then every process builds and
registers objects of its own (`make.make_at`). An object that is registered from the same
spec, with all its files in place and unchanged, is skipped: the same command again finishes
what was interrupted.
"""

from __future__ import annotations

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
from generator.pipeline.make import Order, Product, make_at
from generator.pipeline.parallel import Engines, Task, Workers
from generator.pipeline.place import ObjectPlacement, occupancy_of, occupancy_with, place_object
from generator.pipeline.plates import write_set
from generator.pipeline.progress import Progress, part_of_progress
from generator.pipeline.set_sheet import SetObject


def make_set(
    engine: Engine,
    url: str,
    orders: Sequence[Order],
    folder: Path,
    jobs: int | None,
    progress: Progress,
    *,
    slice_plates: bool = False,
) -> tuple[list[MadeObject], tuple[Path, ...]]:
    """Make the objects of a set and what belongs to it as a whole.

    Parameters
    ----------
    engine, url
        The database; processes open it for themselves.
    orders
        The objects, on one array.
    folder
        For plates, overview and packing list.
    jobs
        Processes; None for one on each processor, if there is enough to do.
    slice_plates
        Ask PrusaSlicer what printing takes, for the build sheet.

    Returns
    -------
    What was made of each object in the order of `orders`, and the files of the set.

    Raises
    ------
    GeneratorError
        Of the first object that cannot be made; others may be made already.
    """
    products: list[Product | None] = [None] * len(orders)
    tasks: list[Task[Product]] = []
    numbers: list[int] = []
    with read_transaction(engine) as connection:
        taken = occupancy_of(connection, orders[0].plan)
        for number, order in enumerate(orders):
            name = order.plan.spec.name
            if (skipped := _intact_product(connection, order)) is not None:
                products[number] = skipped
                progress(f"{name} is there, with all its files: skipped", 0.0)
                continue
            progress(f"placing {name}", 0.1 * number / len(orders))
            place = place_object(connection, order.plan, order.replace, taken)
            if not place.reused:
                taken = occupancy_with(taken, place.layout)
            numbers.append(number)
            tasks.append(Task(f"making {name}", _make, (url, order, place)))
    Engines.keep(url, engine)
    with Workers(jobs) as workers:
        found = workers.done(tasks, part_of_progress(progress, 0.1, 0.8))
        return _write_whole(
            orders, products, numbers, found, folder, workers, progress, slice_plates=slice_plates
        )


def _write_whole(
    orders: Sequence[Order],
    products: list[Product | None],
    numbers: Sequence[int],
    found: Sequence[Product],
    folder: Path,
    workers: Workers,
    progress: Progress,
    *,
    slice_plates: bool,
) -> tuple[list[MadeObject], tuple[Path, ...]]:
    """Write what belongs to the set as a whole; return its objects in order and its files."""
    for number, product in zip(numbers, found, strict=True):
        products[number] = product
    done = [product for product in products if product is not None]
    objects = [
        SetObject(order.plan, product.placed.layout, order.formats)
        for order, product in zip(orders, done, strict=True)
    ]
    sheets = [order.folder / f"{order.plan.spec.name}-build.html" for order in orders]
    files = write_set(
        objects, sheets, folder, workers, part_of_progress(progress, 0.8, 1.0),
        slice_plates=slice_plates,
    )  # fmt: skip
    made = [product.made for product in done]
    if not can_draw():
        notice = f"the set has no overview: matplotlib is not installed; {install_line('report')}"
        made[0] = replace(made[0], warnings=(*made[0].warnings, notice))
    return made, files


def set_folder(orders: Sequence[Order], folder: Path | None) -> Path:
    """Return where the files of the set go: `folder`, or what the objects' folders share."""
    if folder is not None:
        return folder
    common = Path(os.path.commonpath([order.folder.absolute() for order in orders]))
    if common == Path(common.anchor):  # objects on different disks
        return orders[0].folder
    return Path(os.path.relpath(common)) if common.is_relative_to(Path.cwd()) else common


def _make(url: str, order: Order, place: ObjectPlacement) -> Product:
    """Make one object; runs in any process."""
    return make_at(Engines.open(url), order, place)


def _intact_product(connection: Connection, order: Order) -> Product | None:
    """Return the object if it is registered from the same spec and all its files stand.

    What robots load is no part of a registered spec, and gzipped STEP is not registered, so both
    are always written anew.
    """
    if not all(EXPORTERS[name].kept for name in order.formats):
        return None
    plan, url = order.plan, connection.engine.url
    known = find_object(connection, plan.spec.name)
    if known is None or not known.same_spec(plan.meaning):
        return None
    require_in_use(connection, known)
    stem, files = order.folder / plan.spec.name, []
    states = [part_state(url, part) for part in read_parts(connection, known.object_id)]
    states = [state for state in states if state.part.format in order.formats]
    for kind in order.formats:
        if EXPORTERS[kind].registered and not any(state.part.format == kind for state in states):
            return None
    here = order.folder.absolute()
    if any(state.state != "ok" or state.path.parent != here for state in states):
        return None
    files += [state.path for state in states]
    others = [f"{stem}.png", f"{stem}-build.html", f"{stem}-array.svg"]
    if "step" in order.formats and len({state.part.name for state in states}) > 1:
        others.append(f"{stem}.step")
    if "glb" in order.formats:
        others.append(f"{stem}.glb")
    if "3mf" in order.formats:
        found = order.folder.glob(f"{_escape_glob(plan.spec.name)}-plate-*.3mf")
        plates = sorted(found, key=lambda plate: natural_key(plate.name))
        others += map(str, plates or [Path(f"{stem}.3mf"), Path(f"{stem}-prusaslicer.3mf")])
    if not all(os.path.isfile(other) for other in others):
        return None
    layout = read_layout(connection, plan.spec.name)
    made = describe_object(
        plan,
        layout,
        len({state.part.name for state in states}),
        (),
        tuple(files) + tuple(map(Path, others)),
        reused=True,
        skipped=True,
    )
    return Product(made, ObjectPlacement(layout, 0, reused=True, replaces=False))


def _escape_glob(name: str) -> str:
    """Return a name with what `glob` would take as a pattern put in brackets."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in name)
