"""The options of `recognize-object`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

HELP = """Say which object was touched, which face, where, and how sure.

RECORDING is any HDF5 file with /frames (N, rows, columns). Try it without a probe: \
[bold]probe-sensor simulate lab.db#Cube/F1 -o touch.h5[/], then \
[bold]recognize-object touch.h5[/]. How a part came out of the printer: \
[bold]recognize-object as-built --help[/].
"""
EPILOG = """Exit codes: 0 recognised, 1 nothing recognised, 2 bad input, 3 device, 4 database, \
130 interrupted.
"""
URLS = "serial:///dev/ttyACM0?baud=1000000, sim:lab.db#Cube/F1, file:touch.h5"

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command(help=HELP, epilog=EPILOG)
def recognize(
    recording: Annotated[
        Path | None, typer.Argument(metavar="RECORDING", show_default=False,
                                    help="A recording; or give --port."),
    ] = None,
    port: Annotated[
        str, typer.Option(metavar="URL", show_default=False, help=f"Read a port: {URLS}."),
    ] = "",
    database: Annotated[
        str, typer.Option(metavar="URL", help="The lab's database."),
    ] = "lab.db",
    follow: Annotated[
        bool, typer.Option("--follow", help="Keep reading the port, until Ctrl-C; without it "
                                            "the next touch is read."),
    ] = False,
    every: Annotated[
        bool, typer.Option("--every", help="Every frame by itself, not every touch."),
    ] = False,
    scan: Annotated[
        bool, typer.Option("--scan", help="All touches together, of one face: for symbols too "
                                          "large for one touch (profiles thesis, product), worn "
                                          "parts, edges. A port is read until they answer."),
    ] = False,
    method: Annotated[
        str, typer.Option(metavar="joint|thesis", help="How a scan is read: the joint fit, or as "
                                                       "the thesis has it."),
    ] = "joint",
    most: Annotated[
        int | None, typer.Option("--touches", metavar="N", min=1, show_default=False,
                                 help="End after so many touches."),
    ] = None,
    sensor_type: Annotated[
        str, typer.Option("--sensor-type", metavar="NAME|FILE", show_default=False,
                          help="Type of the sensor: a name that probe-sensor types lists, or a "
                               "file; as recording or port tells, fsr-16 by default."),
    ] = "",
    overlay: Annotated[
        str, typer.Option(metavar="tab|pad", show_default=False,
                          help="Elastic overlay; as recording or port tell, that of the type by "
                               "default."),
    ] = "",
    calibration: Annotated[
        Path | None, typer.Option(metavar="FILE", show_default=False,
                                  help="The sensor's calibration; the one that the recording "
                                       "names is found beside it."),
    ] = None,
    learn: Annotated[
        Path | None, typer.Option(metavar="FILE", show_default=False,
                                  help="Learn the sensor from these touches (25 and more): "
                                       "tactels that never answer, gains, where tips stand, "
                                       "floating rows. Kept in FILE, which is read by from then "
                                       "on, and goes on learning."),
    ] = None,
    flip: Annotated[
        str, typer.Option(metavar="LIST", show_default=False,
                          help="How the image arrives: columns, rows, transpose, quarter, "
                               "column-halves, row-halves, values (readings fall with force); "
                               "refusals and [bold]recognize-object check[/] say it."),
    ] = "",
    state: Annotated[
        Path | None, typer.Option("--sensor-state", metavar="FILE", show_default=False,
                                  help="Read by what was learned of the sensor."),
    ] = None,
    sensor: Annotated[
        int | None, typer.Option(metavar="0...7", min=0, max=7, show_default=False,
                                 help="Which of the probe's sensors to read at a port."),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Also a recording that is still being written."),
    ] = False,
    joints: Annotated[
        str, typer.Option(metavar="Q1,...,Q5|FILE", show_default=False,
                          help="Joint angles of the arm, degrees: with the wrist's readings they "
                               "place the object in the robot's base. A pose in the recording "
                               "does so too. Of a scan a text file, a line for each touch."),
    ] = "",
    joint_error: Annotated[
        float, typer.Option(metavar="DEGREES", min=0.0, help="Standard deviation of each."),
    ] = 0.1,
    plot: Annotated[
        Path | None, typer.Option(metavar="PNG", show_default=False,
                                  help="Draw each touch with its symbols, the window on the "
                                       "array, and the object with the probe on it. Several "
                                       "touches: PNG-SEQ; --follow: the newest."),
    ] = None,
    mcap: Annotated[
        Path | None, typer.Option(metavar="OUT", show_default=False,
                                  help="Keep images and answers as ROS 2 messages, poses with "
                                       "covariance among them (docs/robot.md)."),
    ] = None,
    publish: Annotated[
        str, typer.Option(metavar="URL", show_default=False,
                          help="Tell images and answers to whoever listens: "
                               "zenoh://0.0.0.0:7447/touch (docs/robot.md)."),
    ] = "",
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace files that are there."),
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON list on stdout; with --follow one object a "
                                          "line."),
    ] = False,
    version: Annotated[
        bool, typer.Option("--version", help="Say which version this is."),
    ] = False,
) -> Callable[[], int]:  # fmt: skip
    """Read touches; `HELP` is what people see."""
    if version:
        from encoded_objects.base import output
        from recognizer.command import NAME
        from recognizer.touch.symbols.kernels import kernels_in_use

        output.version(NAME, as_json=as_json, kernels=kernels_in_use())
        raise typer.Exit
    if (recording is None) == (not port):
        both = "both RECORDING and --port were given" if port else "nothing to read"
        raise typer.BadParameter(f"{both}; give a recording or --port URL")
    if follow and not port:
        raise typer.BadParameter("--follow needs --port; a file is played by --port file:FILE")
    if overlay not in ("", "tab", "pad"):
        raise typer.BadParameter(f"--overlay {overlay}: give tab or pad")
    if method not in ("joint", "thesis"):
        raise typer.BadParameter(f"--method {method}: give joint or thesis")
    if learn is not None and state is not None:
        raise typer.BadParameter("--learn FILE reads by that file too; leave --sensor-state out")
    by_touch = joints if joints and Path(joints).is_file() else ""
    angles = _angles("" if by_touch else joints)
    scan = scan or method == "thesis"
    if scan and angles:
        raise typer.BadParameter("--joints of a scan: give a file with a line for each touch")

    def action() -> int:
        from recognizer.command.answers import RecognizeOptions
        from recognizer.command.recognize import recognize_touches

        return recognize_touches(
            RecognizeOptions(
                recording=recording, port=port, database=database, follow=follow, every=every,
                most=most, sensor_type=sensor_type, overlay=overlay, calibration=calibration,
                sensor=sensor, live=live,
                joints_deg=angles, joint_error_deg=joint_error, plot=plot, replace=replace,
                as_json=as_json, scan=method if scan else "",
                joints_file=Path(by_touch) if by_touch else None, learn=learn, state=state,
                flip=flip, mcap=mcap, publish=publish,
            )
        )  # fmt: skip

    return action


def _angles(text: str) -> tuple[float, ...] | None:
    if not text:
        return None
    try:
        angles = tuple(float(part) for part in text.split(","))
    except ValueError:
        angles = ()
    if len(angles) != 5 or not all(abs(angle) <= 360 for angle in angles):
        raise typer.BadParameter(f"--joints {text}: give five angles in degrees, as 0,-30,60,0,0")
    return angles
