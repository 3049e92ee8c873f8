"""A scan of overlapping touches, read the thesis's way: merged, then read as one image.

    merge    touches and believed poses -> global tactile image
    read     image -> symbols, grid, window, index, pose

Without known motion, the mosaic of `recognizer.scan` gives the poses of touches. The answer has the
probe's pose at the last touch. Thesis 4.3, 6.1-6.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.arm import SensorPose
from recognizer.scan.mosaic.mosaic import add_touch, no_touches
from recognizer.scan.session import TouchPlaces
from recognizer.thesis.merge import WINDOW_TACTELS, MergedImage, Placing, merge_touches
from recognizer.thesis.read import ClassicalReading, read_classically
from recognizer.touch.lab import Lab
from recognizer.touch.recognition import NO_CONTACT, TOO_FEW, Recognition, refusal
from recognizer.touch.signal import Signal, signal_of

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ScanReading:
    """The answer to a scan with its intermediate results."""

    recognition: Recognition  #: with the probe's pose at the last touch
    merged: MergedImage
    reading: ClassicalReading


def read_scan(
    lab: Lab,
    sensor: SensorType,
    readings: Sequence[ArrayLike],
    poses: ArrayLike,
    placing: Placing = "product",
    window_tactels: float = WINDOW_TACTELS,
    *,
    trust: ArrayLike | None = None,
    seq: int = 0,
) -> ScanReading:
    """Return object and face of a scan, and the probe's pose at its last touch.

    Parameters
    ----------
    sensor
        Of all touches.
    readings
        (rows, columns) of each touch: newtons or counts over their bias.
    poses
        Of the touches as arm and wrist believe them: (n, 4, 4) T_base_probe, or (n, 3) x, y
        (mm) and theta (rad) in the plane of the face, in any frame.
    placing, window_tactels
        Where a correction is searched for, and how far (`merge_touches`).
    trust
        (rows, columns) of a calibration: 0 for bad tactels.
    seq
        Number of the answer.

    Raises
    ------
    ImageError
        If readings and poses do not belong together.
    """
    image = merge_touches(sensor, readings, poses, placing, window_tactels, trust=trust)
    found = read_classically(lab, image.image, T_image_probe=spatial_pose(image.poses[-1]), seq=seq)
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
    placing: Placing = "product",
    window_tactels: float = WINDOW_TACTELS,
    *,
    every: int = 1,
) -> Iterator[ScanReading]:
    """Yield the reading of the first touches of a scan, `every` more at a time, and of all.

    A probe that reads while it scans stops at the first answer.
    """
    places = np.asarray(poses, np.float64)
    for number in [*range(every, len(readings), every), len(readings)]:
        some = readings[:number], places[:number]
        yield read_scan(lab, sensor, *some, placing, window_tactels)


class ThesisScan:
    """Overlapping touches of one face, merged and read again every few touches.

    Its interface is that of `recognizer.scan.session.Scan`.

    Parameters
    ----------
    sensor
        Of all touches; the usual one if not given.
    every
        Number of touches after which the image is read again; `answer` reads the rest.
    """

    def __init__(self, lab: Lab, *, sensor: SensorType | None = None, every: int = 8) -> None:
        self._lab, self._every, self._unread = lab, every, 0
        self._mosaic = no_touches(sensor or SensorType())
        self._places = TouchPlaces()
        self._answer = refusal(0, TOO_FEW)

    @property
    def answer(self) -> Recognition:
        """The best answer so far, with the probe's pose at the touch `answer.seq`, or a refusal."""
        if self._unread:
            self._read()
        return self._answer

    @property
    def touches(self) -> int:
        """Number of touches with contact."""
        return len(self._mosaic)

    def add(
        self,
        touch: Signal | ArrayLike,
        pose: SensorPose | ArrayLike | None = None,
        *,
        seq: int | None = None,
    ) -> Recognition:
        """Return the answer of all touches so far, with the probe's pose at this one.

        Parameters
        ----------
        touch
            Counts (rows, columns) or a signal.
        pose
            T_base_sensor (4, 4), mm, alone or with its covariance; None: not known.
        seq
            Number of the touch; counted if not given.
        """
        signal = touch if isinstance(touch, Signal) else signal_of(np.asarray(touch, np.float64))
        number = self.touches if seq is None else seq
        if not signal.contact:
            return refusal(number, NO_CONTACT)
        self._mosaic = add_touch(self._mosaic, self._places.place(signal, pose, number))
        self._places.keep(pose)
        self._unread += 1
        return self._read() if self._unread >= self._every else refusal(number, TOO_FEW)

    def _read(self) -> Recognition:
        """Merge and read all touches."""
        touches, self._unread = self._mosaic.touches, 0
        arm = [each.believed.pose for each in touches if each.believed is not None]
        by_arm = len(arm) == len(touches)
        found = read_scan(
            self._lab,
            self._mosaic.sensor,
            [each.signal.forces for each in touches],
            np.array(arm) if by_arm else self._mosaic.poses,
            "bounded" if by_arm else "believed",
            trust=np.min([each.signal.trust for each in touches], axis=0),
            seq=touches[-1].seq,
        ).recognition
        if found or not self._answer:
            self._answer = found
        return found
