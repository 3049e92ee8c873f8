"""A scan of one object: touches in, the answer so far out. Thesis 4.3, 6.3.

The pose of a touch against the first one of its face comes from the arm (with a covariance where it
gives one), from overlapping images where the arm is vague (`recognizer.scan.mosaic`), or from a
path through registered places where a step was not measured (`path`). A pose out of the plane of
the touches so far belongs to another face.

Each likely place of a face names an object and, with known motion, its pose. A place loses the nats
by which the touches of every other face contradict an object there, up to a bound: the object may
have been changed in between. Another face may decide an ambiguous one, and two ambiguous faces may
decide it together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.errors import UsageError
from encoded_objects.base.sensor_type import SensorType
from probe.arm import SensorPose
from probe.frame import Frame, are_rigid
from recognizer.errors import MosaicError
from recognizer.scan.belief import ScanBelief, ScanHypothesis, begin_scan, extend_scan
from recognizer.scan.mosaic.planar import (
    ARM_SD,
    BY_HAND_SD,
    FIRST_SD,
    PlacedTouch,
    PlanarBelief,
    planar_belief,
    planar_covariance,
    planar_pose,
)
from recognizer.touch.lab import Lab
from recognizer.touch.pose import face_pose, pose_on_object
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import answer_at
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, Recognition
from recognizer.touch.signal import Signal
from recognizer.touch.source import TouchImage
from recognizer.touch.verdict import reject_margin

Array = NDArray[np.float64]

FACING_RAD = math.radians(20)  #: turned further against a face, a touch is on another one
ABOVE_MM = 6.0  #: as far above or below a face, too
CHANGED_NATS = 20.0  #: most that another face contributes: the object may have been changed
#: differences of one object's pose as two faces give it: an edge, errors of plate and arm
OBJECT_MM, OBJECT_RAD = 6.0, math.radians(6)

_OPEN = (AMBIGUOUS, BY_CHANCE)  #: reasons of touches that leave a choice of registered places


@dataclass(frozen=True, slots=True)
class PlaceShare:
    """A likely place of the touches, and its share of the belief."""

    object: str
    face: str
    index: tuple[int, int]  #: row and column of the array's cell under the sensor's centre
    share: float  #: 0 ... 1, as if one of the likely places is the right one


class Scan:
    """Several touches of one object, read as one belief.

    Parameters
    ----------
    lab
        The database, or a prepared reader of it.
    sensor
        The sensor of all touches; the usual one if not given.

    Examples
    --------
    >>> from encoded_objects import Scan, open_lab, simulate
    >>> scan = Scan(open_lab("lab.db"))
    >>> for x in (20, 28):
    ...     answer = scan.add(simulate("lab.db#Cube/F1", x=x, y=31).counts)
    >>> scan.touches, scan.answer.object, scan.answer.face
    (2, 'Cube', 'F1')
    """

    def __init__(self, lab: Lab | Reader, *, sensor: SensorType | None = None) -> None:
        if isinstance(lab, Reader) and sensor is not None:
            raise UsageError("a reader has its sensor", fix="leave sensor out, or give the lab")
        self._reader = lab if isinstance(lab, Reader) else Reader(lab, sensor or SensorType())
        self._faces = [self._new_face()]  # the last one is touched now
        self._answer = self._faces[0].belief.recognition
        self._changes = 0

    @property
    def answer(self) -> Recognition:
        """The best answer so far, with the probe's pose at the touch `answer.seq`, or a refusal.

        A later touch that cannot be read does not withdraw it; one that contradicts it does.
        """
        return self._answer

    @property
    def places(self) -> tuple[PlaceShare, ...]:
        """Likely places of the face touched last, likeliest first; their shares add up to 1."""
        found = self._faces[-1].belief.places
        scores = np.array([one.score for one in found])
        shares = np.exp(scores - scores.max()) if len(found) else scores
        return tuple(
            PlaceShare(one.face.object, one.face.face, one.index, share)
            for one, share in zip(found, (shares / shares.sum()).tolist(), strict=True)
        )

    @property
    def touches(self) -> int:
        """Number of touches that the belief rests on: those with contact."""
        return sum(len(face.belief.touches) for face in self._faces)

    @property
    def changes(self) -> int:
        """How often an answer was given up: the object slipped or was replaced."""
        return self._changes

    def add(
        self,
        touch: TouchImage | Frame | Signal | ArrayLike,
        pose: SensorPose | ArrayLike | None = None,
        *,
        seq: int | None = None,
    ) -> Recognition:
        """Return the answer of all touches so far, with the probe's pose at this one.

        Parameters
        ----------
        touch
            Of one object: counts (rows, columns), a signal, a frame, or a `TouchImage`.
            Without poses, touches of a face should lie within 8 mm or so of the one before.
        pose
            (4, 4) T_base_sensor, mm, in any fixed frame, with a covariance if it is a `SensorPose`;
            by default the touch's own, if it has one. It shows when another face is touched.
        seq
            Number of the touch; counted if not given.

        Raises
        ------
        MosaicError
            Another sensor's image, or a pose that is no rigid transform.
        """
        given = touch.seq if isinstance(touch, TouchImage | Frame) and seq is None else seq
        if isinstance(touch, TouchImage | Frame):
            pose, touch = touch.pose if pose is None else pose, touch.counts
        signal = touch if isinstance(touch, Signal) else self._reader.signal(touch)
        number = self.touches if given is None else given
        if signal.contact:
            self._select_face(pose)
        face = self._faces[-1]
        before = face.belief
        belief = extend_scan(before, face.places.place(signal, pose, number))
        if belief.resets > before.resets:  # the earlier touches may be of another face
            face = _Face(belief, copy(face.places))
            self._faces.append(face)
        face.belief = belief = replace(belief, resets=before.resets)
        if not signal.contact:
            return belief.recognition
        face.places.keep(pose)
        found = replace(self._join(), mounting=self._reader.mounting)
        withdrawn = before.confirmed_face is not None and belief.confirmed_face is None
        if found or not self._answer or withdrawn:
            self._answer = found
        return found

    def _new_face(self) -> _Face:
        return _Face(begin_scan(self._reader), TouchPlaces())

    def _select_face(self, pose: SensorPose | ArrayLike | None) -> None:
        """Move the face that contains a pose to the end of the list; a new one if none does."""
        if pose is None or self._faces[-1].places.holds(pose):
            return
        for k, face in enumerate(self._faces):
            if face.places.holds(pose):
                self._faces.append(self._faces.pop(k))
                return
        self._faces.append(self._new_face())

    def _join(self) -> Recognition:
        """Return the answer of the last face, decided by the other faces where it is open."""
        *others, last = self._faces
        if any(contradict(last, other) for other in others):
            self._faces = [last]
            self._changes += 1
            return last.belief.recognition
        return join_faces(last, others)


@dataclass(slots=True)
class TouchPlaces:
    """Poses in any frame -> places in the plane of the first touch."""

    begun: bool = False  #: whether there was a touch
    T_first_base: Array | None = None  #: None: the first touch had no pose
    before: SensorPose | ArrayLike | None = None  #: pose of the last touch

    def keep(self, pose: SensorPose | ArrayLike | None) -> None:
        """Keep the pose of a touch, which later touches are placed against."""
        if not self.begun and pose is not None:
            self.T_first_base = _inverse(_matrix(pose))
        self.before, self.begun = pose, True

    def holds(self, pose: SensorPose | ArrayLike) -> bool:
        """Whether a pose lies in the plane of the touches so far, or may do."""
        if self.T_first_base is None:
            return True
        T = self.T_first_base @ _matrix(pose)
        return float(T[2, 2]) > math.cos(FACING_RAD) and abs(float(T[2, 3])) < ABOVE_MM

    def place(self, signal: Signal, pose: SensorPose | ArrayLike | None, seq: int) -> PlacedTouch:
        """Return a touch with its place."""
        if not self.begun:
            spread = FIRST_SD if pose is None else _spread(pose, _matrix(pose))
            return PlacedTouch(signal, believed=planar_belief(np.zeros(3), spread), seq=seq)
        if pose is not None and self.T_first_base is not None:
            return PlacedTouch(signal, believed=_pose_within(self.T_first_base, pose), seq=seq)
        if pose is None or self.before is None:
            step = planar_belief(np.zeros(3), BY_HAND_SD)
        else:
            step = _pose_within(_inverse(_matrix(self.before)), pose)
        return PlacedTouch(signal, stepped=step, seq=seq)


def _pose_within(T_plane_base: Array, pose: SensorPose | ArrayLike) -> PlanarBelief:
    at = planar_pose(T_plane_base @ _matrix(pose))
    return planar_belief(at, _spread(pose, _inverse(T_plane_base)))


def _spread(pose: SensorPose | ArrayLike, T_base_plane: Array) -> ArrayLike:
    """Return covariance (3, 3) or standard deviations (3,) of a pose in a plane."""
    if isinstance(pose, SensorPose) and pose.covariance.any():
        return planar_covariance(pose.covariance, T_base_plane[:3, :3].T)
    return ARM_SD


@dataclass(slots=True)
class _Face:
    belief: ScanBelief
    places: TouchPlaces


@dataclass(frozen=True, slots=True, eq=False)
class _ObjectHypothesis:
    """The object at a place of a face."""

    object: str
    T_base_object: Array | None  #: (4, 4); None: the probe's pose is not known
    score: float = 0.0  #: nats below the likeliest place of that face, 0 or less


def join_faces(last: _Face, others: Sequence[_Face]) -> Recognition:
    """Return the answer of the last face; where it leaves a choice, the other faces decide."""
    belief, answer = last.belief, last.belief.recognition
    by_face = [found for found in map(_hypotheses_of, others) if found]
    if answer or answer.reason not in _OPEN or not belief.places or not by_face:
        return answer
    against = []  # nats by which each other face contradicts each place
    for place in belief.places:
        one = _hypothesis_at(place, last)
        against.append([_nats_against(one, each) for each in by_face])
    scores = [one.score - sum(nats) for one, nats in zip(belief.places, against, strict=True)]
    first, *rest = sorted(range(len(scores)), key=lambda k: -scores[k])
    best, rival = belief.places[first], belief.places[rest[0]] if rest else None
    margin = scores[first] - scores[rest[0]] if rest else math.inf
    contradicted = min(against[first]) >= CHANGED_NATS
    options = belief.reader.options
    if contradicted or reject_margin(margin, options.margin):
        return answer
    found = answer_at(
        best.embossed, best.fit, best.hypothesis, options, answer.seq,
        reason="", margin=margin, runner_up=None if rival is None else rival.runner_up,
    )  # fmt: skip
    return replace(found, next=None) if found else answer


def contradict(a: _Face, b: _Face) -> bool:
    """Whether the answers of two faces exclude each other: the object was changed."""
    if not (a.belief.recognition and b.belief.recognition):
        return False
    return not _is_one_object(_hypotheses_of(a)[0], _hypotheses_of(b)[0])


def _hypotheses_of(face: _Face) -> list[_ObjectHypothesis]:
    """Return the objects at the places of a face, likeliest first; empty if it is not encoded."""
    belief, answer = face.belief, face.belief.recognition
    if answer and answer.object is not None and answer.T_object_probe is not None:
        return [_ObjectHypothesis(answer.object, _base_object(face, answer.T_object_probe))]
    if answer.reason not in _OPEN:
        return []
    most = max((place.score for place in belief.places), default=0.0)
    return [
        replace(_hypothesis_at(place, face), score=place.score - most) for place in belief.places
    ]


def _hypothesis_at(place: ScanHypothesis, touched: _Face) -> _ObjectHypothesis:
    pose = face_pose(place.embossed, place.face, place.hypothesis, place.fit)
    at = _base_object(touched, pose_on_object(place.face, pose))
    return _ObjectHypothesis(place.face.object, at)


def _base_object(face: _Face, T_object_probe: Array) -> Array | None:
    """Return T_base_object (4, 4) by the last touch of a face; None if its pose is not known."""
    if face.places.before is None:
        return None
    return np.asarray(_matrix(face.places.before) @ _inverse(T_object_probe))


def _nats_against(one: _ObjectHypothesis, others: Sequence[_ObjectHypothesis]) -> float:
    """Return the nats by which the touches of another face contradict an object."""
    agreeing = [-other.score for other in others if _is_one_object(one, other)]
    return min([*agreeing, CHANGED_NATS])


def _is_one_object(a: _ObjectHypothesis, b: _ObjectHypothesis) -> bool:
    if a.object != b.object:
        return False
    if a.T_base_object is None or b.T_base_object is None:
        return True
    away = np.linalg.inv(a.T_base_object) @ b.T_base_object
    turn = math.acos(min(1.0, max(-1.0, (float(np.trace(away[:3, :3])) - 1) / 2)))
    return bool(np.linalg.norm(away[:3, 3]) < OBJECT_MM) and turn < OBJECT_RAD


def _matrix(pose: SensorPose | ArrayLike) -> Array:
    try:
        T = np.asarray(pose.T_base_sensor if isinstance(pose, SensorPose) else pose, np.float64)
    except (TypeError, ValueError):
        T = np.empty(0)  # no numbers
    if T.shape != (4, 4) or np.isnan(T).any() or not are_rigid(T[None]):
        raise MosaicError(
            "the pose is no rigid transform", fix="give a 4x4 matrix T_base_sensor, mm"
        )
    return T


def _inverse(T: Array) -> Array:
    return np.asarray(np.linalg.inv(T), np.float64)
