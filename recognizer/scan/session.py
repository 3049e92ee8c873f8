"""A scan as a program has it: touches in, the belief so far out. Thesis 4.3, 6.3.

Where a touch stands against the first one of its face is what the arm says (its pose, with a
covariance where it gives one), where overlapping images show it if that is vague
(`recognizer.scan.mosaic`), or, where nobody measured a step, on a path through registered places
(`path`). A pose that does not lie in the plane of
the touches so far is of another face; what faces say of the object is joined (`faces`).
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.arm.carried import SensorPose
from recognizer.scan.belief import ScanBelief, begin_scan
from recognizer.scan.faces import TouchedFace, contradict, join_faces
from recognizer.scan.grow import extend_scan
from recognizer.scan.mosaic.planar import (
    PlacedTouch,
    PlanarBelief,
    planar_belief,
    planar_covariance,
    planar_pose,
)
from recognizer.scan.settings import ScanSettings
from recognizer.touch.contacts import TouchImage
from recognizer.touch.lab import Lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Recognition
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PlaceShare:
    """A place that touches may have felt, and the share of the belief that it has."""

    object: str
    face: str
    index: tuple[int, int]  #: row and column of the array's cell under the sensor's centre
    share: float  #: 0 ... 1, as if one of the places that come into question is the right one


class Scan:
    """Several touches of one object, read as one belief.

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
        self._reader = lab if isinstance(lab, Reader) else Reader(lab, sensor or SensorType())
        self._settings = settings or ScanSettings()
        self._faces = [self._new_face()]  # the last one is being touched
        self._answer = self._faces[0].belief.recognition
        self._changed = 0

    @property
    def answer(self) -> Recognition:
        """The best answer so far, of the probe's pose at the touch `answer.seq`; or why none.

        A later touch that cannot be read does not take it back; one that contradicts it does.
        """
        return self._answer

    @property
    def places(self) -> tuple[PlaceShare, ...]:
        """Places of the face touched last that come into question, likeliest first; shares of 1."""
        found = self._faces[-1].belief.places
        scores = np.array([one.score for one in found])
        shares = np.exp(scores - scores.max()) if len(found) else scores
        return tuple(
            PlaceShare(*one.face, one.index, share)
            for one, share in zip(found, (shares / shares.sum()).tolist(), strict=True)
        )

    @property
    def touches(self) -> int:
        """How many touches the belief rests on: those with contact."""
        return sum(len(face.belief.touches) for face in self._faces)

    @property
    def changes(self) -> int:
        """How often what was told was given up: the object has slipped, or is another one."""
        return self._changed

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
            Of the same object as those before: counts (rows, columns), a signal, or a touch of
            `recognizer.touch.contacts`. Where nobody knows how the probe moved, touches of a face
            should lie within 8 mm or so of the one before (`ScanSettings.by_hand`).
        pose
            (4, 4) T_base_sensor, mm, in any fixed frame; with the arm's own covariance if it
            is a `SensorPose`; by default the touch's own, if it has one. It tells when another
            face is touched.
        seq
            Number of the touch; counted if not given.

        Raises
        ------
        MosaicError
            Another sensor's image.
        """
        given = touch.seq if isinstance(touch, TouchImage) and seq is None else seq
        if isinstance(touch, TouchImage):
            pose, touch = touch.pose if pose is None else pose, touch.counts
        signal = touch if isinstance(touch, Signal) else self._reader.signal(touch)
        number = self.touches if given is None else given
        if signal.contact:
            self._turn_to_face(pose)
        face = self._faces[-1]
        before = face.belief
        belief = extend_scan(before, face.places.place(signal, pose, number))
        if belief.begun > before.begun:  # what was told so far may be true of another face
            face = _Face(replace(belief, begun=before.begun), copy(face.places))
            self._faces.append(face)
        face.belief = belief = replace(belief, begun=before.begun)
        if not signal.contact:
            return belief.recognition
        face.places.keep(pose)
        face.pose = None if pose is None else _matrix(pose)
        found = self._join()
        if found or not self._answer or (before.told is not None and belief.told is None):
            self._answer = found
        return found

    def _new_face(self) -> _Face:
        return _Face(begin_scan(self._reader, self._settings), TouchPlaces(self._settings))

    def _turn_to_face(self, pose: SensorPose | ArrayLike | None) -> None:
        """Let the face that a pose lies on be the last one, a new one if it lies on none."""
        if pose is None or self._faces[-1].places.holds(pose):
            return
        for k, face in enumerate(self._faces):
            if face.places.holds(pose):
                self._faces.append(self._faces.pop(k))
                return
        self._faces.append(self._new_face())

    def _join(self) -> Recognition:
        """Return what the last touch says, as those of other faces have it."""
        *others, last = (TouchedFace(face.belief, face.pose) for face in self._faces)
        if any(contradict(last, other, self._settings) for other in others):
            self._faces = self._faces[-1:]
            self._changed += 1
            return last.belief.recognition
        return join_faces(last, others)


@dataclass(slots=True)
class _Face:
    """A face that was touched."""

    belief: ScanBelief
    places: TouchPlaces
    pose: Array | None = None  #: (4, 4) T_base_sensor of its last touch; None: not known


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

    def holds(self, pose: SensorPose | ArrayLike) -> bool:
        """Whether a pose lies in the plane of the touches so far, or nobody can tell."""
        if self._T_first_base is None:
            return True
        T = self._T_first_base @ _matrix(pose)
        facing = float(T[2, 2]) > math.cos(self.settings.facing_rad)
        return facing and abs(float(T[2, 3])) < self.settings.above_mm

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
