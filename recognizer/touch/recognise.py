"""Frame -> Recognition: the stages of reading, one after another. Thesis 6.

    signal     forces and trust
    symbols    a few lattices with the scores of all cells
    locate     the places of the database that they can be
    verify     the best of them again, with the symbols that the database says are there
    pose       where the sensor stands on the face and on the object

The answer is given only if no other place explains the image nearly as well, if it explains
the image better than a surface with symbols of no registered place, if the sensor's centre
lies on the face, and if symbols drawn at random would hardly match any place as well (`chance`).
"""

from __future__ import annotations

import math
from dataclasses import replace

from recognizer.touch.belief import VerifiedHypothesis
from recognizer.touch.cause import EXCHANGED, Cause
from recognizer.touch.chance import expected_by_border, expected_matches
from recognizer.touch.diagnose import diagnose
from recognizer.touch.exchanged import exchange_halves, leaves_much
from recognizer.touch.first_look import may_be_chance, may_tell_more
from recognizer.touch.hypothesis import Hypothesis, under_centre
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.next_touch import propose_next
from recognizer.touch.pose import (
    face_covariance,
    face_pose,
    felt_scale,
    inside_mm,
    pose_on_object,
)
from recognizer.touch.prepare import PreparedLab
from recognizer.touch.recognition import (
    AMBIGUOUS,
    NO_CONTACT,
    OUTSIDE,
    TOO_FEW,
    Recognition,
    RunnerUp,
    refusal,
)
from recognizer.touch.settings import ReaderSettings
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.verdict import (
    Evidence,
    may_count_border,
    reject_chance,
    reject_few,
    reject_reason,
)
from recognizer.touch.verify import verify_hypotheses


def recognise(reader: PreparedLab, signal: Signal, seq: int = 0) -> Recognition:
    """Return what one touch says, and where to touch next if that is not enough."""
    answer, found = recognise_with_rivals(reader, signal, seq)
    cause = answer.cause if answer or answer.cause else diagnose(reader, signal, found)
    return replace(answer, next=propose_next(reader, signal, answer, found), cause=cause)


def recognise_with_hypothesis(
    reader: PreparedLab, signal: Signal, seq: int = 0
) -> tuple[Recognition, VerifiedHypothesis | None]:
    """Return what one touch says, and the hypothesis that was judged; None where there is none."""
    answer, found = recognise_with_rivals(reader, signal, seq)
    return answer, found[0] if found else None


def recognise_with_rivals(
    reader: PreparedLab, signal: Signal, seq: int = 0
) -> tuple[Recognition, list[VerifiedHypothesis]]:
    """Return what a touch says, and all hypotheses, first of them the one that was judged."""
    answer, found = _try_twice(reader, signal, seq)
    exchanged = _read_exchanged(reader, signal, found[0]) if answer else None
    if exchanged is not None:
        return replace(refusal(seq, AMBIGUOUS, margin=0.0), cause=exchanged), found
    return answer, found


def _try_twice(
    reader: PreparedLab, signal: Signal, seq: int
) -> tuple[Recognition, list[VerifiedHypothesis]]:
    """Return what the first try says, or the second where that is not enough."""
    if not signal.contact:
        return refusal(seq, NO_CONTACT), []
    settings = reader.settings
    first = verify_hypotheses(reader, signal, settings.first)
    answer, evidence = _answer(first, settings, seq)
    judged = _judge(reader, first, answer, evidence)
    if not may_tell_more(reader, signal, answer, judged, first[0] if first else None, evidence):
        if judged and evidence is not None and may_be_chance(reader, judged, evidence):
            return _look_again(reader, signal, judged, first)
        return judged, first
    # Spend more where it is needed: no answer yet, or one that few cells speak for.
    second = verify_hypotheses(reader, signal, settings.thorough)
    final, evidence = _answer(second, settings, seq)
    if answer and final and not first[0].coincides(second[0]):
        return refusal(seq, AMBIGUOUS, margin=0.0, runner_up=answer.runner_up), second
    return _judge(reader, second, final, evidence), second


def _look_again(
    reader: PreparedLab, signal: Signal, answer: Recognition, first: list[VerifiedHypothesis]
) -> tuple[Recognition, list[VerifiedHypothesis]]:
    """Return an answer that chance nearly allows, or the refusal where a wide search takes it back.

    A soft touch may hold the true place too weakly for a first search, and another one whose pose
    and gain happen to fit.
    """
    second = verify_hypotheses(reader, signal, reader.settings.thorough)
    margin, runner_up = answer.margin, answer.runner_up
    if not second or not first[0].coincides(second[0]):
        return refusal(answer.seq, AMBIGUOUS, margin=0.0, runner_up=runner_up), second
    doubt = _doubt_of(reader, second[0], answer)
    reason = reject_chance(doubt, reader.settings.belief.doubt_again)
    if not reason:
        return answer, first
    return refusal(answer.seq, reason, margin=margin, runner_up=runner_up, doubt=doubt), second


