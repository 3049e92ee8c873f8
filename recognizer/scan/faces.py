"""Touches of several faces of one object: what each face's touches say of the object, joined.

Beliefs of faces (`grow.ScanBelief`) -> the answer of one of them, as all of them have it. Each
place that the touches of a face may be says which object it is and, where the probe's motion is
known, where the object lies. A place loses what the touches of every other face say against an
object there, up to a bound: the object may have been changed in between. So what one face leaves
open another one decides, and two faces that leave it open may decide it together. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.answer import LocatedComposite
from recognizer.scan.belief import ScanBelief
from recognizer.scan.settings import ScanSettings
from recognizer.touch.pose import face_pose, pose_on_object
from recognizer.touch.recognise import answer_at
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, Recognition, RunnerUp

Array = NDArray[np.float64]

_OPEN = (AMBIGUOUS, BY_CHANCE)  #: reasons of touches that leave a choice of registered places


@dataclass(frozen=True, slots=True, eq=False)
class TouchedFace:
    """The belief of one face, and where its last touch was."""

    belief: ScanBelief
    T_base_probe: Array | None  #: (4, 4); None: nobody knows


@dataclass(frozen=True, slots=True, eq=False)
class ObjectHypothesis:
    """What a place of a face says of the object."""

    object: str
    T_base_object: Array | None  #: (4, 4); None: nobody knows where the probe was
    score: float  #: nats below the likeliest place of that face, 0 or less


def join_faces(last: TouchedFace, others: Sequence[TouchedFace]) -> Recognition:
    """Return what the last touch says, as the touches of other faces have it.

    Parameters
    ----------
    last
        Whose belief's answer is given; `others` decide where it leaves a choice.
    """
    belief, limits = last.belief, last.belief.settings
    answer = belief.recognition
    if answer or answer.reason not in _OPEN or not belief.places:
        return answer
    told = [hypotheses_of(other) for other in others]
    told = [each for each in told if each]
    if not told:
        return answer
    joined = []
    for place in belief.places:
        own = _hypothesis_at(place, 0.0, last.T_base_probe)
        against = sum(_said_against(own, each, limits) for each in told)
        joined.append((place.score - against, place))
    joined.sort(key=lambda item: -item[0])
    best, rest = joined[0], joined[1:]
    margin = math.inf if not rest else best[0] - rest[0][0]
    settings = belief.reader.settings
    own = _hypothesis_at(best[1], 0.0, last.T_base_probe)
    alone = all(_said_against(own, each, limits) >= limits.changed for each in told)
    if margin < settings.belief.margin or alone:
        return answer
    runner_up = RunnerUp(*rest[0][1].face, rest[0][1].index) if rest else None
    found = answer_at(
        best[1].encoding, best[1].fit, best[1].place, settings, answer.seq,
        reason="", margin=margin, runner_up=runner_up,
    )  # fmt: skip
    return replace(found, next=None) if found else answer


def hypotheses_of(face: TouchedFace) -> list[ObjectHypothesis]:
    """Return what the touches of a face say of the object, likeliest first; none if nothing."""
    belief = face.belief
    answer = belief.recognition
    if answer and answer.object is not None and answer.T_object_probe is not None:
        at = _base_object(face.T_base_probe, answer.T_object_probe)
        return [ObjectHypothesis(answer.object, at, 0.0)]
    if answer.reason not in _OPEN:
        return []
    return [
        _hypothesis_at(place, place.score - belief.places[0].score, face.T_base_probe)
        for place in belief.places
    ]


def contradict(a: TouchedFace, b: TouchedFace, limits: ScanSettings) -> bool:
    """Whether two faces that are both answered exclude each other: the object was changed."""
    if not (a.belief.recognition and b.belief.recognition):
        return False
    one, other = hypotheses_of(a)[0], hypotheses_of(b)[0]
    return not _is_one_object(one, other, limits)


def _hypothesis_at(
    place: LocatedComposite, score: float, T_base_probe: Array | None
) -> ObjectHypothesis:
    face = place.encoding.face(place.place.face)
    pose = face_pose(place.encoding, face, place.place, place.fit)
    at = _base_object(T_base_probe, pose_on_object(face, pose))
    return ObjectHypothesis(face.object, at, score)


def _base_object(T_base_probe: Array | None, T_object_probe: Array) -> Array | None:
    if T_base_probe is None:
        return None
    return np.asarray(T_base_probe @ np.linalg.inv(T_object_probe))


def _said_against(
    one: ObjectHypothesis, told: Sequence[ObjectHypothesis], limits: ScanSettings
) -> float:
    """Return by how many nats the touches of another face speak against an object."""
    agreeing = [-other.score for other in told if _is_one_object(one, other, limits)]
    return min([*agreeing, limits.changed])


def _is_one_object(a: ObjectHypothesis, b: ObjectHypothesis, limits: ScanSettings) -> bool:
    """Whether two faces may be of one object in one place."""
    if a.object != b.object:
        return False
    if a.T_base_object is None or b.T_base_object is None:
        return True
    away = np.linalg.inv(a.T_base_object) @ b.T_base_object
    turn = math.acos(min(1.0, max(-1.0, (float(np.trace(away[:3, :3])) - 1) / 2)))
    return bool(np.linalg.norm(away[:3, 3]) < limits.object_mm) and turn < limits.object_rad
