"""`validate-set`: touch a set in simulation, read it, and say how far the answers can be trusted.

`EPILOG` lists its commands and exit codes. Results go to stdout, progress and messages to stderr.
Nothing heavy is imported before it is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

from encoded_objects.base import console, output
from encoded_objects.base.options import Application, Argument, Json, Option, Options, command
from encoded_objects.base.output import progress_bar
from probe.contact.engines import ENGINES
from probe.simulate.world.levels import LEVELS

if TYPE_CHECKING:
    from recognizer.validation.pipeline import ValidationResult

NAME = "validate-set"
TOOLS = ("compare", "worlds", "repeat", "report", "benchmark")
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

[bold]validate-set benchmark[/]             frozen touches with truth, and readers compared on them
"""

app = Application()
tools = Application()


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `validate-set` and leave with its exit code."""
    console.one_thread()
    console.main(NAME, _application, arguments, advice="; go on with --resume")


def run(arguments: list[str]) -> int:
    """Run one command; returns its exit code. Errors are reported, not raised."""
    return console.run(NAME, _application, arguments)


def _application(arguments: list[str]) -> Application:
    return tools if arguments[:1] and arguments[0] in TOOLS else app


@dataclass(frozen=True)
class SetOptions(Options):
    """What is made and touched, by what, how often; named as the arguments of `validate`."""

    specs: Annotated[
        list[Path] | None,
        Argument("What is made and touched; none: what --database holds.", "SPEC.yaml..."),
    ] = None
    touches: Annotated[int | None, Option("How many touches; 1000.", least=1)] = None
    folder: Annotated[Path, Option("Folder of the run.", "DIR", names=("-o", "--output"))] = Path(
        "validation"
    )
    database: Annotated[
        str, Option("Where the set is registered; DIR/lab.db if left out.", "URL")
    ] = ""
    kinds: Annotated[
        str,
        Option(
            "Kinds of touches and their shares: face, edge, corner, worn, blank, foreign, "
            "copy, near, small, side, same_profile, decoy; as face=3,edge.",
            "LIST",
        ),
    ] = ""
    levels: Annotated[
        str,
        Option(
            f"Sensors and prints, and their shares: {', '.join(LEVELS)}.",
            "LIST",
            names=("--levels", "--noise"),
        ),
    ] = ""
    sensor_type: Annotated[
        str,
        Option(
            "What touches: a name that probe-sensor types lists, or a file; fsr-16. It is "
            "pressed as hard.",
            "NAME|FILE",
        ),
    ] = ""
    overlay: Annotated[str, Option("Elastic overlay; that of the sensor type.", "tab|pad")] = ""
    surfaces: Annotated[
        str,
        Option(
            "What is touched: the written STL files, what a filament printer leaves of them "
            "(needs PrusaSlicer), or the registered faces; files.",
            "files|printed|database",
        ),
    ] = ""
    print_profile: Annotated[
        str,
        Option(
            "Of printed surfaces: nozzle and layer, as fdm-0.6-0.3, or a .ini file that "
            "PrusaSlicer exported; fdm-0.4-0.2.",
            "NAME",
        ),
    ] = ""
    faults: Annotated[
        str,
        Option("Of printed surfaces: what the machine does wrong; none.", "none|usual|bad|k=v,..."),
    ] = ""
    prints: Annotated[
        Path | None,
        Option(
            "Folder of printed surfaces and G-code that runs share; printed in the folder of "
            "the run.",
            "DIR",
        ),
    ] = None
    engine: Annotated[
        str,
        Option(
            "Who computes the contact; own. mujoco and drake share no model with the reader; 1.7 "
            "and .8 s of CPU a touch.",
            "|".join(ENGINES),
        ),
    ] = ""
    sensor_per: Annotated[
        str, Option("How long a sensor's errors stay the same; touch.", "touch|run")
    ] = ""
    policy: Annotated[
        str,
        Option(
            "next: where a touch is not answered, touch where the answer proposes, up to three "
            "times, read as one belief; one.",
            "one|next",
        ),
    ] = ""
    study: Annotated[
        int | None,
        Option(
            "Touches of each reader in the picture of error against run time: 200, about a "
            "minute of CPU; none where --touches is less. 0: none.",
            least=0,
        ),
    ] = None
    limits: Annotated[
        int | None,
        Option(
            "Touches of each class (face, edge, corner, light) for what a touch can say at best: "
            "bits, places it can name, least error; 100 take half a minute of CPU. 0: none.",
            least=0,
        ),
    ] = None
    shard: Annotated[
        int | None,
        Option("Touches in a file, and lost at most when interrupted; 1000.", least=1),
    ] = None
    seed: Annotated[int | None, Option("Of all that is drawn; 1.", least=0)] = None
    jobs: Annotated[int, Option("Processes on this machine.", names=("-j", "--jobs"), least=1)] = 1
    cluster: Annotated[
        str, Option("A dask scheduler whose workers do the work.", "tcp://HOST:PORT")
    ] = ""
    export: Annotated[
        str,
        Option(
            "Write the touches with their truth too, for training: DIR/dataset.npz or "
            "DIR/lerobot. With --resume also of a run that is done.",
            "npz|lerobot",
        ),
    ] = ""
    resume: Annotated[bool, Option("Go on with the run in DIR.")] = False


@command(app, help=HELP, epilog=EPILOG, version_of=NAME)
def touch_set(
    options: SetOptions,
    fail_under: Annotated[
        float | None,
        Option("Exit code 1 if a touch is answered wrong, or fewer of those that show enough "
               "symbols are answered right.", "PERCENT", least=0.0, most=100.0),
    ] = None,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Touch a set; `HELP` is what people see."""
    from recognizer.validation.pipeline import validate
    from recognizer.validation.run import TouchProgress

    given = vars(options) | {"specs": options.specs or (), "prints": options.prints or ""}
    with progress_bar("making the set") as bar:
        result = validate(**given, progress=TouchProgress(bar))
    _report(result, as_json=as_json)
    return result.exit_code(fail_under)


