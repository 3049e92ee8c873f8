"""`validate-set`: touch a set in simulation, read it, and say how far the answers can be trusted.

::

    validate-set SPEC.yaml...          make the set, touch it, report
    validate-set compare A B           two runs side by side
    validate-set worlds DIR...         runs of different worlds on one page
    validate-set repeat DIR NUMBER     one touch again, with pictures of each stage
    validate-set report DIR            the report anew from the touches that are there

Results go to stdout, progress and messages to stderr. Exit codes: 0 done, 1 ran but failed
(`--fail-under`, or a worker was lost), 2 bad input, 4 database, 130 interrupted. Nothing
heavy is imported before it is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from encoded_objects.base import console, output
from encoded_objects.base.console import Action
from encoded_objects.base.output import progress_bar
from probe.contact.engines import ENGINES
from probe.simulate.world.levels import LEVELS

if TYPE_CHECKING:
    from recognizer.validation.result import ValidationResult

NAME = "validate-set"
TOOLS = ("compare", "worlds", "repeat", "report")
HELP = """Touch a set of objects in simulation, read every touch, and report how far the answers \
can be trusted.

The parts are made from the specs, the written files are touched, and the answers are compared \
with the truth, which the reader never sees. DIR gets report.html, results.json and \
trials.parquet.
"""
EPILOG = """Exit codes: 0 done, 1 ran but failed, 2 bad input, 4 database, 130 interrupted.

More commands, each with --help:

[bold]validate-set compare[/] A B           two runs side by side

[bold]validate-set worlds[/] DIR...         runs of different worlds on one page

[bold]validate-set repeat[/] DIR NUMBER     one touch again, with pictures of each stage

[bold]validate-set report[/] DIR            the report anew from the touches that are there
"""

Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout, also for errors.")]

app = console.application()
tools = console.application()


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `validate-set` and leave with its exit code."""
    console.one_thread()
    console.main(NAME, _application, arguments, advice="; go on with --resume")


def run(arguments: list[str]) -> int:
    """Run one command; returns its exit code. Errors are reported, not raised."""
    return console.run(NAME, _application, arguments)


def _application(arguments: list[str]) -> typer.Typer:
    return tools if arguments[:1] and arguments[0] in TOOLS else app


