"""Accumulated evidence -> places of the database -> Recognition. Thesis 6.3.

Evidence is located like the fit of one touch (`find_hypotheses`): its strongest cells list places,
all cells compare them. The pose of the last touch is fitted once more with the registered symbols.
`recognizer.touch.verdict` judges all cells together; more of them may contradict than in one touch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.lattice import LatticeEvidence
from recognizer.scan.path import RegisteredPath
from recognizer.touch import verdict
from recognizer.touch.chance import expected_matches
from recognizer.touch.evidence import null_log_likelihood, unworn_labels_at, weigh_cells
from recognizer.touch.hypothesis import (
    PlaceHypothesis,
    find_hypotheses,
    find_rivals,
    log_likelihood,
)
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import answer_at
from recognizer.touch.recognition import TOO_FEW, Recognition, refusal
from recognizer.touch.symbols.fit import refine_lattices, score_cells
from recognizer.touch.symbols.image import Image, bend_image
from recognizer.touch.symbols.posterior import explained_share, refit_pose
from recognizer.touch.verify import SHARES, bend_at

Array = NDArray[np.float64]

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
    bend = bend_at(embossed, hypothesis, fit)
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
        _verdict_evidence(best), margin, reader.options,
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
    if reason := verdict.reject_chance(doubt, DOUBT):
        return refusal(seq, reason, margin=margin, runner_up=runner_up, doubt=doubt)
    return replace(answer, doubt=doubt)


def _verdict_evidence(best: ScanHypothesis) -> verdict.Evidence:
    """Return the evidence of all touches for a place."""
    fit, agreement = best.fit, best.evidence.agreement
    cells = weigh_cells(best.embossed, fit, best.hypothesis)
    chance = null_log_likelihood(best.embossed, fit)
    return verdict.Evidence(
        log_likelihood_ratio=best.score - chance,
        inliers=int(cells.agree.sum()),
        contradictions=int((cells.against > verdict.CONTRADICTION).sum()),
        best_ratio=fit.value - chance,
        touches=1 if best.path is None else len(agreement.chosen),
        agreeing=agreement.touches,
    )
