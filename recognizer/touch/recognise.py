"""Signal -> Recognition: the stages of reading, one after another. Thesis 6.

    signal     forces and trust
    symbols    a few lattices with the scores of all cells
    hypothesis the places of the database that they can be
    verify     the best of them again, with the registered symbols
    pose       where the sensor stands on the face and on the object

An answer is given only if no other place explains the image nearly as well, if it explains the
image better than symbols of no registered place, if the sensor's centre lies on the face, and if
random symbols would hardly match any place as well (`verdict`). A first search is followed by a
wide one where that may change the answer (`search_gate`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from recognizer.touch.as_built import DESIGNED
from recognizer.touch.chance import (
    expected_by_border,
    expected_matches,
    place_bits,
    points_on_face,
)
from recognizer.touch.diagnose import diagnose
from recognizer.touch.evidence import VerifiedHypothesis
from recognizer.touch.hypothesis import Hypothesis, under_centre
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.next_touch import propose_next
from recognizer.touch.options import ReaderOptions
from recognizer.touch.pose import face_covariance, face_pose, felt_scale, inside_mm, pose_on_object
from recognizer.touch.prepare import PreparedLab
from recognizer.touch.recognition import (
    AMBIGUOUS,
    AS_DESIGNED,
    EXCHANGED,
    NO_CONTACT,
    NOT_ENCODED,
    OUTSIDE,
    TOO_FEW,
    TOO_FINE,
    Cause,
    Recognition,
    RunnerUp,
    refusal,
)
from recognizer.touch.search_gate import BARE, is_nearly_chance, may_find_more, shows_strokes
from recognizer.touch.signal import Signal, mean_of_strongest, swap_halves
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.template import STROKE_UNIT_MM
from recognizer.touch.verdict import (
    least_margin,
    may_count_border,
    reject_chance,
    reject_reason,
)
from recognizer.touch.verify import TouchImages, verify_hypotheses

#: Doubt up to which a wide search confirms an answer that chance nearly allows. A wrong soft one of
#: 20,000 touches had 8e-5 and 7 nats at first and .006 then; of 1,074 right soft ones (seed 1301)
#: 72 are looked at, all below 6e-4 then.
CONFIRMED_DOUBT = 1e-3

# Which answers are read again with the halves of the sensor swapped. Of 600 touches of all kinds
# (own engine, seed 6164) ten are, of 300 at a part beside and of worn faces (6168) 99: none of
# their answers changes. Of 1,500 touches of swapped halves (6166, 6167) 12 were wrong with a
# `BEYOND` of .15 and without `WORN`; one is, whose other half is hardly pressed.
PRESSED = 0.2  #: share of the strongest readings from which a tactel is pressed
BEYOND_MM = 1.5  #: from the outline of the face, for a tactel to lie beyond it
BEYOND = 0.03  #: share of the pressed tactels that do
WORN = 0.35  #: symbols that are not felt, to one that is
#: Nats over symbols of no registered place, and ... (of 545 answers at edges and amid faces, seeds
#: 1902 and 1903, none is explained so poorly, of worn ones a third)
POOR_RATIO = 25.0
POORLY_EXPLAINED = 0.86  #: ... share of the image, below which symbols explain it poorly
SOFT = 30.0  #: times the noise up to which the strongest are weak, and that is why


@dataclass(frozen=True, slots=True, eq=False)
class TouchReading:
    """Answer and possible places of one touch."""

    answer: Recognition
    found: list[VerifiedHypothesis]  #: places that it may be, first of them the one that was judged
    touch: TouchImages

    @property
    def best(self) -> VerifiedHypothesis | None:
        """The place that was judged; None where there is none."""
        return self.found[0] if self.found else None


def recognise(reader: PreparedLab, signal: Signal, seq: int = 0) -> Recognition:
    """Return the answer of one touch, and where to touch next if that is not enough."""
    reading = read_touch(reader, signal, seq)
    answer = reading.answer
    cause = answer.cause if answer or answer.cause else diagnose(reading.touch, reading.found)
    hopeless = cause is not None and cause.code == TOO_FINE
    step = None if hopeless else propose_next(reader, signal, answer, reading.found)
    return replace(answer, next=step, cause=cause)


def read_touch(reader: PreparedLab, signal: Signal, seq: int = 0) -> TouchReading:
    """Return the answer of one touch, and its possible places."""
    touch = TouchImages(reader, signal)
    answer, found = _search_twice(touch, seq)
    swapped = _swapped_halves(touch, found[0]) if answer else None
    if swapped is not None:
        answer = replace(refusal(seq, AMBIGUOUS, margin=0.0), cause=swapped)
    return TouchReading(answer, found, touch)


def _search_twice(touch: TouchImages, seq: int) -> tuple[Recognition, list[VerifiedHypothesis]]:
    """Return the answer of a first search, or of a wide one where that may change it."""
    if not touch.signal.contact:
        return refusal(seq, NO_CONTACT), []
    if not shows_strokes(touch.reader, touch.signal, BARE):
        return refusal(seq, NOT_ENCODED), []
    options = touch.reader.options
    first = verify_hypotheses(touch, options.first)
    answer = _best_answer(first, options, seq)
    judged = _judge(touch.reader, first, answer)
    best = first[0] if first else None
    if not may_find_more(touch.reader, touch.signal, answer, judged, best):
        if judged and is_nearly_chance(judged):
            return _confirm(touch, judged, first)
        return judged, first
    second = verify_hypotheses(touch, options.thorough)
    final = _best_answer(second, options, seq)
    if answer and final and not first[0].coincides(second[0]):
        return refusal(seq, AMBIGUOUS, margin=0.0, runner_up=answer.runner_up), second
    return _judge(touch.reader, second, final), second


def _confirm(
    touch: TouchImages, answer: Recognition, first: list[VerifiedHypothesis]
) -> tuple[Recognition, list[VerifiedHypothesis]]:
    """Return an answer that chance nearly allows, or a refusal where a wide search contradicts it.

    A first search may miss the true place of a soft touch, or of a bad print, and keep another one
    whose pose and gain happen to fit.
    """
    second = verify_hypotheses(touch, touch.reader.options.thorough)
    if not second or not first[0].coincides(second[0]):
        return refusal(answer.seq, AMBIGUOUS, margin=0.0, runner_up=answer.runner_up), second
    doubt = _doubt_of(touch.reader, second[0], _margin_of(answer))
    if not reject_chance(doubt, CONFIRMED_DOUBT):
        return answer, first
    limit = min(CONFIRMED_DOUBT, touch.reader.options.doubt)
    return judge_chance(touch.reader, second[0].embossed, answer, doubt, limit), second


def _best_answer(found: list[VerifiedHypothesis], options: ReaderOptions, seq: int) -> Recognition:
    """Return the answer of hypotheses, best first, before chance is considered.

    A place one pitch off is one place up to a cell's rounding and leaves the margin, unless it
    explains the image nearly as well: where fewer cells are seen than the array's window takes
    (large pitches, product arrays), or next to an edge.
    """
    if not found:
        return refusal(seq, TOO_FEW)
    best = found[0]
    other = next((one for one in found[1:] if not best.same_place(one)), None)
    margin = math.inf if other is None else best.score - other.score
    adjacent = next((one for one in found[1:] if not best.coincides(one)), None)
    nearest = margin
    if adjacent is not None and best.score - adjacent.score < options.margin_by_few:
        nearest = min(margin, best.score - adjacent.score)
    evidence = best.evidence
    reason = reject_reason(evidence, nearest, least_margin(evidence.bits, options))
    if reason in ("", AMBIGUOUS):
        margin = nearest
    return answer_at(
        best.embossed, best.fit if reason else best.last_fit(), best.hypothesis, options, seq,
        reason=reason, margin=margin, runner_up=None if other is None else other.runner_up,
    )  # fmt: skip


def _judge(
    reader: PreparedLab, found: list[VerifiedHypothesis], answer: Recognition
) -> Recognition:
    """Return an answer with its doubt, or its refusal for chance; a refusal as it is."""
    if not answer:
        return answer
    doubt = _doubt_of(reader, found[0], _margin_of(answer))
    return judge_chance(reader, found[0].embossed, answer, doubt, reader.options.doubt)


def judge_chance(
    reader: PreparedLab, embossed: EmbossedArray, answer: Recognition, doubt: float, limit: float
) -> Recognition:
    """Return an answer with its doubt and its bits, or its refusal with the bits that it misses."""
    reason = reject_chance(doubt, limit)
    if reason:
        answer = refusal(answer.seq, reason, margin=answer.margin, runner_up=answer.runner_up)
    return replace(
        answer,
        doubt=doubt,
        bits=place_bits(reader.lab.arrays, embossed, doubt),
        bits_missing=math.log2(doubt / limit) if reason else None,
    )


def _margin_of(answer: Recognition) -> float:
    return math.inf if answer.margin is None else answer.margin


def _doubt_of(reader: PreparedLab, best: VerifiedHypothesis, margin: float) -> float:
    """Return how many places a foreign surface matches as well, by its border where that counts."""
    arrays, overlay = reader.lab.arrays, reader.sensor.overlay
    doubt = expected_matches(arrays, best.embossed, best.fit, best.hypothesis)
    # a pad or a gel hides where a face ends
    if (
        overlay.kind == "tab"
        and reject_chance(doubt, reader.options.doubt)
        and may_count_border(best.evidence, margin, reader.options)
    ):
        doubt = min(doubt, expected_by_border(arrays, best, overlay.tab_diameter_mm))
    return doubt


def _swapped_halves(touch: TouchImages, best: VerifiedHypothesis) -> Cause | None:
    """Return which halves of the sensor seem swapped, as the touch then reads better; or None.

    Tried where the answer leaves a large residual; not for a learned sensor, whose wiring is known.
    """
    reader, signal = touch.reader, touch.signal
    if reader.sensor.overlay.kind != "tab" or signal.state is not None:
        return None
    if not has_residual(best):
        return None
    for axis in (0, 1):
        swapped = replace(
            signal, forces=swap_halves(signal.forces, axis), trust=swap_halves(signal.trust, axis)
        )
        found = verify_hypotheses(TouchImages(reader, swapped), reader.options.first)
        answer = _judge(reader, found, _best_answer(found, reader.options, 0))
        if answer and found[0].score > best.score:
            return Cause(EXCHANGED, {"columns": float(axis)})
    return None


def has_residual(found: VerifiedHypothesis) -> bool:
    """Return whether a place leaves much of a touch unexplained, and not because it is soft.

    Tactels are pressed beyond the face, many of its symbols are not felt, or they explain the image
    poorly. Another part may stand there, symbols may be worn, or the halves of the sensor are
    swapped (`recognizer.sensor.wiring`).
    """
    evidence, image = found.evidence, found.image
    if evidence.worn >= WORN * evidence.inliers:
        return True
    forces = image.forces * image.trust
    strongest = mean_of_strongest(forces)
    poorly = evidence.log_likelihood_ratio < POOR_RATIO and evidence.explained < POORLY_EXPLAINED
    if poorly and strongest >= SOFT * image.noise:
        return True
    face = found.face
    if face.round is not None:
        return False
    points = points_on_face(found, face)[forces > PRESSED * strongest]
    outside = points[~face.region.contains(points)]
    least = BEYOND * len(points)
    if len(outside) < least:
        return False
    return bool((face.region.distance_mm(outside) > BEYOND_MM).sum() >= least)


def answer_at(
    embossed: EmbossedArray,
    fit: Fit,
    hypothesis: Hypothesis,
    options: ReaderOptions,
    seq: int,
    *,
    reason: str,
    margin: float,
    runner_up: RunnerUp | None,
) -> Recognition:
    """Return the answer at a place, or the refusal where there is a reason or no face.

    The pose is that on the printed part, as far as its print is known.
    """
    if reason:
        return refusal(seq, reason, margin=margin, runner_up=runner_up)
    face = embossed.face(hypothesis.face)
    pose = face_pose(embossed, face, hypothesis, fit)
    inside = inside_mm(face, float(pose[0, 3]), float(pose[1, 3]))
    if inside < -options.rim_mm:
        return refusal(seq, OUTSIDE, margin=margin, runner_up=runner_up)
    covariance, part = face_covariance(face, fit.covariance), AS_DESIGNED
    if face.printed is not None:
        felt = felt_scale(face, fit, options.scale_sd)
        printed = replace(face.printed, as_built=DESIGNED) if options.as_designed else face.printed
        pose, covariance = printed.pose(pose, covariance, felt)
        part = printed.part
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
        stroke_mm=embossed.style.stroke_mm + fit.stroke_excess * STROKE_UNIT_MM,
        inside_mm=inside if face.round is None else None,
        part=part,
    )
