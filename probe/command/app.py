"""The commands of `probe-sensor` under one head."""

from __future__ import annotations

import typer

from probe.command import calibrate, devices, files, live, record, replay, simulate
from probe.command.options import Json

HELP = """Read, record, calibrate and simulate a 16x16 force sensor.

Try it without one: [bold]probe-sensor live sim:[/]
"""
EPILOG = """Exit codes: 0 done, 1 ran but failed, 2 bad input, 3 device, 4 database, 130 \
interrupted.
"""

app = typer.Typer(
    help=HELP,
    epilog=EPILOG,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command(name="list")(devices.list_)
app.command()(devices.info)
app.command()(live.live)
app.command()(record.record)
app.command()(replay.replay)
app.command()(files.export)
app.command(name="import")(files.import_)
app.command()(files.repair)
app.add_typer(calibrate.app, name="calibrate")
app.command()(simulate.simulate)


@app.callback(invoke_without_command=True)
def _head(
    version: bool = typer.Option(False, "--version", help="Say which version this is."),
    as_json: Json = False,
) -> None:
    from probe.command import report

    if version:
        report.version(as_json=as_json)
        raise typer.Exit


def command_of(arguments: list[str]) -> str:
    """Return how the command that was meant is called, for messages."""
    names = {command.name or getattr(command.callback, "__name__", "")
             for command in app.registered_commands}  # fmt: skip
    words = ["probe-sensor"]
    if arguments[:1] and arguments[0] in names:
        words.append(arguments[0])
    elif arguments[:1] == ["calibrate"]:
        steps = {command.name or getattr(command.callback, "__name__", "")
                 for command in calibrate.app.registered_commands}  # fmt: skip
        words += [word for word in arguments[:2] if word == "calibrate" or word in steps]
    return " ".join(words)
