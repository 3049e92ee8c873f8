"""`probe-sensor calibrate bias | loads | port`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from encoded_objects.base.console import Action, application
from probe.command.options import (
    URLS,
    Calibrated,
    Json,
    Output,
    Replace,
    SelectedSensor,
    Typed,
    Url,
)

BOARD = "none"

app = application(
    help="Find out what a sensor's counts mean: bias, unsound tactels, force law of each."
)

Board = Annotated[
    str,
    typer.Option(metavar="NAME=VALUE,...",
                 help="The electronics, as readout=floating,load_ohm=10000,reference_v=5; "
                      "simulated: that of simulate; none: counts above the bias are taken for "
                      "conductance, which is right where tactels do not disturb each other."),
]  # fmt: skip
Made = Annotated[
    str, typer.Option(metavar="TIME", show_default=False,
                      help="When the loads were read, ISO 8601; now by default."),
]  # fmt: skip
SensorName = Annotated[
    str, typer.Option("--sensor", metavar="NAME", show_default=False,
                      help="Name of the sensor, where the recordings do not tell."),
]  # fmt: skip


@app.command()
def bias(
    source: Annotated[
        str, typer.Argument(metavar="URL|FILE", show_default=False,
                            help=f"An unloaded sensor: a port ({URLS}) or a recording."),
    ],
    sensor: SelectedSensor = None,
    seconds: Annotated[float, typer.Option(min=0.2, help="How long to read a port.")] = 2.0,
    sensor_type: Typed = "",
    calibration: Calibrated = None,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Read an unloaded sensor: bias, noise, raised tactels; with --calibration also its drift.

    Exit code 1 if the calibration does not hold any more.
    """

    def action() -> int:
        from probe.command.calibrated import report_bias

        return report_bias(source, sensor, seconds, calibration, sensor_type=sensor_type,
                           as_json=as_json)  # fmt: skip

    return action


@app.command()
def loads(
    given: Annotated[
        list[str], typer.Argument(metavar="REC=NEWTONS...|LIST.csv", show_default=False,
                                  help="Recordings of steady loads, even over the sensor, with "
                                       "the whole force; 0 is the unloaded one. Or a table with "
                                       "columns recording, newtons and, for a load on a part of "
                                       "the sensor, footprint: a file of shares, a line a row."),
    ],
    output: Output,
    board: Board = BOARD,
    sensor: SensorName = "",
    sensor_type: Typed = "",
    made: Made = "",
    replace: Replace = False,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Fit the force law of every tactel to recorded loads, and write the calibration."""

    def action() -> int:
        from probe.command.calibrated import board_from, calibrate_loads
        from probe.command.loads import loads_given

        listed = loads_given(given)
        return calibrate_loads(
            listed, output, board_from(board), sensor=sensor, sensor_type=sensor_type,
            made=made, replace=replace, as_json=as_json,
        )  # fmt: skip

    return action


@app.command()
def port(
    url: Url,
    output: Output,
    newtons: Annotated[
        str, typer.Option(metavar="LIST", help="Loads to put on, N in all, even over the "
                                               "sensor, with commas between."),
    ] = "20,60,150,400",
    folder: Annotated[
        Path | None, typer.Option(metavar="DIR", show_default=False,
                                  help="Where the recordings of the loads go; beside the "
                                       "calibration by default."),
    ] = None,
    seconds: Annotated[float, typer.Option(min=0.2, help="How long each load is read.")] = 3.0,
    select: SelectedSensor = None,
    sensor_type: Typed = "",
    board: Board = BOARD,
    made: Made = "",
    replace: Replace = False,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Calibrate a probe step by step: says what to put on, reads it, and fits."""

    def action() -> int:
        from probe.command.calibrated import board_from
        from probe.command.guided import guide

        try:
            forces = [float(part) for part in newtons.split(",")]
        except ValueError:
            raise typer.BadParameter(f"--newtons {newtons}: give numbers, as 20,60,180") from None
        return guide(
            url, output, forces, folder or output.with_suffix(""), seconds, select,
            board_from(board), sensor_type=sensor_type, made=made, replace=replace, as_json=as_json,
        )  # fmt: skip

    return action
