"""`encode-object SPEC.yaml...`: read the specs, make the objects, say what was made."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from encoded_objects.base import console
from encoded_objects.base.console import Action

if TYPE_CHECKING:
    from generator.spec import ObjectSpec

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

app = console.application()


@app.command(help=HELP, epilog=EPILOG)
def encode(
    specs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="SPEC.yaml...", help="What to make: objects or sets.",
                       show_default=False),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", show_default=False,
                     help="Folder for the files, in place of output: folder:."),
    ] = None,
    formats: Annotated[
        str, typer.Option("--format", metavar="LIST", show_default=False,
                          help="step, stl, 3mf, glb, stpz (STEP, gzipped), mjcf, urdf, "
                               "sdf, usd: files to write, with commas between."),
    ] = "",
    database: Annotated[
        str, typer.Option(metavar="URL", show_default=False,
                          help="Registers the cells: lab.db, sqlite:///lab.db, postgresql://host/name."),
    ] = "",
    lab_key: Annotated[
        str, typer.Option(metavar="KEY", show_default=False,
                          help="Of a new database: the same key, the same arrays and bytes; drawn "
                               "if left out. encode-object lab prints it."),
    ] = "",
    sensor_type: Annotated[
        str, typer.Option("--sensor-type", metavar="NAME|FILE", show_default=False,
                          help="What will touch them, in place of sensor_type: in the specs; "
                               "fsr-16. Decides the pitch that auto takes, and what faces "
                               "promise."),
    ] = "",
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what would be made; write nothing."),
    ] = False,
    verify: Annotated[
        bool, typer.Option("--verify", help="Read every file back and prove it (needs the cad and "
                                            "mesh extras)."),
    ] = False,
    slice_plates: Annotated[
        bool, typer.Option("--slice", help="Slice the plates with PrusaSlicer: time and filament "
                                           "on the build sheet."),
    ] = False,
    replace: Annotated[
        bool, typer.Option("--replace", help="Allow a changed spec under a registered name."),
    ] = False,
    printed_check: Annotated[
        bool, typer.Option("--printed-check", help="Slice and print in simulation: which symbols "
                                                   "survive; makes a picture, registers nothing."),
    ] = False,
    print_profile: Annotated[
        str, typer.Option(metavar="NAME", show_default=False,
                          help="For --printed-check: fdm-0.4-0.2, ... or an exported .ini file."),
    ] = "",
    print_faults: Annotated[
        str, typer.Option(metavar="none|usual|bad|k=v,...", show_default=False,
                          help="For --printed-check: what the machine does wrong."),
    ] = "",
    jobs: Annotated[
        int | None, typer.Option("-j", "--jobs", metavar="N", min=1, show_default=False,
                                 help="Processes for a set of many objects."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON object on stdout, also for errors."),
    ] = False,
    version: Annotated[
        bool, typer.Option("--version", help="Say which version this is."),
    ] = False,
) -> Action:  # fmt: skip
    """Read the options of `encode-object SPEC.yaml...`; `HELP` is what people see."""

    def action() -> int:
        from encoded_objects.base import output
        from generator.command import NAME

        if version:
            output.version(NAME, as_json=as_json)
            return 0
        if not specs:
            raise typer.BadParameter("no spec is named")
        if printed_check:
            _check_printed(specs, folder, database, sensor_type, print_profile, print_faults,
                           as_json=as_json)  # fmt: skip
            return 0
        if print_profile or print_faults:
            raise typer.BadParameter("print profile and faults need --printed-check")
        _make(specs, folder, formats, database, sensor_type, lab_key=lab_key, dry_run=dry_run,
              verify=verify, slice_plates=slice_plates, replace=replace, jobs=jobs,
              as_json=as_json)  # fmt: skip
        return 0

    return action


def _make(
    specs: list[Path],
    folder: Path | None,
    formats: str,
    database: str,
    sensor_type: str,
    *,
    lab_key: str,
    dry_run: bool,
    verify: bool,
    slice_plates: bool,
    replace: bool,
    jobs: int | None,
    as_json: bool,
) -> None:
    """Make the objects and report them."""
    from encoded_objects.base.output import progress_bar
    from generator.command.made_report import print_made
    from generator.spec.option import database_option, format_option, sensor_type_option
    from generator.spec.read import read_specs

    wanted = format_option(formats) if formats else None
    url = database_option(database) if database else None
    sensor = sensor_type_option(sensor_type) if sensor_type else ""
    located: tuple[ObjectSpec, ...] = read_specs(specs, database=url, sensor_type=sensor)

    from generator.pipeline import encode as make

    with progress_bar("reading", 1) as bar:
        encoded = make(
            located,
            folder=folder,
            formats=wanted,
            database=url,
            lab_key=lab_key,
            dry_run=dry_run,
            verify=verify,
            slice_plates=slice_plates,
            replace=replace,
            progress=lambda what, share: bar.show(share, label=what),
            jobs=jobs,
        )
    print_made(encoded, dry_run=dry_run, as_json=as_json)


def _check_printed(
    specs: list[Path],
    folder: Path | None,
    database: str,
    sensor_type: str,
    profile: str,
    faults: str,
    *,
    as_json: bool,
) -> None:
    """Print the objects in simulation and say what became of their symbols."""
    from encoded_objects.base.output import progress_bar
    from generator.command.printed_report import print_printed
    from generator.pipeline.printed_check import check_printed
    from generator.printed.faults import print_faults
    from generator.spec.option import database_option, sensor_type_option
    from generator.spec.read import read_specs

    url = database_option(database) if database else None
    sensor = sensor_type_option(sensor_type) if sensor_type else ""
    with progress_bar("reading", 1) as bar:
        objects = check_printed(
            read_specs(specs, database=url, sensor_type=sensor),
            folder=folder,
            database=url,
            profile=profile,
            faults=print_faults(faults),
            progress=lambda what, share: bar.show(share, label=what),
        )
    print_printed(objects, as_json=as_json)
