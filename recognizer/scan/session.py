"""A scan as a program has it: touches in, the belief so far out. Thesis 4.3, 6.3.

Where a touch stands against the first one is what the arm says (its pose, with a covariance
where it gives one), or what a hand may have done since the touch before; then overlapping
images tell, see `recognizer.scan.mosaic`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.arm.carried import SensorPose
from probe.sensor import SensorType
from recognizer.scan.grow import begin_scan, extend_scan
from recognizer.scan.mosaic.planar import planar_covariance, planar_pose
from recognizer.scan.mosaic.touch import PlacedTouch, PlanarBelief, planar_belief
from recognizer.scan.settings import ScanSettings
from recognizer.touch.contacts import TouchImage
from recognizer.touch.lab import Lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Recognition
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]


class Scan:
    """Several overlapping touches of one face, read as one belief.

    Parameters
    ----------
    lab
        What can be touched; or a reader of it that is there already.
    sensor
        The one that feels all touches; the usual one if not given.
    settings
        Limits.

    Examples
    --------
    >>> from encoded_objects import Scan, open_lab, simulate
    >>> scan = Scan(open_lab("lab.db"))
    >>> for x in (20, 28):
    ...     answer = scan.add(simulate("lab.db#Cube/F1", x=x, y=31).counts)
    >>> scan.touches, scan.answer.object, scan.answer.face
    (2, 'Cube', 'F1')
    """

    def __init__(
        self,
        lab: Lab | Reader,
        *,
        sensor: SensorType | None = None,
        settings: ScanSettings | None = None,
    ) -> None:
        reader = lab if isinstance(lab, Reader) else Reader(lab, sensor or SensorType())
        self._belief = begin_scan(reader, settings)
        self._places = TouchPlaces(self._belief.settings)
        self._answer = self._belief.recognition

    @property
    def answer(self) -> Recognition:
        """The best answer so far, of the probe's pose at the touch `answer.seq`; or why none.

        A later touch that cannot be read does not take it back; one that contradicts it does.
        """
        return self._answer

    @property
    def touches(self) -> int:
        """How many touches the belief rests on: those with contact."""
        return len(self._belief.touches)

    def add(
        self,
        touch: TouchImage | Signal | ArrayLike,
        pose: SensorPose | ArrayLike | None = None,
        *,
        seq: int | None = None,
    ) -> Recognition:
        """Return what all touches say by now, with the pose of the probe at this one.

        Parameters
        ----------
        touch
            Of the same face as those before, overlapping one of them by a third or more:
            counts (rows, columns), a signal, or a touch of `recognizer.touch.contacts`.
        pose
            (4, 4) T_base_sensor, mm, in any fixed frame; with the arm's own covariance if it
            is a `SensorPose`; by default the touch's own, if it has one.
        seq
            Number of the touch; counted if not given.

        Raises
        ------
        MosaicError
            Another sensor's image, or a pose that does not face the plane of the first one.
        """
        given = touch.seq if isinstance(touch, TouchImage) and seq is None else seq
        if isinstance(touch, TouchImage):
            pose, touch = touch.pose if pose is None else pose, touch.counts
        signal = touch if isinstance(touch, Signal) else self._belief.reader.signal(touch)
        number = self.touches if given is None else given
        self._belief = extend_scan(self._belief, self._places.place(signal, pose, number))
        found = self._belief.recognition
        if signal.contact:
            self._places.keep(pose)
            if found or not self._answer or self._belief.told is None:
                self._answer = found
        return found


class TouchPlaces:
    """Poses in any frame -> places in the plane of the first touch.

    Parameters
    ----------
    settings
        How well arms and hands are believed.
    """

    def __init__(self, settings: ScanSettings) -> None:
        self.settings = settings
        self._T_first_base: Array | None = None  #: None: the first touch had no pose
        self._before: SensorPose | ArrayLike | None = None  #: pose of the last touch
        self._any = False  #: whether there was a touch

    def keep(self, pose: SensorPose | ArrayLike | None) -> None:
        """Take a touch as one that later ones are placed against."""
        if not self._any and pose is not None:
            self._T_first_base = _inverse(_matrix(pose))
        self._before, self._any = pose, True

    def place(self, signal: Signal, pose: SensorPose | ArrayLike | None, seq: int) -> PlacedTouch:
        """Return a touch with what is known of its place."""
        if not self._any:
            spread = self.settings.first if pose is None else self._spread(pose, _matrix(pose))
            return PlacedTouch(signal, believed=planar_belief(np.zeros(3), spread), seq=seq)
        if pose is not None and self._T_first_base is not None:
            return PlacedTouch(signal, believed=self._within(self._T_first_base, pose), seq=seq)
        if pose is None or self._before is None:
            step = planar_belief(np.zeros(3), self.settings.by_hand)
        else:
            step = self._within(_inverse(_matrix(self._before)), pose)
        return PlacedTouch(signal, stepped=step, seq=seq)

    def _within(self, T_plane_base: Array, pose: SensorPose | ArrayLike) -> PlanarBelief:
        at = planar_pose(T_plane_base @ _matrix(pose))
        return planar_belief(at, self._spread(pose, _inverse(T_plane_base)))

    def _spread(self, pose: SensorPose | ArrayLike, T_base_plane: Array) -> ArrayLike:
        """Return covariance (3, 3) or standard deviations (3,) of a pose in a plane."""
        if isinstance(pose, SensorPose) and pose.covariance.any():
            return planar_covariance(pose.covariance, T_base_plane[:3, :3].T)
        return self.settings.by_arm


def _matrix(pose: SensorPose | ArrayLike) -> Array:
    return np.asarray(pose.T_base_sensor if isinstance(pose, SensorPose) else pose, np.float64)


def _inverse(T: Array) -> Array:
    return np.asarray(np.linalg.inv(T), np.float64)
