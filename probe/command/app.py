"""The commands of `probe-sensor`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Application, Argument, Json, Option, Replace, command
from probe.command import NAME
from probe.command.options import (
    URLS,
    Calibrated,
    ExportOptions,
    GuideOptions,
    LiveOptions,
    LoadsOptions,
    Output,
    Recording,
    RecordOptions,
    SelectedSensor,
    SimulateOptions,
    Typed,
)

HELP = """Read, record, calibrate and simulate a tactile sensor.

Try it without one: [bold]probe-sensor live sim:[/]
"""
EPILOG = """Exit codes: 0 done, 1 ran but failed, 2 bad input, 3 device, 4 database, 130 \
interrupted.
"""
app = Application(help=HELP, epilog=EPILOG, version_of=NAME)
calibrate = Application(
    help="Find out what a sensor's counts mean: bias, unsound tactels, force law of each."
)


@command(app, "list")
def list_ports(as_json: Json = False) -> int:
    """Print the ports that are there, which of them may be a probe, and URLs that always work."""
    from probe.command.described import list_ports

    return list_ports(as_json=as_json)


@command(app)
def info(
    what: Annotated[str, Argument(f"A port ({URLS}), a recording, or a calibration.", "URL|FILE")],
    sensor: SelectedSensor = None,
    sensor_type: Typed = "",
    seconds: Annotated[float, Option("How long to listen to a probe.", least=0.1)] = 1.0,
    as_json: Json = False,
) -> int:
    """Say what a probe is and how well it comes through, or what a file holds."""
    from probe.command.described import describe

    return describe(what, sensor, seconds, sensor_type, as_json=as_json)


@command(app)
def types(
    name: Annotated[
        str, Argument("A shipped type, or a file: checked, and shown as YAML.", "NAME|FILE")
    ] = "",
    schema: Annotated[bool, Option("The JSON schema of a file of a sensor type.")] = False,
    as_json: Json = False,
) -> int:
    """List the sensor types, show one as YAML to start from, or check a file."""
    from probe.command.described import list_types

    return list_types(name, schema=schema, as_json=as_json)


@command(app)
def live(options: LiveOptions) -> int:
    """Watch a probe: heat map, rate, losses; save images, record."""
    from probe.command.live import watch

    return watch(options)


@command(app)
def record(options: RecordOptions) -> int:
    """Record a probe until Ctrl-C, or as long as asked; the file is complete however it ends."""
    from probe.command.recorded import record_port

    return record_port(options)


@command(app)
def replay(
    recording: Recording,
    speed: Annotated[float, Option("1: as it came; 0: as fast as it is read.", least=0.0)] = 1.0,
    loop: Annotated[bool, Option("Again and again, until Ctrl-C.")] = False,
    sensor_type: Typed = "",
    calibration: Calibrated = None,
    as_json: Annotated[
        bool, Option("One JSON object a frame, each on a line.", names=("--json",))
    ] = False,
) -> int:
    """Play a recording: on a terminal as `live`, into a pipe as lines of CSV or JSON."""
    import sys

    from probe.recording.read import Recording

    Recording(recording).sensor_type(sensor_type)  # refuses a wrong file under its own name
    url = f"file:{recording}?speed={speed:g}" + ("&loop=1" if loop else "")
    if sys.stdout.isatty() and not as_json:
        from probe.command.live import watch

        return watch(LiveOptions(url, sensor_type=sensor_type, calibration=calibration))
    if calibration is not None:
        raise UsageError("frames are piped as counts; --calibration is for a terminal")
    from probe.command.recorded import pipe_frames

    return pipe_frames(url, as_json=as_json)


@command(app)
def export(options: ExportOptions) -> int:
    """Write a recording as a table, an array, ROS 2 messages, or an image of it as a picture."""
    from probe.command.recorded import export_files

    return export_files(options)


@command(app, "import")
def import_(
    array: Annotated[
        Path,
        Argument(".npy, .npz, .mat or HDF5 with images (N, rows, columns), .csv with an image a "
                 "line, a folder of grey pictures or a Zarr store (FTP-1), or .mcap with "
                 "sensor_msgs/Image.", "FILE"),
    ],
    output: Output,
    dataset: Annotated[str | None, Option("Which array, where there are several.", "NAME")] = None,
    rate: Annotated[float, Option("Frames a second: an array tells no time.")] = 220.0,
    sensor: Annotated[str, Option("Name of the sensor.")] = "",
    sensor_type: Typed = "",
    replace: Replace = False,
    as_json: Json = False
) -> int:  # fmt: skip
    """Make a recording of others' images; values that are no counts are scaled."""
    from probe.command.recorded import check_output
    from probe.recording.imported import import_array

    check_output(output, replace=replace)
    if array.suffix.lower() == ".mcap":
        from probe.recording.mcap import import_mcap

        made = import_mcap(array, output, sensor_type=sensor_type, replace=replace)
    else:
        made = import_array(array, output, dataset=dataset, rate_hz=rate, sensor=sensor,
                            sensor_type=sensor_type, replace=replace)  # fmt: skip
    from probe.command.recorded import report_import

    return report_import(made, array, as_json=as_json)


@command(app)
def repair(recording: Recording, as_json: Json = False) -> int:
    """Make a recording readable whose writer was killed, or that is damaged or cut short."""
    from dataclasses import asdict

    from encoded_objects.base.output import count_of, write, write_json
    from probe.recording.repair import repair as repaired

    done = repaired(recording)
    if as_json:
        write_json(asdict(done))
    elif not done.changed:
        write(f"{done.path} is whole; {count_of(done.frames, 'frame')}")
    else:
        short = ", ".join(f"/{name}" for name in done.continued)
        write(
            f"{done.path}: {count_of(done.frames, 'frame')} saved, {done.lost} lost"
            + (f"; continued to the last image: {short}" if short else "")
            + (f"; the old file is {done.kept}" if done.kept else "")
        )
    return 0


app.groups["calibrate"] = calibrate


@command(calibrate)
def bias(
    source: Annotated[
        str, Argument(f"An unloaded sensor: a port ({URLS}) or a recording.", "URL|FILE")
    ],
    sensor: SelectedSensor = None,
    seconds: Annotated[float, Option("How long to read a port.", least=0.2)] = 2.0,
    sensor_type: Typed = "",
    calibration: Calibrated = None,
    as_json: Json = False,
) -> int:
    """Read an unloaded sensor: bias, noise, raised tactels; with --calibration also its drift.

    Exit code 1 if the calibration does not hold any more.
    """
    from probe.command.calibrated import report_bias

    return report_bias(source, sensor, seconds, calibration, sensor_type, as_json=as_json)


@command(calibrate)
def loads(options: LoadsOptions) -> int:
    """Fit the force law of every tactel to recorded loads, and write the calibration."""
    from probe.command.calibrated import calibrate_loads, loads_given

    return calibrate_loads(loads_given(options.given), options, options.sensor)


@command(calibrate)
def port(options: GuideOptions) -> int:
    """Calibrate a probe step by step: says what to put on, reads it, and fits."""
    from probe.command.calibrated import guide_loads

    return guide_loads(options)


@command(
    app,
    instead={"--database": "name a registered part in TARGET: lab.db#Roof/F3, or part.stl@lab.db"},
)
def simulate(options: SimulateOptions) -> int:
    """Touch a part in simulation: a recording as the probe would give it, and a picture."""
    from probe.command.simulated import simulate_touches

    return simulate_touches(options)
