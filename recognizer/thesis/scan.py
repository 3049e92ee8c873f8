"""A scan of overlapping touches, read the thesis's way: merged, then read as one image.

    merge    touches and believed poses -> global tactile image
    read     image -> symbols, grid, window, index, pose

Without known motion, the mosaic of `recognizer.scan` gives the poses of touches. The answer has the
probe's pose at the last touch. Thesis 4.3, 6.1-6.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.arm import SensorPose
from recognizer.scan.mosaic.mosaic import add_touch, no_touches
from recognizer.scan.session import TouchPlaces
from recognizer.thesis.merge import Placing, merge_touches
from recognizer.thesis.read import ClassicalReading, read_classically
from recognizer.touch.lab import Lab
from recognizer.touch.recognition import NO_CONTACT, TOO_FEW, UNCHECKED, Recognition, refusal
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]

EVERY = 8  #: touches, after which all are merged and read again


def read_scan(
    lab: Lab,
    sensor: SensorType,
    readings: Sequence[ArrayLike],
    poses: ArrayLike,
    placing: Placing = "product",
    *,
    trust: ArrayLike | None = None,
    seq: int = 0,
) -> ClassicalReading:
    """Return object and face of a scan, and the probe's pose at its last touch.

    Readings, poses and the rest are those of `merge_touches`; poses in any frame.

    Raises
    ------
    ImageError
        If readings and poses do not belong together.
    """
    merged = merge_touches(sensor, readings, poses, placing, trust=trust)
    T_image_probe = spatial_pose(merged.poses[-1])
    return read_classically(lab, merged.image, T_image_probe=T_image_probe, seq=seq)


def spatial_pose(pose: Array) -> Array:
    """Return (4, 4) of a planar pose (3,)."""
    x, y, theta = pose.tolist()
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]], np.float64)


class ThesisScan:
    """Overlapping touches of one face, merged and read again every `EVERY` touches.

    Its interface is that of `recognizer.scan.session.Scan`.
    """

    def __init__(self, lab: Lab, sensor: SensorType, mounting: str = UNCHECKED) -> None:
        self._lab, self._unread, self._mounting = lab, 0, mounting
        self._mosaic = no_touches(sensor)
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

    def add(self, touch: Signal, pose: SensorPose | ArrayLike | None, *, seq: int) -> Recognition:
        """Return the answer of all touches so far, with the probe's pose at this one.

        Parameters
        ----------
        pose
            T_base_sensor (4, 4), mm, alone or with its covariance; None: not known.
        """
        if not touch.contact:
            return refusal(seq, NO_CONTACT)
        self._mosaic = add_touch(self._mosaic, self._places.place(touch, pose, seq))
        self._places.keep(pose)
        self._unread += 1
        return self._read() if self._unread >= EVERY else refusal(seq, TOO_FEW)

    def _read(self) -> Recognition:
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
        found = replace(found, mounting=self._mounting)
        if found or not self._answer:
            self._answer = found
        return found
