"""`--scan` and `--method thesis`: several touches as one belief, and how the probe moved.

What is known of the motion: the joint angles of each touch (`--joints FILE`) with the wrist's
readings, else the poses of the recording, else nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING

from encoded_objects.base.foreign import MOST_TEXT, foreign_bytes
from probe.errors import PoseError
from recognizer.command.options import five_angles
from recognizer.errors import RecognizerError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from probe.arm import SensorPose
    from recognizer.scan.session import Scan
    from recognizer.thesis.scan import ThesisScan
    from recognizer.touch.reader import Reader
    from recognizer.touch.source import TouchImage

Joints = tuple[tuple[float, ...], ...]


class ScanError(RecognizerError):
    """Touches that are no scan."""


def belief_for(reader: Reader, method: str) -> Scan | ThesisScan:
    """Return an empty belief of a method, `joint` or `thesis`."""
    if method == "thesis":
        from recognizer.thesis.scan import ThesisScan

        return ThesisScan(reader.lab, reader.sensor, reader.mounting)
    from recognizer.scan.session import Scan

    return Scan(reader)


def refuse_single(touches: Iterable[TouchImage], place: str, needed: int) -> Iterator[TouchImage]:
    """Return touches, of which there must be two.

    Raises ScanError: a recording of one touch.
    """
    rest = iter(touches)
    first = list(islice(rest, 2))
    if len(first) == 1:
        more = f"; here an answer takes about {needed} touches" if needed > 1 else ""
        raise ScanError(
            f"one touch is no scan{more}",
            fix="leave --scan out, or record touches that overlap by a third or more",
            place=place,
        )
    return chain(first, rest)


def sensor_pose(
    touch: TouchImage, joints_deg: Sequence[float] | None, error_deg: float
) -> SensorPose | None:
    """Return the pose of the sensor in the robot's base; None if nothing is known of it.

    Joint angles count, with their standard deviation; else the recorded pose, taken as exact.

    Raises PoseError: angles or readings of the wrist that no arm can have.
    """
    if joints_deg is None and touch.pose is None:
        return None
    import numpy as np

    from probe.arm import Arm, SensorPose
    from probe.wrist import Wrist
    from recognizer.touch.robot import carried_pose

    if joints_deg is None:
        return SensorPose(np.asarray(touch.pose), np.zeros((6, 6)))
    if not np.any(touch.wrist):
        raise PoseError(
            "its frames have no readings of the wrist, all are 0",
            fix="record them, or leave --joints out and record poses (/pose)",
        )
    errors = np.full(len(joints_deg), math.radians(error_deg))
    return carried_pose(Arm(), Wrist(), np.radians(joints_deg), errors, touch.wrist)


def pose_during(
    touch: TouchImage, number: int, joints_deg: Joints, error_deg: float, place: str = ""
) -> SensorPose | ArrayLike | None:
    """Return the pose of the sensor during a touch of a scan of `place`, numbered from 1.

    Raises ScanError: angles for fewer touches than there are, or of no arm, see `sensor_pose`.
    """
    if not joints_deg:
        return touch.pose
    if number > len(joints_deg):
        raise ScanError(
            f"joint angles of {len(joints_deg)} touches, but there is touch {number}",
            fix="give --joints FILE with a line of five angles for each touch",
        )
    try:
        return sensor_pose(touch, joints_deg[number - 1], error_deg)
    except PoseError as error:
        cause = f"touch {number} of the scan: {error.cause}"
        raise ScanError(cause, fix=error.fix, place=place) from error


def read_joints(path: Path) -> Joints:
    """Return the angles (degrees) of a text file, a line of five for every touch.

    Raises ScanError: it cannot be read, or a line holds something else.
    """
    content = foreign_bytes(path, ScanError, most=MOST_TEXT, fix="give a text file of joint angles")
    lines = content.decode("utf-8", "replace").splitlines()
    found = []
    for number, line in enumerate(lines, start=1):
        words = line.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        angles = five_angles(words)
        if angles is None:
            raise ScanError(
                f"{line.strip()!r} is not five angles in degrees",
                fix="write a line such as 0,-30,60,0,0 for each touch",
                place=f"{path}:{number}",
            )
        found.append(angles)
    return tuple(found)


def touches_for(reader: Reader) -> int:
    """Return about how many touches an answer takes, of the lab's array that takes most."""
    from generator.array.contract import touches_needed

    width_mm = 2 * min(reader.sensor.half_mm)
    return max(
        touches_needed(
            each.array.order, each.array.rows * each.array.columns, each.style.pitch_mm,
            sensor_mm=width_mm,
        )
        for each in reader.lab.arrays
    )  # fmt: skip
