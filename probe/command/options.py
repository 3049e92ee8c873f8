"""The options of `probe-sensor`, each declared once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Argument, Json, Option, Options, Replace

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


@dataclass(frozen=True)
class LiveOptions(Options):
    """The options of the live view."""

    url: Url
    sensor: SelectedSensor = None
    sensor_type: Typed = ""
    calibration: Calibrated = None
    folder: Annotated[Path, Option("Where images and recordings are saved.", "DIR")] = Path()
    seconds: Annotated[float | None, Option("End after so long.", least=0.1)] = None
    as_json: Annotated[
        bool, Option("One JSON object a second, each on a line.", names=("--json",))
    ] = False


@dataclass(frozen=True)
class RecordOptions(Options):
    """The port that is recorded, and for how long."""

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


@dataclass(frozen=True)
class ExportOptions(Options):
    """Which files are written of a recording, and how."""

    recording: Recording
    output: Annotated[
        File, Option("One of the files below, by its ending.", "OUT", names=("-o", "--output"))
    ] = None
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
        if (out := self.output) is not None and out.suffix not in (".csv", ".npy", ".png", ".mcap"):
            raise UsageError(f"-o {out}: end it in .csv, .npy, .png or .mcap")
        if out is None and {self.csv, self.npy, self.png, self.mcap} == {None}:
            raise UsageError("nothing to write: give -o, --csv, --npy, --png or --mcap")
        if self.calibration is not None and (self.csv is not None or self.mcap is not None):
            raise UsageError("--csv and --mcap hold counts; --calibration is for --npy and --png")
        if self.deblur is not None and self.calibration is None:
            raise UsageError("--deblur needs newtons: give --calibration")


@dataclass(frozen=True)
class LoadsOptions(Options):
    """Which recordings show which loads, and where their calibration goes."""

    given: Annotated[
        list[str],
        Argument("Recordings of steady loads, even over the sensor, with the whole force; 0 is "
                 "the unloaded one. Or a table with columns recording, newtons and, for a load "
                 "on a part of the sensor, footprint: a file of shares, a line a row.",
                 "REC=NEWTONS...|LIST.csv"),
    ]  # fmt: skip
    output: Output
    board: Board = "none"
    sensor: Annotated[
        str, Option("Name of the sensor, where the recordings do not tell.", "NAME")
    ] = ""
    sensor_type: Typed = ""
    made: Made = ""
    replace: Replace = False
    as_json: Json = False


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


@dataclass(frozen=True)
class SimulateOptions(Options):
    """The touches that are simulated, and the files written of them."""

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
        float | None, Option("Tilt about the sensor's x, degrees; 0, or up to 2 with --touches.")
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
