"""Frame -> Recognition: the stages of reading, one after another. Thesis 6.

    signal     forces and trust
    symbols    a few lattices with the scores of all cells
    locate     the places of the database that they can be
    verify     the best of them again, with the symbols that the database says are there
    pose       where the sensor stands on the face and on the object

The answer is given only if no other place explains the image nearly as well, if it explains
the image better than a surface with symbols of no registered place, and if the sensor's
centre lies on the face.
"""

from __future__ import annotations

import math

from recognizer.touch.belief import Thresholds, naming
from recognizer.touch.lab import Encoding
from recognizer.touch.locate import Place, under_centre
from recognizer.touch.pose import face_covariance, face_pose, inside_mm, pose_on_object
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import (
    AMBIGUOUS,
    NO_CONTACT,
    NOT_ENCODED,
    OUTSIDE,
    TOO_FEW,
    Recognition,
    RunnerUp,
    refused,
)
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.verify import Reading, index_of, readings, same_place


def recognise(reader: Reader, signal: Signal, seq: int = 0) -> Recognition:
    """Return what one touch says."""
    return explained(reader, signal, seq)[0]


def explained(reader: Reader, signal: Signal, seq: int = 0) -> tuple[Recognition, Reading | None]:
    """Return what one touch says, and the reading that was judged; None where there is none."""
    if not signal.contact:
        return refused(seq, NO_CONTACT), None
    found = readings(reader, signal, reader.settings)
    answer, cells = _answer(reader, found, seq)
    if answer and cells >= reader.thresholds.many:
        return answer, found[0]
    # Spend more where it is needed: no answer yet, or one that few cells speak for.
    again = readings(reader, signal, reader.thorough)
    second, cells = _answer(reader, again, seq)
    if answer and second and not same_place(found[0], again[0]):
        return refused(seq, AMBIGUOUS, margin=0.0, runner_up=answer.runner_up), again[0]
    if second and cells < reader.thresholds.many:
        second = _by_few(reader.thresholds, again[0].encoding, second, cells)
    return second, again[0] if again else None


def _answer(reader: Reader, found: list[Reading], seq: int) -> tuple[Recognition, int]:
    """Return what readings, best first, say together, and how many cells speak for it."""
    if not found:
        return refused(seq, TOO_FEW), 0
    best = found[0]
    other = next((r for r in found[1:] if not same_place(best, r)), None)
    margin = math.inf if other is None else best.score - other.score
    runner_up = None
    if other is not None:
        face = other.encoding.face(other.place.face)
        runner_up = RunnerUp(face.object, face.face, index_of(other))
    limits, speaks = reader.thresholds, best.support()
    reason = ""
    if not speaks.holds(limits):
        reason = NOT_ENCODED
    elif speaks.cells < limits.cells:
        reason = TOO_FEW
    elif margin < limits.margin:
        reason = AMBIGUOUS
    told = placed(
        best.encoding, best.fit, best.place, limits, seq,
        reason=reason, margin=margin, runner_up=runner_up,
    )  # fmt: skip
    return told, speaks.cells


def _by_few(limits: Thresholds, encoding: Encoding, told: Recognition, cells: int) -> Recognition:
    """Return an answer that few cells speak for, if they can name a place and do so plainly."""
    reason = ""
    if cells < naming(encoding):
        reason = TOO_FEW
    elif told.margin is not None and told.margin < limits.margin_by_few:
        reason = AMBIGUOUS
    if not reason:
        return told
    return refused(told.seq, reason, margin=told.margin, runner_up=told.runner_up)


def placed(
    encoding: Encoding,
    fit: Fit,
    place: Place,
    limits: Thresholds,
    seq: int,
    *,
    reason: str,
    margin: float,
    runner_up: RunnerUp | None,
) -> Recognition:
    """Return the answer at a place, or the refusal where there is a reason or no face."""
    if reason:
        return refused(seq, reason, margin=margin, runner_up=runner_up)
    face = encoding.face(place.face)
    pose = face_pose(encoding, face, place, fit)
    if inside_mm(face, float(pose[0, 3]), float(pose[1, 3])) < -limits.rim_mm:
        return refused(seq, OUTSIDE, margin=margin, runner_up=runner_up)
    return Recognition(
        seq=seq,
        object=face.object,
        face=face.face,
        index=under_centre(encoding, fit, place),
        T_face_probe=pose,
        T_object_probe=pose_on_object(face, pose),
        covariance=face_covariance(face, fit.covariance),
        margin=margin,
        runner_up=runner_up,
        reason="",
        noise=fit.noise,
    )
