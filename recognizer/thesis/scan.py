"""A scan of overlapping touches, read the thesis's way: merged, then read as one image.

    classical_image    touches and believed poses -> global tactile image
    classical          image -> symbols, grid, window, index, pose

The answer says where the probe stands at the last touch. Thesis 4.3, 6.1-6.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.sensor import SensorType
from recognizer.thesis.image import GlobalImage, Merging, merged
from recognizer.thesis.read import ClassicalReading, Settings, read_classically
from recognizer.touch.lab import Lab
from recognizer.touch.recognition import Recognition

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ScanReading:
    """The answer to a scan and how it came about."""

    recognition: Recognition  #: of the probe's pose at the last touch
    merged: GlobalImage
    reading: ClassicalReading


def read_scan(
    lab: Lab,
    sensor: SensorType,
    readings: Sequence[ArrayLike],
    poses: ArrayLike,
    settings: Settings | None = None,
    merging: Merging | None = None,
    *,
    trust: ArrayLike | None = None,
    seq: int = 0,
) -> ScanReading:
    """Return which object and face a scan has touched, and where the probe stands now.

    Parameters
    ----------
    lab
        What can be touched.
    sensor
        The one that felt the touches.
    readings
        (rows, columns) of each touch: newtons or counts over their bias.
    poses
        Of the touches as arm and wrist believe them: (n, 4, 4) T_base_probe, or (n, 3) x, y
        (mm) and theta (rad) in the plane of the face, in any frame.
    settings, merging
        Of the stages.
    trust
        (rows, columns) of a calibration: 0 for bad tactels.
    seq
        Number of the answer.

    Raises
    ------
    ImageError
        If readings and poses do not belong together.

    Examples
    --------
    >>> answer = read_scan(lab, SensorType(), images, believed)  # doctest: +SKIP
    >>> answer.recognition.object, answer.recognition.face  # doctest: +SKIP
    ('Cube', 'F1')
    """
    image = merged(sensor, readings, poses, merging, trust)
    found = read_classically(
        lab, image.image, settings, T_image_probe=spatial_pose(image.poses[-1]), seq=seq
    )
    return ScanReading(found.recognition, image, found)


def spatial_pose(pose: Array) -> Array:
    """Return (4, 4) of a planar pose (3,)."""
    x, y, theta = pose.tolist()
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]], np.float64)


def read_while_scanning(
    lab: Lab,
    sensor: SensorType,
    readings: Sequence[ArrayLike],
    poses: ArrayLike,
    settings: Settings | None = None,
    merging: Merging | None = None,
    every: int = 1,
) -> Iterator[ScanReading]:
    """Yield what is read after the first touches of a scan, `every` more at a time, and all.

    A probe that reads while it scans stops at the first answer.
    """
    places = np.asarray(poses, np.float64)
    for number in [*range(every, len(readings), every), len(readings)]:
        yield read_scan(lab, sensor, readings[:number], places[:number], settings, merging)
