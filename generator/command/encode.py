"""`encode-object SPEC.yaml...`: read the specs, make the objects, say what was made."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Application, Argument, Json, Option, command
from generator.command import NAME

if TYPE_CHECKING:
    from encoded_objects.base.document import Problem
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
        str | None,
        Option("step, stl, 3mf, bambu (Bambu Studio, OrcaSlicer), glb, stpz (STEP, gzipped), mjcf, "
               "urdf, sdf, usd: files to write, with commas between.", "LIST",
               names=("--format",)),
    ] = None,
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
    trial: Annotated[
        Path | None,
        Option("With --dry-run: a new database with what would be made, to touch it in "
               "simulation (open-bench --database FILE).", "FILE"),
    ] = None,
    verify: Annotated[
        bool, Option("Read every file back and prove it (needs the cad and mesh extras).")
    ] = False,
    slice_plates: Annotated[
        bool,
        Option("Slice the plates with PrusaSlicer: time and filament on the build sheet.",
               names=("--slice",)),
    ] = False,
    replace: Annotated[
        bool,
        Option("Allow a changed spec under a registered name, and replace files that no object "
               "of the database has made."),
    ] = False,
    yes: Annotated[
        bool, Option("Write where a spec says without a question, also outside its folder.")
    ] = False,
    no_files: Annotated[
        bool, Option("Refuse specs that name files or folders: those of strangers.")
    ] = False,
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
    if trial and not dry_run:
        raise UsageError("--trial needs --dry-run")
    from encoded_objects.base.output import progress_bar
    from generator.spec import read_specs
    from generator.spec.option import database_option, format_option, sensor_type_option

    wanted = None if formats is None or printed_check else format_option(formats)
    url = database_option(database) if database else None
    sensor = sensor_type_option(sensor_type) if sensor_type else ""
    found = read_specs(specs, database=url, sensor_type=sensor, files=not no_files)
    if not (yes or dry_run):
        _confirm_places(found, folder, url, as_json=as_json)
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
                dry_run=dry_run, trial=trial, verify=verify, slice_plates=slice_plates,
                replace=replace, progress=progress, jobs=jobs,
            )  # fmt: skip
    if printed_check:
        print_printed(checked, as_json=as_json)
    else:
        print_made(made, dry_run=dry_run, as_json=as_json, verified=verify)
    return 0


def _confirm_places(
    specs: Sequence[ObjectSpec], folder: Path | None, url: str | None, *, as_json: bool
) -> None:
    """Ask before a spec writes outside its folder and the current one; leave if the answer is no.

    What the command line names is not asked for.

    Raises
    ------
    SpecError
        Nobody is there to be asked.
    """
    from generator.spec.problem import SpecError

    outside = {
        (problem.place, problem.cause): problem
        for spec in specs
        for problem in _places_outside(spec, folder, url)
    }
    if not outside:
        return
    if as_json or not sys.stdin.isatty():
        raise SpecError(list(outside.values()))
    import typer

    for problem in outside.values():
        sys.stderr.write(f"{problem.place}: {problem.cause}\n")
    if not typer.confirm("Write there?", err=True):
        raise typer.Exit(1)


def _places_outside(spec: ObjectSpec, folder: Path | None, url: str | None) -> Iterator[Problem]:
    """Yield what a spec says of places outside its folder and the current one."""
    from encoded_objects.base.document import Problem
    from encoded_objects.base.errors import without_password
    from generator.database.open import normal_url
    from generator.spec.problem import mark_of

    said = spec.source.value.get("output") if isinstance(spec.source.value, dict) else None
    said = said if isinstance(said, dict) else {}
    near = (Path.cwd().resolve(), spec.source.folder.resolve())
    places: dict[str, tuple[Path | None, str, str]] = {}
    if folder is None and said.get("folder") is not None:
        places["folder"] = (spec.folder.resolve(), str(spec.folder.resolve()), "-o DIR")
    if url is None and said.get("database") is not None:
        home = normal_url(spec.database)
        on_disk = home.get_backend_name() == "sqlite"
        path = Path(home.database or "").resolve() if on_disk else None
        shown = without_password(spec.database) if path is None else str(path)
        places["database"] = (path, shown, "--database URL")
    for key, (path, shown, option) in places.items():
        if path is None or not any(path.is_relative_to(home) for home in near):
            yield Problem(
                f"output: {key} writes to {shown}, outside the spec's folder and the current one",
                f"confirm it with --yes, or say where: {option}",
                mark_of(spec.source, f"output.{key}"),
            )