@app.command(help=HELP, epilog=EPILOG)
def touch_set(
    specs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="SPEC.yaml...", show_default=False,
                       help="What is made and touched; none: what --database holds."),
    ] = None,
    touches: Annotated[
        int | None, typer.Option(min=1, show_default=False, help="How many touches; 1000."),
    ] = None,
    folder: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="Folder of the run."),
    ] = Path("validation"),
    database: Annotated[
        str, typer.Option(metavar="URL", show_default=False,
                          help="Where the set is registered; DIR/lab.db if left out."),
    ] = "",
    kinds: Annotated[
        str, typer.Option(metavar="LIST", show_default=False,
                          help="Kinds of touches and their shares: face, edge, corner, worn, "
                               "blank, foreign, copy, near, small, side, same_profile; "
                               "as face=3,edge."),
    ] = "",
    levels: Annotated[
        str, typer.Option("--levels", "--noise", metavar="LIST", show_default=False,
                          help=f"Sensors and prints, and their shares: {', '.join(LEVELS)}."),
    ] = "",
    sensor_type: Annotated[
        str, typer.Option("--sensor-type", metavar="NAME|FILE", show_default=False,
                          help="What touches: a name that probe-sensor types lists, or a file; "
                               "fsr-16. It is pressed as hard."),
    ] = "",
    overlay: Annotated[
        str, typer.Option(metavar="tab|pad", show_default=False,
                          help="Elastic overlay; that of the sensor type."),
    ] = "",
    surfaces: Annotated[
        str, typer.Option(metavar="files|printed|database", show_default=False,
                          help="What is touched: the written STL files, what a filament printer "
                               "leaves of them (needs PrusaSlicer), or the registered faces; "
                               "files."),
    ] = "",
    print_profile: Annotated[
        str, typer.Option(metavar="NAME", show_default=False,
                          help="Of printed surfaces: nozzle and layer, as fdm-0.6-0.3, or a .ini "
                               "file that PrusaSlicer exported; fdm-0.4-0.2."),
    ] = "",
    faults: Annotated[
        str, typer.Option(metavar="none|usual|bad|k=v,...", show_default=False,
                          help="Of printed surfaces: what the machine does wrong; none."),
    ] = "",
    prints: Annotated[
        Path | None, typer.Option(metavar="DIR", show_default=False,
                                  help="Folder of printed surfaces and G-code that runs share; "
                                       "printed in the folder of the run."),
    ] = None,
    engine: Annotated[
        str, typer.Option(metavar="|".join(ENGINES), show_default=False,
                          help="Who computes the contact; own. mujoco shares no model with the "
                               "reader; .3 to .5 s of CPU a touch."),
    ] = "",
    sensor_per: Annotated[
        str, typer.Option(metavar="touch|run", show_default=False,
                          help="How long a sensor's errors stay the same; touch."),
    ] = "",
    policy: Annotated[
        str, typer.Option(metavar="one|next", show_default=False,
                          help="next: where a touch is not answered, touch where the answer "
                               "proposes, up to three times, read as one belief; one."),
    ] = "",
    study: Annotated[
        int | None, typer.Option(min=0, show_default=False,
                                 help="Touches of each reader in the picture of error against run "
                                      "time: 200, about a minute of CPU; none where --touches "
                                      "is less. 0: none."),
    ] = None,
    shard: Annotated[
        int | None, typer.Option(min=1, show_default=False,
                                 help="Touches in a file, and lost at most when interrupted; "
                                      "1000."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, show_default=False, help="Of all that is drawn; 1."),
    ] = None,
    processes: Annotated[
        int, typer.Option("-j", "--jobs", min=1, help="Processes on this machine."),
    ] = 1,
    cluster: Annotated[
        str, typer.Option(metavar="tcp://HOST:PORT", show_default=False,
                          help="A dask scheduler whose workers do the work."),
    ] = "",
    export: Annotated[
        str, typer.Option(metavar="npz|lerobot", show_default=False,
                          help="Write the touches with their truth too, for training: DIR/"
                               "dataset.npz or DIR/lerobot. With --resume also of a run that is "
                               "done."),
    ] = "",
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the run in DIR."),
    ] = False,
    fail_under: Annotated[
        float | None, typer.Option(min=0.0, max=100.0, show_default=False, metavar="PERCENT",
                                   help="Exit code 1 if a touch is answered wrong, or fewer of "
                                        "those that show enough symbols are answered right."),
    ] = None,
    as_json: Json = False,
    version: Annotated[bool, typer.Option("--version", help="Say which version this is.")] = False,
) -> Action:  # fmt: skip
    """Read the options of `validate-set SPEC.yaml...`; `HELP` is what people see."""

    def action() -> int:
        if version:
            output.version(NAME, as_json=as_json)
            return console.DONE
        from recognizer.validation.pipeline import validate
        from recognizer.validation.progress import TouchProgress

        with progress_bar("making the set") as bar:
            result = validate(
                specs or (), folder=folder, touches=touches, database=database, kinds=kinds,
                levels=levels, sensor_type=sensor_type or None, overlay=overlay,
                surfaces=surfaces, print_profile=print_profile,
                faults=faults, prints=prints or "", engine=engine, sensor_per=sensor_per,
                policy=policy, study=study, shard=shard, seed=seed, jobs=processes, cluster=cluster,
                export=export, resume=resume, progress=TouchProgress(bar),
            )  # fmt: skip
        _say(result, as_json=as_json)
        return result.exit_code(fail_under)

    return action


@tools.command()
def compare(
    first: Annotated[Path, typer.Argument(metavar="A", help="Folder of a run.")],
    second: Annotated[Path, typer.Argument(metavar="B", help="Folder of another run.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.html", show_default=False,
                                  help="Page to write."),
    ] = None,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Show two runs side by side: what became better, worse, or is the same within chance."""

    def action() -> int:
        from recognizer.validation import text
        from recognizer.validation.compare import compare_runs

        text.comparison(compare_runs(first, second, output), output, as_json=as_json)
        return console.DONE

    return action


@tools.command()
def worlds(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Folders of runs.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.html", show_default=False,
                                  help="Page to write; JSON goes beside it, as FILE.json."),
    ] = None,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Show runs of different worlds on one page: engines, surfaces, sensors."""

    def action() -> int:
        from recognizer.validation import text
        from recognizer.validation.join import join_runs

        text.worlds(join_runs(folders, output), output, as_json=as_json)
        return console.DONE

    return action


@tools.command()
def repeat(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run.")],
    number: Annotated[int, typer.Argument(min=0, help="Number of the touch.")],
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE.png", show_default=False,
                                  help="Pictures of each stage: .png, .svg or .pdf."),
    ] = None,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Do one touch again: surface, counts, fitted symbols, answer and truth."""

    def action() -> int:
        from recognizer.validation import text
        from recognizer.validation.repeat import repeat_touch

        text.repetition(repeat_touch(folder, number, plot), plot, as_json=as_json)
        return console.DONE

    return action


@tools.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run that is done.")],
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Write results and report anew from the touches that are there."""

    def action() -> int:
        from recognizer.validation.pipeline import report_anew

        _say(report_anew(folder), as_json=as_json)
        return console.DONE

    return action


def _say(result: ValidationResult, *, as_json: bool) -> None:
    """Say how a run ended."""
    if as_json:
        output.write_json(result.as_json())
    else:
        output.write(f"{result}\nnext: open {result.folder / 'report.html'}")


if __name__ == "__main__":
    main()
