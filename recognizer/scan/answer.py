"""Accumulated evidence -> places of the database -> Recognition. Thesis 6.3.

Evidence is located like the fit of one touch (`recognizer.touch.locate`): its strongest cells list
places, all cells compare them. The pose of the last touch is fitted once more with the symbols of
the database. Acceptance follows `recognizer.touch.belief` on all cells together; the number of
contradictions that are allowed grows with them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.lattice import Evidence
from recognizer.scan.path import RegisteredPath
from recognizer.touch.belief import null_log_likelihood, unworn_labels_at, weigh_cells
from recognizer.touch.chance import expected_matches
from recognizer.touch.hypothesis import Hypothesis, coincide, log_likelihood, under_centre
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.locate import find_hypotheses, find_rivals
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import answer_at
from recognizer.touch.recognition import (
    AMBIGUOUS,
    BY_CHANCE,
    NOT_ENCODED,
    TOO_FEW,
    Recognition,
    RunnerUp,
    refusal,
)
from recognizer.touch.round import bend_at
from recognizer.touch.settings import HypothesisSettings
from recognizer.touch.symbols.explained import explained_share
from recognizer.touch.symbols.fit import Fit, score_cells
from recognizer.touch.symbols.gain import Image, bend_image
from recognizer.touch.symbols.posterior import refit_pose
from recognizer.touch.symbols.refine import refine_lattices
from recognizer.touch.symbols.template import ResponseTemplate

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

LOCATED = 3  #: lattices that are looked up
STRONGEST = 16  #: cells by which places are listed
PLACES = 6  #: of every lattice that are compared by all cells
STEPS = 3  #: of the last touch's pose with the symbols of the database
WRONG = 0.05  #: share of the cells that may clearly contradict the place
#: expected matches by chance; a lab of a profile for scans has fewer symbols than one touch of
#: another profile can distinguish
DOUBT = 2e-2
SURPRISE_BY_HAND = 8.0  #: nats over symbols of no registered place, without measured steps


@dataclass(frozen=True, slots=True, eq=False)
class ScanHypothesis:
    """A place of accumulated evidence."""

    embossed: EmbossedArray
    evidence: Evidence
    hypothesis: Hypothesis
    fit: Fit  #: of the evidence, with the pose of the last touch
    score: float  #: log-likelihood of all touches, nats
    explained: float = math.nan  #: share of the last image's variance; NaN: not computed
    path: RegisteredPath | None = None  #: None: the motion was measured

    @property
    def index(self) -> tuple[int, int]:
        """Row and column of the array's cell under the sensor's centre."""
        return under_centre(self.embossed, self.fit, self.hypothesis)

    @property
    def face(self) -> tuple[str, str]:
        """Names of object and face."""
        held = self.embossed.face(self.hypothesis.face)
        return held.object, held.face

    def same(self, other: ScanHypothesis) -> bool:
        """Whether two are one place."""
        return self.embossed is other.embossed and coincide(
            self.embossed, self.fit, self.hypothesis, other.fit, other.hypothesis
        )


def locate_evidence(
    embossed: EmbossedArray,
    found: Sequence[Evidence],
    path: RegisteredPath | None,
    settings: HypothesisSettings,
) -> list[ScanHypothesis]:
    """Return the likeliest places of the evidence of one array, best evidence first."""
    settings = replace(settings, kept=PLACES)
    places: list[ScanHypothesis] = []
    for evidence in found[:LOCATED]:
        fit = evidence.fit
        strength = np.median(-fit.scores, axis=1)
        strongest = np.sort(np.argsort(-strength, kind="stable")[:STRONGEST])
        listed = replace(
            fit, cells=fit.cells[strongest], scores=fit.scores[strongest], seen=fit.seen[strongest]
        )
        ones = find_hypotheses(embossed, (listed,), settings)
        if ones:  # all cells may point to places that the strongest do not
            best = max(ones, key=lambda one: log_likelihood(embossed, fit, one, settings))
            ones += find_rivals(embossed, fit, best, 0, settings)
        for one in ones:
            score = log_likelihood(embossed, fit, one, settings)
            hypothesis = replace(one, score=score)
            places.append(ScanHypothesis(embossed, evidence, hypothesis, fit, score, path=path))
    return places


def distinct_places(found: Sequence[ScanHypothesis]) -> list[ScanHypothesis]:
    """Return the likeliest place and its rivals, best first.

    It runs before the last touch is fitted to the best place, whose pose may change then.
    """
    ranked = sorted(found, key=lambda item: -item.score)
    return [item for n, item in enumerate(ranked) if n == 0 or not ranked[0].same(item)]


def refine_last_pose(
    reader: Reader, image: Image, template: ResponseTemplate, found: ScanHypothesis
) -> ScanHypothesis:
    """Return a place with its last touch fitted to the symbols of the database."""
    embossed, hypothesis, fit = found.embossed, found.hypothesis, found.fit
    worn = fit.cells[weigh_cells(embossed, fit, hypothesis, reader.settings.belief).worn]

    def labels(cells: Ints) -> Ints:
        return unworn_labels_at(embossed, hypothesis, worn, cells)

    bend = bend_at(embossed, hypothesis, fit)
    shares = (1.0,) if bend is None else reader.settings.round.shares
    if bend is not None:
        image = bend_image(image, reader.sensor, bend, shares)
    pose, gain = (np.tile(each, (len(shares), 1)) for each in (fit.pose, fit.gain))
    lattices = refine_lattices(image, template, pose, gain, steps=STEPS, shown=labels)
    best = int(np.argmax(lattices.value))
    again = score_cells(image, template, lattices)[best]
    if bend is not None:
        image = bend_image(image, reader.sensor, bend, shares[best : best + 1])
    finer = replace(
        again, cells=fit.cells, scores=fit.scores, seen=fit.seen, value=fit.value, with_scale=None
    )
    share = explained_share(image, template, finer.pose, finer.gain, labels)
    return replace(found, fit=refit_pose(image, template, finer, labels), explained=share)


def answer_scan(reader: Reader, found: Sequence[ScanHypothesis], seq: int) -> Recognition:
    """Return the answer by `distinct_places`, the last touch fitted to the first.

    Without measured steps the touches must agree better with the database, paths that end
    elsewhere count as places, and each path that the touches allow matches by chance.
    """
    if not found:
        return refusal(seq, TOO_FEW)
    best, path = found[0], found[0].path
    margin, runner_up = math.inf, None
    if len(found) > 1:
        margin = best.score - found[1].score
        runner_up = RunnerUp(*found[1].face, found[1].index)
    if path is not None:
        margin = min(margin, path.margin)
    answer = answer_at(
        best.embossed, best.fit, best.hypothesis, reader.settings, seq,
        reason=_reject_reason(reader, best, margin), margin=margin, runner_up=runner_up,
    )  # fmt: skip
    if not answer:
        return answer
    arrays, settings = reader.lab.arrays, reader.settings
    doubt = expected_matches(arrays, best.embossed, best.fit, best.hypothesis, settings)
    if path is not None:
        doubt *= math.exp(path.ambiguity)
    if doubt > DOUBT:
        return refusal(seq, BY_CHANCE, margin=margin, runner_up=runner_up, doubt=doubt)
    return replace(answer, doubt=doubt)


def _reject_reason(reader: Reader, best: ScanHypothesis, margin: float) -> str:
    """Return why the best place is not accepted, or ""."""
    embossed, fit, hypothesis = best.embossed, best.fit, best.hypothesis
    belief, by_hand = reader.settings.belief, best.path is not None
    cells = weigh_cells(embossed, fit, hypothesis, belief)
    inliers = int(cells.agree.sum())
    chance = null_log_likelihood(embossed, fit)
    agreeing = best.evidence.agreement.touches
    surprise = SURPRISE_BY_HAND if by_hand and agreeing > 1 else belief.surprise
    if fit.value - chance < surprise:
        return TOO_FEW  # even full agreement would be no surprise
    if best.score - chance < belief.surprise:
        return NOT_ENCODED
    if (cells.against > belief.clearly).sum() > max(belief.contradicted, WRONG * inliers):
        return NOT_ENCODED
    if by_hand and 2 * agreeing <= len(best.evidence.agreement.chosen):
        return TOO_FEW  # any touches may agree in a minority, by chance
    if best.score - chance < surprise or inliers < belief.least_inliers:
        return TOO_FEW
    return AMBIGUOUS if margin < belief.margin else ""
