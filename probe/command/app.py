"""The commands of `probe-sensor` and their options, each declared once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from encoded_objects.base.console import application
from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Argument, Json, Option, Options, Replace, command
from probe.command import NAME

HELP = """Read, record, calibrate and simulate a tactile sensor.

Try it without one: [bold]probe-sensor live sim:[/]
"""
EPILOG = """Exit codes: 0 done, 1 ran but failed, 2 bad input, 3 device, 4 database, 130 \
interrupted.
"""
URLS = (
    "serial:///dev/ttyACM0?baud=1000000, flexitac:///dev/ttyUSB0, sim:, sim:lab.db#Cube/F1, "
    "file:touch.h5"
)

Url = Annotated[str, Argument(f"A port: {URLS}.", "URL")]
Recording = Annotated[Path, Argument("A recording.", "FILE")]
Output = Annotated[Path, Option("The file to write.", "FILE", names=("-o", "--output"))]
File = Path | None
Calibrated = Annotated[
    File, Option("The sensor's calibration: readings in newtons.", "FILE", names=("--calibration",))
]
SelectedSensor = Annotated[
    int | None,
    Option("Which of the probe's sensors; the one it has selected by default.", "0...7",
           names=("--sensor",), least=0, most=7),
]  # fmt: skip
Typed = Annotated[
    str,
    Option("Type of the sensor: a name that probe-sensor types lists, or a file; as "
           "recording or port tell, fsr-16 by default.", "NAME|FILE"),
]  # fmt: skip
Board = Annotated[
    str,
    Option("The electronics, as readout=floating,load_ohm=10000,reference_v=5; simulated: that "
           "of simulate; none: counts above the bias are taken for conductance, which is right "
           "where tactels do not disturb each other.", "NAME=VALUE,..."),
]  # fmt: skip
Place = Annotated[
    float | None,
    Option("Place of the sensor's centre, mm; the middle, or anywhere with --touches."),
]
Made = Annotated[str, Option("When the loads were read, ISO 8601; now by default.", "TIME")]

app = application(help=HELP, epilog=EPILOG)
calibrate = application(
    help="Find out what a sensor's counts mean: bias, unsound tactels, force law of each."
)


@app.callback(invoke_without_command=True)
def _head(
    version: bool = typer.Option(False, "--version", help="Say which version this is."),
    as_json: bool = typer.Option(
        False, "--json", help="One JSON object on stdout, also for errors."
    ),
) -> None:
    from encoded_objects.base import output

    if version:
        output.version(NAME, as_json=as_json)
        raise typer.Exit


@command(app, "list")
def list_ports(as_json: Json = False) -> int:
    """Print the ports that are there, which of them may be a probe, and URLs that always work."""
    from probe.command.listed import list_ports

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
    from probe.command.listed import list_types

    return list_types(name, schema=schema, as_json=as_json)


@dataclass(frozen=True)
class LiveOptions(Options):
    """What the live view shows."""

    url: Url
    sensor: SelectedSensor = None
    sensor_type: Typed = ""
    calibration: Calibrated = None
    folder: Annotated[Path, Option("Where images and recordings are saved.", "DIR")] = Path()
    seconds: Annotated[float | None, Option("End after so long.", least=0.1)] = None
    as_json: Annotated[
        bool, Option("One JSON object a second, each on a line.", names=("--json",))
    ] = False


@command(app)
def live(options: LiveOptions) -> int:
    """Watch a probe: heat map, rate, losses; save images, record."""
    from probe.command.live import watch

    return watch(options)


@dataclass(frozen=True)
class RecordOptions(Options):
    """What is recorded, and for how long."""

    url: Url
    output: Output
    seconds: Annotated[float | None, Option("End after so long; Ctrl-C by default.", least=0.0)] = (
        None
    )
    frames: Annotated[int | None, Option("End after so many frames.", least=1)] = None
    sensor: SelectedSensor = None
    bits: Annotated[int | None, Option("Width of a reading; 8 is faster.", "8|10")] = None
    sensor_type: Typed = ""
    calibration: Calibrated = None
    replace: Replace = False
    as_json: Json = False


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


@dataclass(frozen=True)
class ExportOptions(Options):
    """Which files are written of a recording, and how."""

    recording: Recording
    csv: Annotated[File, Option("A table: seq, t_ns, readings, wrist, pose; counts.", "OUT")] = None
    npy: Annotated[File, Option("The images as a NumPy array (N, rows, columns).", "OUT")] = None
    png: Annotated[File, Option("One image as heat map and as surface, see --frame.", "OUT")] = None
    mcap: Annotated[
        File, Option("ROS 2 messages, whole: images, poses, wrist (docs/robot.md).", "OUT")
    ] = None
    frame: Annotated[int, Option("Which image --png shows, from 0.", least=0)] = 0
    median: Annotated[bool, Option("--png: median of each 3x3 neighbourhood.")] = False
    azimuth: Annotated[float, Option("--png: from where the surface is seen, degrees.")] = -60.0
    elevation: Annotated[float, Option("--png: and from how high, degrees.")] = 40.0
    sensor_type: Typed = ""
    calibration: Calibrated = None
    deblur: Annotated[
        float | None,
        Option("Thickness of the pad whose blur is taken back; with --calibration.", "MM",
               least=0.1),
    ] = None  # fmt: skip
    live: Annotated[bool, Option("Also a recording that is still being written.")] = False
    replace: Replace = False
    as_json: Json = False

    def check(self) -> None:
        """Refuse options that exclude each other."""
        if self.csv is None and self.npy is None and self.png is None and self.mcap is None:
            raise UsageError("nothing to write: give --csv, --npy, --png or --mcap")
        if self.calibration is not None and (self.csv is not None or self.mcap is not None):
            raise UsageError("--csv and --mcap hold counts; --calibration is for --npy and --png")
        if self.deblur is not None and self.calibration is None:
            raise UsageError("--deblur needs newtons: give --calibration")


@command(app)
def export(options: ExportOptions) -> int:
    """Write a recording as a table, an array, ROS 2 messages, or an image of it as a picture."""
    from probe.command.exported import export_files

    return export_files(options)


@command(app, "import")
def import_(
    array: Annotated[
        Path,
        Argument(".npy, .npz, .mat or HDF5 with images (N, rows, columns), .csv with an image a "
                 "line, a folder of grey pictures, or .mcap with sensor_msgs/Image.", "FILE"),
    ],
    output: Output,
    dataset: Annotated[str | None, Option("Which array, where there are several.", "NAME")] = None,
    rate: Annotated[float, Option("Frames a second: an array tells no time.")] = 220.0,
    sensor: Annotated[str, Option("Name of the sensor.")] = "",
    sensor_type: Typed = "",
    replace: Replace = False,
    as_json: Json = False,
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
    from probe.command.exported import report_import

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
        write(f"{done.path}: {count_of(done.frames, 'frame')} saved, {done.lost} lost")
    return 0


app.add_typer(calibrate, name="calibrate")


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
def loads(
    given: Annotated[
        list[str],
        Argument("Recordings of steady loads, even over the sensor, with the whole force; 0 is "
                 "the unloaded one. Or a table with columns recording, newtons and, for a load "
                 "on a part of the sensor, footprint: a file of shares, a line a row.",
                 "REC=NEWTONS...|LIST.csv"),
    ],
    output: Output,
    board: Board = "none",
    sensor: Annotated[
        str, Option("Name of the sensor, where the recordings do not tell.", "NAME")
    ] = "",
    sensor_type: Typed = "",
    made: Made = "",
    replace: Replace = False,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Fit the force law of every tactel to recorded loads, and write the calibration."""
    from probe.command.calibrated import LawOptions, board_from, calibrate_loads
    from probe.command.loads import loads_given

    how = LawOptions(output, board_from(board), sensor_type, made, replace, as_json)
    return calibrate_loads(loads_given(given), how, sensor)


