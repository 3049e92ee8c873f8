"""The belief of one face: its touches, their accumulated evidence and the answer. Thesis 6.3.

`extend_scan` adds a touch. Where the image matches a predicted pose, the touch is taken there;
otherwise it is read by itself first. Its lattices join those of the other touches, and the evidence
of all touches is located in the database like the fit of one touch (`find_hypotheses`): its
strongest cells list places, all cells compare them. The pose of the last touch is fitted once more
with the registered symbols. `recognizer.touch.verdict` judges all cells together; more of them may
contradict than in one touch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.lattice import (
    LEAST_VARIANCE,
    LatticeEvidence,
    PlaneLattice,
    accumulate,
    predict_pose,
    predicted_fit,
    refine_agreement,
    same_lattice,
    seed_lattice,
)
from recognizer.scan.mosaic.planar import FIRST_SD, PlacedTouch, planar_belief, relative_pose
from recognizer.scan.path import RegisteredPath, follow_path, known_steps
from recognizer.scan.views import (
    LatticeView,
    LatticeViews,
    TouchPoses,
    estimate_poses,
    flat_views,
    is_definite,
    is_unmeasured,
    position_sd_mm,
    predicted_view,
    round_views,
    stack_views,
)
from recognizer.touch import verdict
from recognizer.touch.chance import expected_matches
from recognizer.touch.evidence import (
    VerifiedHypothesis,
    bits_of,
    null_log_likelihood,
    unworn_labels_at,
    weigh_cells,
)
from recognizer.touch.hypothesis import (
    PlaceHypothesis,
    find_hypotheses,
    find_rivals,
    log_likelihood,
)
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.next_touch import propose_next
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import answer_at, judge_chance, read_touch
from recognizer.touch.recognition import (
    AMBIGUOUS,
    NO_CONTACT,
    NOT_ENCODED,
    TOO_FEW,
    Recognition,
    refusal,
)
from recognizer.touch.symbols.fit import refine_lattices, score_cells
from recognizer.touch.symbols.image import Image, bend_image
from recognizer.touch.symbols.posterior import explained_share, refit_pose
from recognizer.touch.verdict import Face, least_explained, reject_joined
from recognizer.touch.verify import SHARES, curvature_at

Array = NDArray[np.float64]
Views = tuple[tuple[LatticeView, ...], ...]  #: of each touch

FOLLOWED = 6  #: lattices of the plane
CUT_OFF_NATS = 40.0  #: below the best lattice, from which one is dropped
PREDICTING = 2  #: lattices whose predictions a touch is fitted to
MOST_NOISE = 0.4  #: standard deviation of psi, beyond which a touch shows no symbols
MOST_OUTLIERS = 3  #: touches in a row that may disagree while the answer holds

LOCATED = 3  #: lattices that are looked up
STRONGEST = 16  #: cells by which places are listed
PLACES = 6  #: of every lattice that are compared by all cells
STEPS = 3  #: of the last touch's pose with the symbols of the database
WRONG = 0.05  #: share of the cells that may clearly contradict the place
#: expected matches by chance; a lab of a profile for scans has fewer symbols than one touch of
#: another profile can distinguish
DOUBT = 2e-2
RATIO_BY_HAND = 8.0  #: nats over symbols of no registered place, without measured steps


@dataclass(frozen=True, eq=False)
class ScanHypothesis(PlaceHypothesis):
    """A place of accumulated evidence, its fit with the pose of the last touch."""

    evidence: LatticeEvidence
    explained: float = math.nan  #: share of the last image's variance; NaN: not computed
    path: RegisteredPath | None = None  #: None: the motion was measured


@dataclass(frozen=True, slots=True, eq=False)
class ScanBelief:
    """The touches of one face and their answer; `extend_scan` returns the next value."""

    reader: Reader
    touches: tuple[PlacedTouch, ...]  #: those with contact
    touch_poses: TouchPoses | None
    views: tuple[Views, ...]  #: of each array
    lattices: tuple[tuple[PlaneLattice, ...], ...]  #: of each array, best first
    recognition: Recognition  #: with the probe's pose at the last touch
    places: tuple[ScanHypothesis, ...] = ()  #: likely places of the face, best first
    outlier_run: int = 0  #: touches in a row that disagree with the others
    confirmed_face: Face | None = None  #: by at least one consistent touch
    resets: int = 0  #: how often inconsistent touches began a new belief

    @property
    def best(self) -> ScanHypothesis | None:
        """The likeliest place, accepted or not."""
        return self.places[0] if self.places else None


def begin_scan(reader: Reader) -> ScanBelief:
    """Return a scan without touches."""
    none: tuple[tuple[()], ...] = tuple(() for _ in reader.prepared)
    return ScanBelief(reader, (), None, none, none, refusal(0, TOO_FEW))


def extend_scan(scan: ScanBelief, touch: PlacedTouch) -> ScanBelief:
    """Return a scan with one touch added.

    A touch without contact is refused and not kept. A touch with an answer of its own that
    contradicts the prediction begins a new belief: the probe or the object slipped, or the object
    was changed.

    Raises
    ------
    MosaicError
        Another sensor's image, or a touch without a frame.
    """
    reader = scan.reader
    if not touch.signal.contact:
        answer = refusal(touch.seq, NO_CONTACT)
        step = propose_next(reader, touch.signal, answer, ())
        return replace(scan, recognition=replace(answer, next=step))
    touches = (*scan.touches, replace(touch, decoded=None))
    finest = min(embossed.style.pitch_mm for embossed in reader.lab.arrays)
    by_hand = any(is_unmeasured(each, finest) for each in touches)
    poses = None if by_hand else estimate_poses(reader, touches, scan.touch_poses)
    joined = _join_touch(scan, touches, poses, use_prediction=not by_hand)
    if joined.alone is None and not joined.agrees:  # the prediction fails: read the touch alone
        joined = _join_touch(scan, touches, poses, use_prediction=False)
    answer, agrees, alone = joined.answer, joined.agrees, joined.alone
    if alone and scan.touches and answer and not _is_one_place(answer, alone, finest):
        if scan.confirmed_face is not None:
            return _reset(scan, touch)
        alone = answer = refusal(touch.seq, AMBIGUOUS, margin=answer.margin)
    if alone and not answer and scan.confirmed_face is not None:  # the others contradict it
        return _reset(scan, touch)
    if alone is not None and not answer and (alone or not scan.touches):
        answer, agrees = alone, agrees or bool(alone)
    run = 0 if agrees or len(touches) == 1 else scan.outlier_run + 1
    if scan.confirmed_face is not None and not by_hand and run > MOST_OUTLIERS:
        return _reset(scan, *touches[-run:])
    answer, confirmed = _accept(scan, answer, run, 0 if by_hand else MOST_OUTLIERS)
    own = not agrees and bool(joined.rivals)
    rivals: Sequence[PlaceHypothesis] = joined.rivals if own else joined.found
    away = relative_pose(joined.touch_poses.poses[-1], joined.touch_poses.poses[:-1])
    earlier = [(pose, one.signal) for pose, one in zip(away, scan.touches, strict=True)]
    step = propose_next(reader, touch.signal, answer, rivals, earlier)
    return replace(
        scan,
        touches=touches,
        touch_poses=joined.touch_poses,
        views=joined.views,
        lattices=joined.lattices,
        recognition=replace(answer, next=step),
        places=tuple(joined.found),
        outlier_run=run,
        confirmed_face=confirmed,
    )


def _reset(scan: ScanBelief, *touches: PlacedTouch) -> ScanBelief:
    """Return a belief that rests on the last touches alone."""
    fresh = begin_scan(scan.reader)
    first, *rest = touches
    if first.believed is None:
        origin = planar_belief(np.zeros(3), FIRST_SD)
        first = replace(first, stepped=None, believed=origin)
    for touch in (first, *rest):
        fresh = extend_scan(fresh, touch)
    return replace(fresh, resets=scan.resets + 1)


def _is_one_place(answer: Recognition, alone: Recognition, pitch_mm: float) -> bool:
    if (answer.object, answer.face) != (alone.object, alone.face):
        return False
    away = math.hypot(answer.x_mm - alone.x_mm, answer.y_mm - alone.y_mm)
    turn = abs(math.remainder(answer.theta_deg - alone.theta_deg, 360.0))
    return away < pitch_mm / 2 and turn < 45.0


def _accept(
    scan: ScanBelief, answer: Recognition, outlier_run: int, most_outliers: int
) -> tuple[Recognition, Face | None]:
    before = scan.confirmed_face
    if not answer:
        return answer, before
    named = answer.object, answer.face
    spread = 0.0 if answer.covariance is None else position_sd_mm(answer.covariance)
    reason = reject_joined(named, before, outlier_run, most_outliers, spread)
    if not reason:
        return answer, named
    confirmed = {AMBIGUOUS: None, NOT_ENCODED: before, TOO_FEW: before or named}[reason]
    return refusal(answer.seq, reason, margin=answer.margin), confirmed


@dataclass(frozen=True, slots=True, eq=False)
class _JoinedTouch:
    """The last touch together with those before it."""

    views: tuple[Views, ...]  #: as `ScanBelief.views`
    alone: Recognition | None  #: the touch by itself; None: it matches its prediction, not read
    rivals: list[VerifiedHypothesis]  #: likely places of the touch by itself
    touch_poses: TouchPoses  #: of all touches
    lattices: tuple[tuple[PlaneLattice, ...], ...]  #: as `ScanBelief.lattices`
    found: list[ScanHypothesis]  #: places, best first
    answer: Recognition
    agrees: bool  #: whether the last touch agrees with the best of them


def _join_touch(
    scan: ScanBelief,
    touches: Sequence[PlacedTouch],
    touch_poses: TouchPoses | None,
    *,
    use_prediction: bool,
) -> _JoinedTouch:
    """Join the last of the touches with those before it.

    Without `touch_poses` a step was not measured; with `use_prediction` the touch may be taken at
    its predicted pose, if its image matches.
    """
    reader, seq = scan.reader, touches[-1].seq
    images, views, alone, rivals = _view_touch(scan, touches[-1], touch_poses, use_prediction)
    steps = known_steps(touches)
    lattices: list[tuple[PlaneLattice, ...]] = []
    found: list[ScanHypothesis] = []
    poses_by_array: list[TouchPoses] = []
    for k, (embossed, _, _) in enumerate(reader.prepared):
        pitch, stacked = embossed.style.pitch_mm, stack_views(views[k])
        path, poses = None, touch_poses
        if poses is None:
            path = follow_path(embossed, views[k], steps)
            poses = path.touch_poses(steps[0].covariance)
            evidence = _evidence_along(stacked, poses, pitch)
        else:
            evidence = _evidence_of(stacked, poses, scan.lattices[k], pitch)
        poses_by_array.append(poses)
        lattices.append(tuple(item.agreement.lattice for item in evidence))
        found += locate_evidence(embossed, evidence, path)
    found = distinct_places(found)
    answer, agrees, best_k = refusal(seq, TOO_FEW), False, 0
    if found:
        best_k = next(k for k, each in enumerate(reader.prepared) if each[0] is found[0].embossed)
    poses = poses_by_array[best_k]
    if found and found[0].evidence.agreement.touches > 1:
        answer = answer_scan(reader, found, seq)
        agrees = bool(found[0].evidence.agreement.chosen[-1] >= 0)
        if answer:
            found[0], agrees = _pose_last_touch(reader, images[best_k], found[0], poses)
            answer = answer_scan(reader, found, seq)
    return _JoinedTouch(views, alone, rivals, poses, tuple(lattices), found, answer, agrees)


def _view_touch(
    scan: ScanBelief, touch: PlacedTouch, touch_poses: TouchPoses | None, use_prediction: bool
) -> tuple[list[Image], tuple[Views, ...], Recognition | None, list[VerifiedHypothesis]]:
    """Return the last touch's images and all views by array, its own answer and places.

    The answer is None where the touch matches its prediction.
    """
    reader = scan.reader
    images = [reader.image(touch.signal, each) for each in reader.prepared]
    near = [_predicted_poses(each[:PREDICTING], touch_poses) for each in scan.lattices]
    new: list[tuple[LatticeView, ...]] = [() for _ in images]
    if use_prediction and scan.recognition and scan.outlier_run == 0:
        for k, image in enumerate(images):
            new[k] = predicted_view(image, reader.options.first, near[k])
    alone: Recognition | None = None
    rivals: list[VerifiedHypothesis] = []
    if not any(new):
        reading = read_touch(reader, touch.signal, touch.seq)
        alone, rivals = reading.answer, reading.found
        for k, (embossed, _, bank) in enumerate(reader.prepared):
            own = [one.fit for one in rivals if one.embossed is embossed and one.bend is None]
            new[k] = flat_views(images[k], bank, reader.options.first, near[k], own)
            if embossed.radii_mm:
                new[k] += round_views(images[k], bank, reader, embossed, near[k])
    views = tuple(
        (*before, tuple(view for view in each if view.fit.noise <= MOST_NOISE))
        for before, each in zip(scan.views, new, strict=True)
    )
    return images, views, alone, rivals


def _pose_last_touch(
    reader: Reader, image: Image, best: ScanHypothesis, touch_poses: TouchPoses
) -> tuple[ScanHypothesis, bool]:
    """Return a place with the pose of the last touch, and whether that touch agrees with it."""
    if best.evidence.agreement.chosen[-1] >= 0:
        finer = refine_last_pose(reader, image, best)
        least = least_explained(bits_of(best.embossed, len(best.fit.cells)))
        if finer.explained >= least and is_definite(finer.fit.covariance):
            return finer, True
    return replace(best, fit=predicted_fit(best.evidence, touch_poses)), False


def _predicted_poses(lattices: Sequence[PlaneLattice], touch_poses: TouchPoses | None) -> Array:
    if touch_poses is None:
        return np.zeros((0, 3))
    return np.array([predict_pose(each, touch_poses)[0] for each in lattices]).reshape(-1, 3)


def _evidence_along(
    views: LatticeViews, touch_poses: TouchPoses, pitch_mm: float
) -> list[LatticeEvidence]:
    """Return the evidence that agrees with the array along a path; empty if none does."""
    along = PlaneLattice(np.zeros(3), LEAST_VARIANCE * np.eye(3))
    agreement = refine_agreement(views, touch_poses, along, pitch_mm)
    found = accumulate(views, touch_poses, agreement, pitch_mm)
    return [] if found is None else [found]


def _evidence_of(
    views: LatticeViews, touch_poses: TouchPoses, before: Sequence[PlaneLattice], pitch_mm: float
) -> list[LatticeEvidence]:
    """Return the evidence of the followed lattices and of those of the last touch, best first."""
    last = len(touch_poses.poses) - 1
    every = [refine_agreement(views, touch_poses, each, pitch_mm) for each in before]
    followed = {int(agreement.chosen[last]) for agreement in every[:1]}
    for view in np.flatnonzero(views.touch == last).tolist():
        if view not in followed:
            seed = seed_lattice(views, touch_poses, view)
            every.append(refine_agreement(views, touch_poses, seed, pitch_mm))
    every.sort(key=lambda agreement: -agreement.score)
    at = touch_poses.poses[last]
    distinct: list[PlaneLattice] = []
    found: list[LatticeEvidence] = []
    for agreement in every:
        if any(same_lattice(agreement.lattice, other, at, pitch_mm) for other in distinct):
            continue
        distinct.append(agreement.lattice)
        evidence = accumulate(views, touch_poses, agreement, pitch_mm)
        if evidence is not None:
            found.append(evidence)
        if len(distinct) == FOLLOWED:
            break
    found.sort(key=lambda item: -item.fit.value)
    return [item for item in found if item.fit.value > found[0].fit.value - CUT_OFF_NATS]


def locate_evidence(
    embossed: EmbossedArray, found: Sequence[LatticeEvidence], path: RegisteredPath | None
) -> list[ScanHypothesis]:
    """Return the likeliest places of the evidence of one array, best evidence first."""
    places: list[ScanHypothesis] = []
    for evidence in found[:LOCATED]:
        fit = evidence.fit
        strength = np.median(-fit.scores, axis=1)
        strongest = np.sort(np.argsort(-strength, kind="stable")[:STRONGEST])
        listed = replace(
            fit, cells=fit.cells[strongest], scores=fit.scores[strongest], seen=fit.seen[strongest]
        )
        ones = find_hypotheses(embossed, (listed,), PLACES)
        if ones:  # all cells may point to places that the strongest do not
            best = max(ones, key=lambda one: log_likelihood(embossed, fit, one))
            ones += find_rivals(embossed, fit, best, 0, PLACES)
        for one in ones:
            score = log_likelihood(embossed, fit, one)
            hypothesis = replace(one, score=score)
            places.append(ScanHypothesis(embossed, hypothesis, fit, score, evidence, path=path))
    return places


def distinct_places(found: Sequence[ScanHypothesis]) -> list[ScanHypothesis]:
    """Return the likeliest place and its rivals, best first.

    It runs before the last touch is fitted to the best place, whose pose may change then.
    """
    ranked = sorted(found, key=lambda item: -item.score)
    return [item for n, item in enumerate(ranked) if n == 0 or not ranked[0].coincides(item)]


def refine_last_pose(reader: Reader, image: Image, found: ScanHypothesis) -> ScanHypothesis:
    """Return a place with its last touch fitted to the symbols of the database."""
    embossed, hypothesis, fit = found.embossed, found.hypothesis, found.fit
    worn = fit.cells[weigh_cells(embossed, fit, hypothesis).worn]
    labels = unworn_labels_at(embossed, hypothesis, worn)
    bend = curvature_at(embossed, hypothesis, fit)
    shares = (1.0,) if bend is None else SHARES
    if bend is not None:
        image = bend_image(image, reader.sensor, bend, shares)
    pose, gain = (np.tile(each, (len(shares), 1)) for each in (fit.pose, fit.gain))
    lattices = refine_lattices(image, pose, gain, steps=STEPS, labels_at=labels)
    best = int(np.argmax(lattices.value))
    again = score_cells(image, lattices)[best]
    if bend is not None:
        image = bend_image(image, reader.sensor, bend, shares[best : best + 1])
    finer = replace(
        again, cells=fit.cells, scores=fit.scores, seen=fit.seen, value=fit.value, with_scale=None
    )
    share = explained_share(image, finer.pose, finer.gain, labels)
    return replace(found, fit=refit_pose(image, finer, labels), explained=share)


def answer_scan(reader: Reader, found: Sequence[ScanHypothesis], seq: int) -> Recognition:
    """Return the answer by `distinct_places`, the last touch fitted to the first.

    Without measured steps the touches must agree better with the database, paths that end elsewhere
    count as places, and each path that the touches allow matches by chance.
    """
    if not found:
        return refusal(seq, TOO_FEW)
    best, path = found[0], found[0].path
    margin = best.score - found[1].score if len(found) > 1 else math.inf
    runner_up = found[1].runner_up if len(found) > 1 else None
    if path is not None:
        margin = min(margin, path.margin)
    by_hand = path is not None and best.evidence.agreement.touches > 1
    reason = verdict.reject_reason(
        _verdict_evidence(best), margin, reader.options.margin,
        least_ratio=RATIO_BY_HAND if by_hand else verdict.RATIO, wrong_share=WRONG,
    )  # fmt: skip
    answer = answer_at(
        best.embossed, best.fit, best.hypothesis, reader.options, seq,
        reason=reason, margin=margin, runner_up=runner_up,
    )  # fmt: skip
    if not answer:
        return answer
    doubt = expected_matches(reader.lab.arrays, best.embossed, best.fit, best.hypothesis)
    if path is not None:
        doubt *= math.exp(path.ambiguity)
    return judge_chance(reader, best.embossed, answer, doubt, DOUBT)


def _verdict_evidence(best: ScanHypothesis) -> verdict.Evidence:
    fit, agreement = best.fit, best.evidence.agreement
    cells = weigh_cells(best.embossed, fit, best.hypothesis)
    chance, inliers = null_log_likelihood(best.embossed, fit), int(cells.agree.sum())
    return verdict.Evidence(
        log_likelihood_ratio=best.score - chance,
        inliers=inliers,
        bits=bits_of(best.embossed, inliers),
        contradictions=int((cells.against > verdict.CONTRADICTION).sum()),
        best_ratio=fit.value - chance,
        touches=1 if best.path is None else len(agreement.chosen),
        agreeing=agreement.touches,
    )