def _read_exchanged(reader: PreparedLab, signal: Signal, best: VerifiedHypothesis) -> Cause | None:
    """Return which halves of the sensor seem exchanged, as a touch is read better so; None if none.

    Asked where its answer leaves much of it over; not of a sensor that was learned, which tells.
    """
    settings = reader.settings
    if reader.sensor.overlay.kind != "tab" or signal.state is not None:
        return None
    if not leaves_much(best, settings.exchanged):
        return None
    for axis in (0, 1):
        found = verify_hypotheses(reader, exchange_halves(signal, axis), settings.first)
        answer, evidence = _answer(found, settings, 0)
        if _judge(reader, found, answer, evidence) and found[0].score > best.score:
            return Cause(EXCHANGED, {"columns": float(axis)})
    return None


def _answer(
    found: list[VerifiedHypothesis], settings: ReaderSettings, seq: int
) -> tuple[Recognition, Evidence | None]:
    """Return the answer of hypotheses, best first, and the evidence for the best; None of none.

    A place one pitch beside is the same place up to a cell's rounding and tells nothing of the
    margin, but for one case: it explains the image nearly as well. So it does where fewer cells
    are seen than the array's window takes (large pitches, product arrays), or next to an edge.
    """
    if not found:
        return refusal(seq, TOO_FEW), None
    best, limits = found[0], settings.belief
    other = next((one for one in found[1:] if not best.same_place(one)), None)
    margin = math.inf if other is None else best.score - other.score
    runner_up = None
    if other is not None:
        face = other.embossed.face(other.hypothesis.face)
        runner_up = RunnerUp(face.object, face.face, other.index)
    evidence = best.evidence()
    adjacent = next((one for one in found[1:] if not best.coincides(one)), None)
    nearest = margin
    if adjacent is not None and best.score - adjacent.score < limits.margin_by_few:
        nearest = min(margin, best.score - adjacent.score)
    reason = reject_reason(evidence, nearest, limits)
    if reason in ("", AMBIGUOUS):
        margin = nearest
    answer = answer_at(
        best.embossed, best.fit if reason else best.last_fit(), best.hypothesis, settings, seq,
        reason=reason, margin=margin, runner_up=runner_up,
    )  # fmt: skip
    return answer, evidence


def _judge(
    reader: PreparedLab,
    found: list[VerifiedHypothesis],
    answer: Recognition,
    evidence: Evidence | None,
) -> Recognition:
    """Return an answer with its doubt, or as refused: for few symbols, or for chance."""
    if not answer or evidence is None:
        return answer
    settings, best, doubt = reader.settings, found[0], None
    margin = math.inf if answer.margin is None else answer.margin
    matches = expected_matches(
        reader.lab.arrays, best.embossed, best.fit, best.hypothesis, settings, borders=False
    )
    reason = reject_few(evidence, margin, matches, settings.belief)
    if not reason:
        doubt = _doubt_of(reader, best, answer)
        reason = reject_chance(doubt, settings.belief.doubt)
    if not reason:
        return replace(answer, doubt=doubt)
    return refusal(answer.seq, reason, margin=margin, runner_up=answer.runner_up, doubt=doubt)


def _doubt_of(reader: PreparedLab, best: VerifiedHypothesis, answer: Recognition) -> float:
    """Return how many places a foreign surface matches as well, by its border where that counts."""
    settings, arrays = reader.settings, reader.lab.arrays
    doubt = expected_matches(arrays, best.embossed, best.fit, best.hypothesis, settings)
    tabs = reader.sensor.overlay.kind == "tab"  # a pad or a gel hides where a face ends
    margin = math.inf if answer.margin is None else answer.margin
    if (
        tabs
        and reject_chance(doubt, settings.belief.doubt)
        and may_count_border(best.evidence(), margin, settings.belief)
    ):
        tip_mm = reader.sensor.overlay.tab_diameter_mm
        doubt = min(doubt, expected_by_border(arrays, best, tip_mm, settings))
    return doubt


def answer_at(
    embossed: EmbossedArray,
    fit: Fit,
    hypothesis: Hypothesis,
    settings: ReaderSettings,
    seq: int,
    *,
    reason: str,
    margin: float,
    runner_up: RunnerUp | None,
) -> Recognition:
    """Return the answer at a place, or the refusal where there is a reason or no face.

    The pose is that on the printed part, as far as it is known how that came out.
    """
    if reason:
        return refusal(seq, reason, margin=margin, runner_up=runner_up)
    face = embossed.face(hypothesis.face)
    pose = face_pose(embossed, face, hypothesis, fit)
    inside = inside_mm(face, float(pose[0, 3]), float(pose[1, 3]))
    if inside < -settings.belief.rim_mm:
        return refusal(seq, OUTSIDE, margin=margin, runner_up=runner_up)
    covariance = face_covariance(face, fit.covariance)
    if face.printed is not None:
        felt = felt_scale(face, fit, settings.refine.prior[-1])
        pose, covariance = face.printed.pose(pose, covariance, felt)
    return Recognition(
        seq=seq,
        object=face.object,
        face=face.face,
        index=under_centre(embossed, fit, hypothesis),
        T_face_probe=pose,
        T_object_probe=pose_on_object(face, pose),
        covariance=covariance,
        margin=margin,
        runner_up=runner_up,
        reason="",
        noise=fit.noise,
        scale=fit.scale,
        stroke_mm=embossed.style.stroke_mm + fit.stroke_excess * settings.template.wider_mm,
        inside_mm=inside if face.round is None else None,
    )