@dataclass(frozen=True)
class GuideOptions(Options):
    """Which loads a guided calibration asks for."""

    url: Url
    output: Output
    newtons: Annotated[
        str, Option("Loads to put on, N in all, even over the sensor, with commas between.", "LIST")
    ] = "20,60,150,400"
    folder: Annotated[
        File,
        Option("Where the recordings of the loads go; beside the calibration by default.", "DIR"),
    ] = None
    seconds: Annotated[float, Option("How long each load is read.", least=0.2)] = 3.0
    sensor: SelectedSensor = None
    sensor_type: Typed = ""
    board: Board = "none"
    made: Made = ""
    replace: Replace = False
    as_json: Json = False

    @property
    def forces_n(self) -> list[float]:
        """The loads, N."""
        return [float(part) for part in self.newtons.split(",")]

    def check(self) -> None:
        """Refuse loads that are no numbers."""
        try:
            self.forces_n  # noqa: B018
        except ValueError:
            raise UsageError(f"--newtons {self.newtons}: give numbers, as 20,60,180") from None


@command(calibrate)
def port(options: GuideOptions) -> int:
    """Calibrate a probe step by step: says what to put on, reads it, and fits."""
    from probe.command.guided import guide_loads

    return guide_loads(options)


@dataclass(frozen=True)
class SimulateOptions(Options):
    """Which touches are simulated, and what is written of them."""

    target: Annotated[str, Argument("What is touched.", "TARGET")]
    x: Place = None
    y: Place = None
    theta: Annotated[
        float | None, Option("Turn of the sensor, degrees; 0, or any with --touches.")
    ] = None
    force: Annotated[
        float | None,
        Option(
            "Force, N; 80, or 20 ... 120 with --touches, on fsr-16; on another type as hard.",
            least=0.0,
        ),
    ] = None
    tilt_x: Annotated[
        float | None,
        Option("Tilt about the sensor's x, degrees; 0, or up to 2 with --touches."),
    ] = None
    tilt_y: Annotated[float | None, Option("The same about y.")] = None
    sensor_type: Typed = ""
    overlay: Annotated[
        str, Option("Elastic overlay; that of the sensor type.", choices=("tab", "pad"))
    ] = ""
    accuracy: Annotated[
        str,
        Option(
            "auto, a level of the contact model (footprint, tabs, layer), or the largest "
            "error, as 0.01."
        ),
    ] = "auto"
    noise: Annotated[str, Option("Noise of contacts and board.", choices=("typical", "quiet"))] = (
        "typical"
    )
    touches: Annotated[
        int | None,
        Option(
            "So many touches at random; what is given is kept. With --scan: so many of its "
            "way, all by default.",
            least=1,
        ),
    ] = None
    scan: Annotated[
        str | None,
        Option(
            "Touches side by side on a way over the face, with the pose of each: as it is, or "
            "as an arm with play believes.",
            choices=("raster", "kinesthetic"),
        ),
    ] = None
    frames: Annotated[int, Option("Frames of each touch, 220 a second.", least=1)] = 1
    seed: Annotated[int, Option("Of places and noise.", least=0)] = 0
    output: Annotated[File, Option("Recording to write.", "FILE.h5", names=("-o", "--output"))] = (
        None
    )
    png: Annotated[File, Option("Picture of the first touch: surface and image.", "FILE")] = None
    truth: Annotated[
        File, Option("JSON file of where every touch was; it is nowhere else.", "FILE")
    ] = None
    replace: Replace = False
    as_json: Json = False  # fmt: skip


@command(app)
def simulate(options: SimulateOptions) -> int:
    """Touch a part in simulation: a recording as the probe would give it, and a picture."""
    from probe.command.simulated import simulate_touches

    return simulate_touches(options)
