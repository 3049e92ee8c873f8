"""`encode-object lab | list | show | retire | export | import`: what a lab's database holds."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Application, Argument, Json, Option, command

if TYPE_CHECKING:
    from sqlalchemy import Engine

app = Application()
Database = Annotated[str, Option("lab.db, sqlite:///lab.db, postgresql://host/name.", "URL")]
Only = Annotated[
    list[str] | None,
    Option("Only this one; may be given several times.", "NAME", names=("--object",)),
]
LAB = "sqlite:///lab.db"


@command(app, "list")
def list_(database: Database = LAB, as_json: Json = False) -> int:
    """Print the objects that a database holds."""
    from generator.command import object_report
    from generator.database.lab import read_fullness
    from generator.database.open import open_database
    from generator.database.read import list_objects
    from generator.database.transaction import read_transaction
    from generator.spec.option import database_option

    url = database_option(database)
    with read_transaction(open_database(url, writable=False)) as connection:
        entries, fullness = list_objects(connection), read_fullness(connection)
    object_report.print_list(entries, fullness, url, as_json=as_json)
    return 0


@command(app)
def lab(database: Database = LAB, as_json: Json = False) -> int:
    """Print the lab's key, its arrays, and how full they are.

    Every new database draws a key, from which its arrays are made: two labs agree on a touch by
    chance only. A new database that is given the same key, --lab-key KEY, has the same arrays.
    """
    from generator.command.object_report import print_lab
    from generator.database.lab import read_fullness
    from generator.database.open import open_database
    from generator.database.transaction import read_transaction
    from generator.spec.option import database_option

    url = database_option(database)
    with read_transaction(open_database(url, writable=False)) as connection:
        fullness = read_fullness(connection)
    print_lab(fullness, url, as_json=as_json)
    return 0


@command(app)
def show(
    name: Annotated[str, Argument("As `list` names it.", "OBJECT")],
    database: Database = LAB,
    sensor_type: Annotated[
        str, Option("What touches it, for what faces promise; fsr-16.", "NAME|FILE")
    ] = "",
    as_json: Json = False,
) -> int:
    """Print all about one object: faces, cells, origin, files and whether they are unchanged."""
    from encoded_objects.base.sensor_type import USUAL_SENSOR
    from encoded_objects.base.sensor_type_file import sensor_type_named
    from generator.command import object_report
    from generator.database.open import open_database
    from generator.database.part_file import part_state
    from generator.database.read import read_object
    from generator.database.transaction import explain_values, read_transaction
    from generator.spec.option import database_option

    url = database_option(database)
    sensor = sensor_type_named(sensor_type) if sensor_type else USUAL_SENSOR
    engine = open_database(url, writable=False)
    with read_transaction(engine) as connection:
        held = read_object(connection, name)
    files = [part_state(engine.url, part) for part in held.parts]
    with explain_values(engine):  # promises rest on lengths that only a sound database has
        object_report.print_object(held, files, url, sensor, as_json=as_json)
    return 0


@command(app)
def retire(
    names: Annotated[list[str], Argument("As `list` names them.", "OBJECT...")],
    database: Database = LAB,
    free: Annotated[
        bool, Option("Remove it and free its cells for other objects."),
    ] = False,
    yes: Annotated[bool, Option("Confirm --free without a question.")] = False,
    undo: Annotated[bool, Option("Bring retired objects back.")] = False,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Take objects out of use; their cells stay taken, so that no other object is mistaken.

    With --free an object is removed altogether: destroy its parts first, since a touch on one
    will name whichever object gets the cells.
    """
    from generator.command import object_report
    from generator.database import register as change
    from generator.database.open import existing_database
    from generator.database.transaction import retry_on_conflict
    from generator.spec.option import database_option

    if free and undo:
        raise UsageError("--free and --undo exclude each other")
    url = database_option(database)
    engine = existing_database(url)
    if free and not yes:
        _confirm(engine, names, as_json=as_json)
    do = change.remove if free else change.restore if undo else change.retire
    unique = tuple(dict.fromkeys(names))
    entries = retry_on_conflict(
        engine, lambda connection: [do(connection, name) for name in unique]
    )
    done = "removed" if free else "restored" if undo else "retired"
    object_report.print_retired(entries, done, url, as_json=as_json)
    return 0


@command(app)
def export(
    file: Annotated[Path, Argument("The database file to write.", "FILE")],
    database: Database = LAB,
    objects: Only = None,
    force: Annotated[bool, Option("Replace a file that is there.")] = False,
    as_json: Json = False,
) -> int:
    """Write objects into a file for another lab: a database, without the files of parts."""
    from generator.command import object_report
    from generator.database.exchange import export_objects
    from generator.spec.option import database_option

    url = database_option(database)
    done = export_objects(url, file, names=objects or (), force=force)
    object_report.print_export(done, file, url, as_json=as_json)
    return 0


@command(app, "import")
def import_(
    file: Annotated[str, Argument("What another lab exported.", "FILE")],
    database: Database = LAB,
    objects: Only = None,
    rename: Annotated[
        list[str] | None,
        Option("Another name here; may be given several times.", "OLD=NEW"),
    ] = None,
    lab_key: Annotated[
        str, Option("Of a new database: the other lab's, to go on with its arrays.", "KEY"),
    ] = "",
    skip_refused: Annotated[
        bool, Option("Import the others where some cannot be."),
    ] = False,
    dry_run: Annotated[
        bool, Option("Say what would be imported; change nothing."),
    ] = False,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Take over the objects of another lab on the cells that they have: all of them, or none.

    An object is refused when another one here holds one of its cells or its name. One that is
    here already, the same, is left as it is.
    """
    from generator.command import object_report
    from generator.database.exchange import import_objects
    from generator.spec.option import database_option

    url = database_option(database)
    done = import_objects(
        url,
        file,
        names=objects or (),
        renamed=dict(_new_name(given) for given in rename or ()),
        skip_refused=skip_refused,
        dry_run=dry_run,
        lab_key=lab_key,
    )
    object_report.print_import(done, url, dry_run=dry_run, as_json=as_json)
    return 0


def _confirm(engine: Engine, names: list[str], *, as_json: bool) -> None:
    from generator.command import object_report
    from generator.database.read import object_entry
    from generator.database.transaction import read_transaction

    with read_transaction(engine) as connection:
        entries = [object_entry(connection, name) for name in dict.fromkeys(names)]
    if as_json or not sys.stdin.isatty():
        raise UsageError("--free removes objects for good; confirm it with --yes")
    sys.stderr.write(object_report.warning_before(entries))
    import typer

    if not typer.confirm("Remove them and free their cells?", err=True):
        raise typer.Exit(1)


def _new_name(given: str) -> tuple[str, str]:
    old, _, new = given.rpartition("=")
    if not old or not new.strip():
        raise UsageError(f"--rename takes OLD=NEW, not '{given}'")
    return old, new.strip()
