"""The options of `recognize-object`, and those that its other commands share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated

from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Argument, Option, Options, Replace

Database = Annotated[str, Option("The lab's database.", "URL")]
Calibration = Annotated[
    Path | None,
    Option("The sensor's calibration; the one that the recording names is found beside it.",
           "FILE"),
]  # fmt: skip
URLS = "serial:///dev/ttyACM0?baud=1000000, sim:lab.db#Cube/F1, file:touch.h5"


@dataclass(frozen=True)
class RecognizeOptions(Options):
    """What is read, by what, and where answers go."""

    recording: Annotated[Path | None, Argument("A recording; or give --port.", "RECORDING")] = None
    port: Annotated[str, Option(f"Read a port: {URLS}.", "URL")] = ""
    database: Database = "lab.db"
    follow: Annotated[
        bool,
        Option("Keep reading the port, until Ctrl-C; without it the next touch is read."),
    ] = False
    every: Annotated[bool, Option("Every frame by itself, not every touch.")] = False
    scan: Annotated[
        bool,
        Option(
            "All touches together, of one face: for symbols too large for one touch (profiles "
            "thesis, product), worn parts, edges. A port is read until they answer."
        ),
    ] = False
    method: Annotated[
        str,
        Option(
            "How a scan is read: the joint fit, or as the thesis has it.",
            choices=("joint", "thesis"),
        ),
    ] = "joint"
    most: Annotated[
        int | None, Option("End after so many touches.", "N", names=("--touches",), least=1)
    ] = None
    sensor_type: Annotated[
        str,
        Option(
            "Type of the sensor: a name that probe-sensor types lists, or a file; as recording "
            "or port tells, fsr-16 by default.",
            "NAME|FILE",
        ),
    ] = ""
    overlay: Annotated[
        str,
        Option(
            "Elastic overlay; as recording or port tell, that of the type by default.",
            choices=("tab", "pad"),
        ),
    ] = ""
    calibration: Calibration = None
    learn: Annotated[
        Path | None,
        Option(
            "Learn the sensor from these touches (25 and more): tactels that never answer, "
            "gains, where tips stand, floating rows. Kept in FILE, which is read by from then "
            "on, and goes on learning.",
            "FILE",
        ),
    ] = None
    flip: Annotated[
        str,
        Option(
            "How the image arrives: columns, rows, transpose, quarter, column-halves, "
            "row-halves, values (readings fall with force); refusals and "
            "[bold]recognize-object check[/] say it.",
            "LIST",
        ),
    ] = ""
    state: Annotated[
        Path | None,
        Option("Read by what was learned of the sensor.", "FILE", names=("--sensor-state",)),
    ] = None
    as_designed: Annotated[
        bool,
        Option("Parts are as their files, in a simulator: no error of a print in the answer."),
    ] = False
    sensor: Annotated[
        int | None,
        Option("Which of the probe's sensors to read at a port.", "0...7", least=0, most=7),
    ] = None
    live: Annotated[bool, Option("Also a recording that is still being written.")] = False
    joints: Annotated[
        str,
        Option(
            "Joint angles of the arm, degrees: with the wrist's readings they place the object "
            "in the robot's base. A pose in the recording does so too. Of a scan a text file, "
            "a line for each touch.",
            "Q1,...,Q5|FILE",
        ),
    ] = ""
    joint_error: Annotated[float, Option("Standard deviation of each.", "DEGREES", least=0.0)] = 0.1
    plot: Annotated[
        Path | None,
        Option(
            "Draw each touch with its symbols, the window on the array, and the object with "
            "the probe on it. Several touches: PNG-SEQ; --follow: the newest.",
            "PNG",
        ),
    ] = None
    mcap: Annotated[
        Path | None,
        Option(
            "Keep images and answers as ROS 2 messages, poses with covariance among them "
            "(docs/robot.md).",
            "OUT",
        ),
    ] = None
    publish: Annotated[
        str,
        Option(
            "Tell images and answers to whoever listens: zenoh://127.0.0.1:7447/touch. Beyond this "
            "machine it needs --publish-users or --open (docs/robot.md).",
            "URL",
        ),
    ] = ""
    publish_users: Annotated[
        Path | None, Option("Who may listen: a line NAME:PASSWORD for each.", "FILE")
    ] = None
    open: Annotated[
        bool,
        Option("Publish to everybody who reaches the address: no password, nothing encrypted."),
    ] = False
    replace: Replace = False
    as_json: Annotated[
        bool,
        Option("One JSON list on stdout; with --follow one object a line.", names=("--json",)),
    ] = False

    def check(self) -> None:
        """Refuse options that exclude each other."""
        if (self.recording is None) == (not self.port):
            both = "both RECORDING and --port were given" if self.port else "nothing to read"
            raise UsageError(f"{both}; give a recording or --port URL")
        if self.follow and not self.port:
            raise UsageError("--follow needs --port; a file is played by --port file:FILE")
        if self.learn is not None and self.state is not None:
            raise UsageError("--learn FILE reads by that file too; leave --sensor-state out")
        if self.joints_deg is not None and self.scan_method:
            raise UsageError("--joints of a scan: give a file with a line for each touch")
        if not self.publish and (self.publish_users is not None or self.open):
            raise UsageError("--publish-users and --open need --publish URL")

    @property
    def scan_method(self) -> str:
        """`joint` or `thesis`; empty where every touch is read by itself."""
        return self.method if self.scan or self.method == "thesis" else ""

    @property
    def joints_file(self) -> Path | None:
        """File of joint angles, a line for each touch."""
        path = Path(self.joints)
        return path if self.joints and path.is_file() else None

    @cached_property
    def joints_deg(self) -> tuple[float, ...] | None:
        """(5,) joint angles of all touches, degrees."""
        if not self.joints or self.joints_file is not None:
            return None
        angles = five_angles(self.joints.split(","))
        if angles is None:
            raise UsageError(
                f"--joints {self.joints}: give five angles in degrees, as 0,-30,60,0,0"
            )
        return angles


def five_angles(words: Sequence[str]) -> tuple[float, ...] | None:
    """Return five joint angles, degrees; None where the words are something else."""
    try:
        angles = tuple(float(word) for word in words)
    except ValueError:
        return None
    return angles if len(angles) == 5 and all(abs(angle) <= 360 for angle in angles) else None
