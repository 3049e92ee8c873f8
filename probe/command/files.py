"""`probe-sensor export | import | repair`: recordings to and from other formats."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from encoded_objects.base.console import Action
from probe.command.options import Calibrated, Json, Output, Recording, Replace, Typed

Target = Path | None


def export(
    recording: Recording,
    csv: Annotated[
        Target, typer.Option(metavar="OUT", show_default=False,
                             help="A table: seq, t_ns, readings, wrist, pose; counts."),
    ] = None,
    npy: Annotated[
        Target, typer.Option(metavar="OUT", show_default=False,
                             help="The images as a NumPy array (N, rows, columns)."),
    ] = None,
    png: Annotated[
        Target, typer.Option(metavar="OUT", show_default=False,
                             help="One image as heat map and as surface, see --frame."),
    ] = None,
    mcap: Annotated[
        Target, typer.Option(metavar="OUT", show_default=False,
                             help="ROS 2 messages, whole: images, poses, wrist (docs/robot.md)."),
    ] = None,
    frame: Annotated[int, typer.Option(min=0, help="Which image --png shows, from 0.")] = 0,
    median: Annotated[
        bool, typer.Option("--median", help="--png: median of each 3x3 neighbourhood."),
    ] = False,
    azimuth: Annotated[
        float, typer.Option(help="--png: from where the surface is seen, degrees."),
    ] = -60.0,
    elevation: Annotated[float, typer.Option(help="--png: and from how high, degrees.")] = 40.0,
    sensor_type: Typed = "",
    calibration: Calibrated = None,
    deblur: Annotated[
        float | None, typer.Option(metavar="MM", min=0.1, show_default=False,
                                   help="Thickness of the pad whose blur is taken back; with "
                                        "--calibration."),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Also a recording that is still being written."),
    ] = False,
    replace: Replace = False,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Write a recording as a table, an array, ROS 2 messages, or an image of it as a picture."""

    def action() -> int:
        from probe.command.exported import Outputs, PictureView, export_files

        if csv is None and npy is None and png is None and mcap is None:
            raise typer.BadParameter("nothing to write: give --csv, --npy, --png or --mcap")
        if calibration is not None and (csv is not None or mcap is not None):
            raise typer.BadParameter(
                "--csv and --mcap hold counts; --calibration is for --npy and --png"
            )
        if deblur is not None and calibration is None:
            raise typer.BadParameter("--deblur needs newtons: give --calibration")
        view = PictureView(frame, median, azimuth, elevation)
        return export_files(
            recording, Outputs(csv, npy, png, mcap), view, sensor_type=sensor_type,
            calibration=calibration,
            pad_mm=deblur, live=live, replace=replace, as_json=as_json,
        )  # fmt: skip

    return action


def import_(
    array: Annotated[
        Path, typer.Argument(metavar="FILE", show_default=False,
                             help=".npy, .npz, .mat or HDF5 with images (N, rows, columns), .csv "
                                  "with an image a line, a folder of grey pictures, or .mcap with "
                                  "sensor_msgs/Image."),
    ],
    output: Output,
    dataset: Annotated[
        str | None, typer.Option(metavar="NAME", show_default=False,
                                 help="Which array, where there are several."),
    ] = None,
    rate: Annotated[float, typer.Option(help="Frames a second: an array tells no time.")] = 220.0,
    sensor: Annotated[str, typer.Option(help="Name of the sensor.", show_default=False)] = "",
    sensor_type: Typed = "",
    replace: Replace = False,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Make a recording of others' images; values that are no counts are scaled."""

    def action() -> int:
        from encoded_objects.base.output import count_of, write, write_json
        from probe.command.recorded import check_output
        from probe.recording.imported import import_array

        check_output(output, replace=replace)
        if array.suffix.lower() == ".mcap":
            from probe.recording.mcap import import_mcap

            made = import_mcap(array, output, sensor_type=sensor_type, replace=replace)
        else:
            made = import_array(array, output, dataset=dataset, rate_hz=rate, sensor=sensor,
                                sensor_type=sensor_type, replace=replace)  # fmt: skip
        more = dict(made.origin.more)
        values = {"file": str(output), "frames": len(made), "units": made.origin.units, **more}
        if as_json:
            write_json(values)
            return 0
        scaled = f"; value = {more['scale_offset']:g} + {more['scale']:g} * count" \
            if "scale" in more else ""  # fmt: skip
        write(f"{output}: {count_of(len(made), 'frame')} of {array}{scaled}")
        return 0

    return action


def repair(recording: Recording, as_json: Json = False) -> Action:
    """Make a recording readable whose writer was killed, or that is damaged or cut short."""

    def action() -> int:
        from dataclasses import asdict

        from encoded_objects.base.output import count_of, write, write_json
        from probe.recording.repair import repair as repaired

        done = repaired(recording)
        if as_json:
            write_json(asdict(done))
        elif not done.changed:
            write(f"{done.path} is whole; {count_of(done.frames, 'frame')}")
        else:
            write(f"{done.path}: {count_of(done.frames, 'frame')} saved, {done.lost} lost")
        return 0

    return action