Page = Annotated[Path | None, Option("Page to write.", "FILE.html", names=("-o", "--output"))]


@command(tools)
def compare(
    first: Annotated[Path, Argument("Folder of a run.", "A")],
    second: Annotated[Path, Argument("Folder of another run.", "B")],
    output: Page = None,
    as_json: Json = False,
) -> int:
    """Show two runs side by side: what became better, worse, or is the same within chance."""
    from recognizer.validation.compare import compare_runs

    found = compare_runs(first, second, output)
    return _show(found, _print_comparison, output, as_json=as_json)


@command(tools)
def worlds(
    folders: Annotated[list[Path], Argument("Folders of runs.", "DIR...")],
    output: Annotated[
        Path | None,
        Option("Page to write; JSON goes beside it, as FILE.json.", "FILE.html",
               names=("-o", "--output")),
    ] = None,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Show runs of different worlds on one page: engines, surfaces, sensors."""
    from recognizer.validation.compare import join_runs

    return _show(join_runs(folders, output), _print_worlds, output, as_json=as_json)


@command(tools)
def repeat(
    folder: Annotated[Path, Argument("Folder of a run.", "DIR")],
    number: Annotated[int, Argument("Number of the touch.", least=0)],
    plot: Annotated[
        Path | None, Option("Pictures of each stage: .png, .svg or .pdf.", "FILE.png")
    ] = None,
    as_json: Json = False,
) -> int:
    """Do one touch again: surface, counts, fitted symbols, answer and truth."""
    from recognizer.validation.repeat import repeat_touch

    return _show(repeat_touch(folder, number, plot), _print_row, plot, as_json=as_json)


@command(tools)
def report(
    folder: Annotated[Path, Argument("Folder of a run that is done.", "DIR")],
    as_json: Json = False,
) -> int:
    """Write results and report anew from the touches that are there."""
    from recognizer.validation.pipeline import report_again

    _report(report_again(folder), as_json=as_json)
    return console.DONE


@command(tools)
def benchmark(
    touches: Annotated[int, Option("Touches of each half.", least=1)] = 2000,
    folder: Annotated[
        Path, Option("Folder of touches, cards and tables.", "DIR", names=("-o", "--output"))
    ] = Path("benchmark"),
    seed: Annotated[int | None, Option("Of the hidden half; drawn if left out.", least=0)] = None,
    worlds: Annotated[
        str, Option("Worlds, as fsr-16,gel-24x32; all, MuJoCo's among them.", "LIST")
    ] = "",
    reader: Annotated[
        str,
        Option(
            "Readers: ours, thesis, template, network, chance, or one of your own as "
            "module:function (docs/benchmark.md); all five.",
            "LIST",
        ),
    ] = "",
    as_json: Json = False,
) -> int:
    """Make frozen touches with truth, public and hidden, and compare readers on them."""
    from recognizer.validation.benchmark import run_benchmark, table_of
    from recognizer.validation.run import TouchProgress

    named = [[one.strip() for one in text.split(",") if one.strip()] for text in (worlds, reader)]
    with progress_bar("making the set") as bar:
        found = run_benchmark(folder, touches=touches, worlds=named[0], seed=seed,
                              readers=named[1], progress=TouchProgress(bar))  # fmt: skip
    if as_json:
        output.write_json(found)
    else:
        other = ", ".join(name for name, alike in found["frozen"].items() if not alike)
        output.write(table_of(found))
        output.write(f"public half: {f'differs in {other}' if other else 'as frozen'}; "
                     f"seed of the hidden half {found['seeds']['hidden']}\n"
                     f"next: open {folder / 'results.md'}")  # fmt: skip
    return console.DONE


def _report(result: ValidationResult, *, as_json: bool) -> None:
    if as_json:
        output.write_json(result.as_json())
    else:
        output.write(f"{result}\nnext: open {result.folder / 'report.html'}")


def _show(
    found: dict[str, Any],
    show: Callable[[dict[str, Any]], None],
    page: Path | None,
    *,
    as_json: bool,
) -> int:
    """Print what was found, as JSON or as people read it, and the page to look at now."""
    if as_json:
        output.write_json(found)
    else:
        show(found)
        if page:
            output.write(f"next: open {page}")
    return console.DONE


def _print_comparison(found: dict[str, Any]) -> None:
    wide = max(len(line["name"]) for line in found["lines"])
    output.write(f"{'':{wide}}  {'A':>12}  {'B':>12}")
    for line in found["lines"]:
        a, b = (("-" if v is None else f"{v:.6g}") for v in (line["a"], line["b"]))
        output.write(f"{line['name']:{wide}}  {a:>12}  {b:>12}  {line['word']}")


def _print_worlds(found: dict[str, Any]) -> None:
    names = [f"{w['run']}: {w['engine']}, {w['surface']}, {w['sensor']}" for w in found["worlds"]]
    wide = max(map(len, names), default=0)
    heads = ("touches", "right", "wrong", "refused", "mm rms", "deg rms", "inside", "err2/var")
    output.write(f"{'':{wide}}" + "".join(f"{head:>9}" for head in heads))
    for name, line in zip(names, found["worlds"], strict=True):
        cells = [f"{line[key]:,}" for key in ("touches", "right", "wrong", "rejected")]
        inside, normalised = line["inside_95"]["share"], line["normalised"]["mean"]
        values = ((line["rms_mm"], ".3f"), (line["rms_deg"], ".3f"),
                  (inside, ".1%"), (normalised, ".2f"))  # fmt: skip
        cells += ["-" if value is None else f"{value:{digits}}" for value, digits in values]
        output.write(f"{name:{wide}}" + "".join(f"{cell:>9}" for cell in cells))


def _print_row(row: dict[str, Any]) -> None:
    output.pairs({name: "-" if value is None else str(value) for name, value in row.items()})


if __name__ == "__main__":
    main()
