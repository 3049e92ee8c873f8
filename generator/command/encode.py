"""`encode-object SPEC.yaml...`: read the specs, make the objects, say what was made."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Application, Argument, Json, Option, command
from generator.command import NAME

HELP = """Emboss objects with a pseudo-random array, so that a touch tells object, face and place.

Each SPEC.yaml gives STEP, STL and 3MF files that print, a picture, and an entry in the lab's \
database. The smallest one has two lines: [bold]name: Cube[/] and [bold]shape: {cube: 60 mm}[/]
"""
EPILOG = """Exit codes: 0 done, 1 could not be written, 2 bad input, 4 database, 130 interrupted.

More commands, each with --help:

[bold]encode-object init[/] SHAPE      a commented spec to begin with

[bold]encode-object schema[/]          the JSON schema of specs, for editors

[bold]encode-object printers[/]        printers and their limits

[bold]encode-object list[/]            the objects in a database

[bold]encode-object show[/] OBJECT     all about one of them, and whether its files are unchanged

[bold]encode-object retire[/] OBJECT   take it out of use; its cells stay taken

[bold]encode-object export[/] FILE     objects for another lab; [bold]import[/] FILE takes them over
"""

app = Application()


@command(app, help=HELP, epilog=EPILOG, version_of=NAME)
def encode(
    specs: Annotated[
        list[Path] | None, Argument("What to make: objects or sets.", "SPEC.yaml...")
    ] = None,
    folder: Annotated[
        Path | None,
        Option("Folder for the files, in place of output: folder:.", "DIR",
               names=("-o", "--output")),
    ] = None,
    formats: Annotated[
        str,
        Option("step, stl, 3mf, glb, stpz (STEP, gzipped), mjcf, urdf, sdf, usd: files to write, "
               "with commas between.", "LIST", names=("--format",)),
    ] = "",
    database: Annotated[
        str,
        Option("Registers the cells: lab.db, sqlite:///lab.db, postgresql://host/name.", "URL"),
    ] = "",
    lab_key: Annotated[
        str,
        Option("Of a new database: the same key, the same arrays and bytes; drawn if left out. "
               "encode-object lab prints it.", "KEY"),
    ] = "",
    sensor_type: Annotated[
        str,
        Option("What will touch them, in place of sensor_type: in the specs; fsr-16. Decides the "
               "pitch that auto takes, and what faces promise.", "NAME|FILE"),
    ] = "",
    dry_run: Annotated[bool, Option("Say what would be made; write nothing.")] = False,
    verify: Annotated[
        bool, Option("Read every file back and prove it (needs the cad and mesh extras).")
    ] = False,
    slice_plates: Annotated[
        bool,
        Option("Slice the plates with PrusaSlicer: time and filament on the build sheet.",
               names=("--slice",)),
    ] = False,
    replace: Annotated[bool, Option("Allow a changed spec under a registered name.")] = False,
    printed_check: Annotated[
        bool,
        Option("Slice and print in simulation: which symbols survive; makes a picture, registers "
               "nothing."),
    ] = False,
    print_profile: Annotated[
        str, Option("For --printed-check: fdm-0.4-0.2, ... or an exported .ini file.", "NAME")
    ] = "",
    print_faults: Annotated[
        str,
        Option("For --printed-check: what the machine does wrong.", "none|usual|bad|k=v,..."),
    ] = "",
    jobs: Annotated[
        int | None,
        Option("Processes for a set of many objects.", "N", names=("-j", "--jobs"), least=1),
    ] = None,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Make objects, or check how they print; `HELP` is what people see."""
    if not specs:
        raise UsageError("no spec is named")
    if not printed_check and (print_profile or print_faults):
        raise UsageError("print profile and faults need --printed-check")
    from encoded_objects.base.output import progress_bar
    from generator.spec import read_specs
    from generator.spec.option import database_option, format_option, sensor_type_option

    wanted = format_option(formats) if formats and not printed_check else None
    url = database_option(database) if database else None
    sensor = sensor_type_option(sensor_type) if sensor_type else ""
    found = read_specs(specs, database=url, sensor_type=sensor)
    with progress_bar("reading", 1) as bar:

        def progress(what: str, share: float) -> None:
            bar.show(share, label=what)

        if printed_check:
            from generator.command.printed_report import print_printed
            from generator.pipeline.printed_check import check_printed
            from generator.printed.faults import print_faults as faults_named

            checked = check_printed(
                found, folder=folder, database=url, profile=print_profile,
                faults=faults_named(print_faults), progress=progress,
            )  # fmt: skip
        else:
            from generator.command.made_report import print_made
            from generator.pipeline import encode as make

            made = make(
                found, folder=folder, formats=wanted, database=url, lab_key=lab_key,
                dry_run=dry_run, verify=verify, slice_plates=slice_plates, replace=replace,
                progress=progress, jobs=jobs,
            )  # fmt: skip
    if printed_check:
        print_printed(checked, as_json=as_json)
    else:
        print_made(made, dry_run=dry_run, as_json=as_json)
    return 0
