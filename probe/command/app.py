"""The commands of `probe-sensor` under one head."""

from __future__ import annotations

import typer

from encoded_objects.base.console import application
from probe.command import calibrate, devices, files, live, record, replay, simulate, types
from probe.command.options import Json

HELP = """Read, record, calibrate and simulate a tactile sensor.

Try it without one: [bold]probe-sensor live sim:[/]
"""
EPILOG = """Exit codes: 0 done, 1 ran but failed, 2 bad input, 3 device, 4 database, 130 \
interrupted.
"""

app = application(help=HELP, epilog=EPILOG)
app.command(name="list")(devices.list_)
app.command()(devices.info)
app.command()(types.types)
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
    from encoded_objects.base import output
    from probe.command import NAME

    if version:
        output.version(NAME, as_json=as_json)
        raise typer.Exit
