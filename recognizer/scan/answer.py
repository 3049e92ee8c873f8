"""Composites -> places of the database -> Recognition. Thesis 6.3.

A composite is located as the fit of one touch is (`recognizer.touch.locate`), places being
listed by its most telling cells and compared by all of them. The pose of the last touch is
fitted once more with the symbols that the database holds there. The conditions of an answer are
those of `recognizer.touch.belief`, on all cells together; what it may contradict grows with its
size.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.composite import Composite
from recognizer.scan.path import RegisteredPath
from recognizer.scan.settings import ScanSettings
from recognizer.touch.belief import null_log_likelihood, unworn_labels_at, weigh_cells
from recognizer.touch.chance import expected_matches
from recognizer.touch.hypothesis import (
    Hypothesis,
    coincide,
    log_likelihood,
    under_centre,
)
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


@dataclass(frozen=True, slots=True, eq=False)
class LocatedComposite:
    """A place of a composite."""

    encoding: EmbossedArray
    composite: Composite
    place: Hypothesis
    fit: Fit  #: of the composite, with the pose of the last touch
    score: float  #: log-likelihood of all touches, nats
    explained: float = math.nan  #: share of the last image's variance; NaN: not asked
    path: RegisteredPath | None = None  #: that was followed; None: the motion was known

    @property
    def embossed(self) -> EmbossedArray:
        """Array and style, as a hypothesis of one touch has it."""
        return self.encoding

    @property
    def hypothesis(self) -> Hypothesis:
        """The place, as a hypothesis of one touch has it."""
        return self.place

    @property
    def index(self) -> tuple[int, int]:
        """Row and column of the array's cell under the sensor's centre."""
        return under_centre(self.encoding, self.fit, self.place)

    @property
    def face(self) -> tuple[str, str]:
        """Names of object and face."""
        held = self.encoding.face(self.place.face)
        return held.object, held.face

    def same(self, other: LocatedComposite) -> bool:
        """Whether two say the same place."""
        return self.encoding is other.encoding and coincide(
            self.encoding, self.fit, self.place, other.fit, other.place
        )


def locate_composites(
    encoding: EmbossedArray,
    composites: Sequence[Composite],
    limits: ScanSettings,
    settings: HypothesisSettings,
) -> list[LocatedComposite]:
    """Return the likeliest places of composites of one encoding."""
    settings = replace(settings, kept=limits.places)
    found: list[LocatedComposite] = []
    for each in composites[: limits.located]:
        fit = each.fit
        told = np.median(-fit.scores, axis=1)
        telling = np.sort(np.argsort(-told, kind="stable")[: limits.telling])
        listed = replace(
            fit, cells=fit.cells[telling], scores=fit.scores[telling], seen=fit.seen[telling]
        )
        places = find_hypotheses(encoding, (listed,), settings)
        if places:  # what a few telling cells do not point to, all cells may
            best = max(places, key=lambda one: log_likelihood(encoding, fit, one, settings))
            places += find_rivals(encoding, fit, best, 0, settings)
        for place in places:
            score = log_likelihood(encoding, fit, place, settings)
            found.append(LocatedComposite(encoding, each, replace(place, score=score), fit, score))
    return found


def distinct_places(found: Sequence[LocatedComposite]) -> list[LocatedComposite]:
    """Return the likeliest place and its rivals, best first.

    Told before the best one is posed: its touch may then lie where others lead to expect it.
    """
    ranked = sorted(found, key=lambda item: -item.score)
    return [item for n, item in enumerate(ranked) if n == 0 or not ranked[0].same(item)]


def refine_last_pose(
    reader: Reader,
    image: Image,
    template: ResponseTemplate,
    found: LocatedComposite,
    limits: ScanSettings,
) -> LocatedComposite:
    """Return a place whose last touch was fitted again with the symbols that belong there."""
    encoding, place, fit = found.encoding, found.place, found.fit
    worn = fit.cells[weigh_cells(encoding, fit, place, reader.settings.belief).worn]

    def shown(cells: Ints) -> Ints:
        return unworn_labels_at(encoding, place, worn, cells)

    bend = bend_at(encoding, place, fit)
    shares = (1.0,) if bend is None else reader.settings.round.shares
    if bend is not None:
        image = bend_image(image, reader.sensor, bend, shares)
    pose, gain = (np.tile(each, (len(shares), 1)) for each in (fit.pose, fit.gain))
    lattices = refine_lattices(image, template, pose, gain, steps=limits.verify_steps, shown=shown)
    best = int(np.argmax(lattices.value))
    again = score_cells(image, template, lattices)[best]
    if bend is not None:
        image = bend_image(image, reader.sensor, bend, shares[best : best + 1])
    finer = replace(
        fit,
        x_mm=again.x_mm,
        y_mm=again.y_mm,
        theta_rad=again.theta_rad,
        nuisance=again.nuisance,
        gain=again.gain,
        noise=again.noise,
        covariance=again.covariance,
    )
    share = explained_share(image, template, finer.pose, finer.gain, shown)
    return replace(found, fit=refit_pose(image, template, finer, shown), explained=share)


def answer_scan(
    reader: Reader,
    found: Sequence[LocatedComposite],
    limits: ScanSettings,
    seq: int,
) -> Recognition:
    """Return the answer; `found` are the places of `distinct_places`, the first of them posed.

    Where nobody measured the steps, several touches must agree with the database the better, paths
    that end elsewhere count as places, and each path that the touches allow matches by chance.
    """
    if not found:
        return refusal(seq, TOO_FEW)
    best = found[0]
    other = found[1] if len(found) > 1 else None
    margin = math.inf if other is None else best.score - other.score
    runner_up = None
    if other is not None:
        runner_up = RunnerUp(*other.face, other.index)
    if best.path is not None:
        margin = min(margin, best.path.margin)
    answer = answer_at(
        best.encoding, best.fit, best.place, reader.settings, seq,
        reason=_reject_reason(reader, best, margin, limits),
        margin=margin, runner_up=runner_up,
    )  # fmt: skip
    if not answer:
        return answer
    arrays, settings = reader.lab.arrays, reader.settings
    doubt = expected_matches(arrays, best.encoding, best.fit, best.place, settings)
    if best.path is not None:
        doubt *= math.exp(best.path.log_freedom)
    if doubt > limits.doubt:
        return refusal(seq, BY_CHANCE, margin=margin, runner_up=runner_up, doubt=doubt)
    return replace(answer, doubt=doubt)


def _reject_reason(
    reader: Reader, best: LocatedComposite, margin: float, limits: ScanSettings
) -> str:
    """Return why the best place may not be believed; nothing if it may."""
    encoding, fit, place = best.encoding, best.fit, best.place
    belief, by_hand = reader.settings.belief, best.path is not None
    cells = weigh_cells(encoding, fit, place, belief)
    told = int(cells.agree.sum())
    chance = null_log_likelihood(encoding, fit)
    joined = int((best.composite.agreement.chosen >= 0).sum()) > 1
    surprise = limits.surprise_by_hand if by_hand and joined else belief.surprise
    if fit.value - chance < surprise:
        return TOO_FEW  # if every cell agreed fully it would be no surprise either
    if best.score - chance < belief.surprise:
        return NOT_ENCODED
    if (cells.against > belief.clearly).sum() > max(belief.contradicted, limits.wrong * told):
        return NOT_ENCODED
    agreeing = int((best.composite.agreement.chosen >= 0).sum())
    if by_hand and 2 * agreeing <= len(best.composite.agreement.chosen):
        return TOO_FEW  # what few of the touches say together, any touches may by chance
    if best.score - chance < surprise or told < belief.least_inliers:
        return TOO_FEW
    return AMBIGUOUS if margin < belief.margin else ""
