"""What the image says of a verified place: the evidence that `verdict` judges. Thesis 6.3."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from generator.database.registered import Bend
from recognizer.touch.hypothesis import (
    Hypothesis,
    coincide,
    labels_at,
    neighbours,
    under_centre,
)
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.settings import BeliefSettings
from recognizer.touch.symbols.explained import explained_share
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.gain import Image
from recognizer.touch.symbols.posterior import refit_pose
from recognizer.touch.symbols.template import ResponseTemplate
from recognizer.touch.verdict import CONTRADICTION, STRONG_CONTRADICTION, Evidence

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class VerifiedHypothesis:
    """A place with pose and gain fitted to the symbols that the database holds there."""

    image: Image  #: on a round face: under the bend there
    template: ResponseTemplate
    embossed: EmbossedArray
    hypothesis: Hypothesis
    fit: Fit
    score: float  #: log-likelihood of the image, nats
    bend: Bend | None = None  #: of a round face, in the axes of the sensor

    @property
    def index(self) -> tuple[int, int]:
        """Row and column of the array's cell under the sensor's centre."""
        return under_centre(self.embossed, self.fit, self.hypothesis)

    def same_place(self, other: VerifiedHypothesis) -> bool:
        """Whether both say the same place, up to a cell's rounding."""
        if self.embossed is not other.embossed or self.hypothesis.face != other.hypothesis.face:
            return False
        return neighbours(self.embossed, self.index, other.index)

    def coincides(self, other: VerifiedHypothesis) -> bool:
        """Whether both say the same place: not one a pitch beside either."""
        return self.embossed is other.embossed and coincide(
            self.embossed, self.fit, self.hypothesis, other.fit, other.hypothesis
        )

    def last_fit(self) -> Fit:
        """Return its fit with the pose as its symbols tell it, those that are worn left out."""
        embossed, fit, place = self.embossed, self.fit, self.hypothesis
        worn = fit.cells[weigh_cells(embossed, fit, place, self.image.settings.belief).worn]

        def shown(at: Ints) -> Ints:
            return unworn_labels_at(embossed, place, worn, at)

        return refit_pose(self.image, self.template, fit, shown)

    def evidence(self) -> Evidence:
        """Return what speaks for it."""
        return _evidence_of(self)


@lru_cache(maxsize=8)
def _evidence_of(found: VerifiedHypothesis) -> Evidence:
    embossed, fit, limits = found.embossed, found.fit, found.image.settings.belief
    cells = weigh_cells(embossed, fit, found.hypothesis, limits)
    worn = fit.cells[cells.worn]

    def shown(at: Ints) -> Ints:
        return unworn_labels_at(embossed, found.hypothesis, worn, at)

    return Evidence(
        log_likelihood_ratio=found.score - null_log_likelihood(embossed, fit),
        explained=explained_share(found.image, found.template, fit.pose, fit.gain, shown),
        inliers=int(cells.agree.sum()),
        contradictions=int((cells.seen & (cells.against > CONTRADICTION)).sum()),
        strong_contradictions=int((cells.seen & (cells.against > STRONG_CONTRADICTION)).sum()),
        stroke_excess=fit.stroke_excess,
        worn=int((cells.worn & cells.seen).sum()),
    )


@dataclass(frozen=True, slots=True, eq=False)
class CellEvidence:
    """What the cells in view (m,) say of a place."""

    worn: Flags  #: hold a symbol that is not felt at all
    seen: Flags  #: tactels enough look at them
    agree: Flags  #: seen, with a symbol that is likelier than all other ones and none together
    against: NDArray[np.float64]  #: nats by which they speak for another symbol


@lru_cache(maxsize=16)
def weigh_cells(
    embossed: EmbossedArray, fit: Fit, hypothesis: Hypothesis, settings: BeliefSettings
) -> CellEvidence:
    """Return what the cells of a fit say of a place."""
    order = embossed.array.order
    held = labels_at(embossed, hypothesis, fit.cells)
    own = fit.scores[np.arange(len(held)), held]
    worn = np.asarray((held < order) & (fit.scores[:, order] > own + settings.tie))
    seen = np.asarray(fit.seen >= settings.whole)
    against = np.where(worn, 0.0, fit.scores[:, :order].max(axis=1) - own)
    tells = own > _marginal(fit) - math.log(2.0)
    told = CellEvidence(worn, seen, seen & (held < order) & tells, against)
    for flags in (told.worn, told.seen, told.agree, told.against):
        flags.setflags(write=False)
    return told


def unworn_labels_at(
    embossed: EmbossedArray, hypothesis: Hypothesis, worn: Ints, cells: Ints
) -> Ints:
    """Return the labels that cells (..., 2) show at a place, -1 for none, or worn away (k, 2)."""
    found = labels_at(embossed, hypothesis, cells.reshape(-1, 2)).reshape(cells.shape[:-1])
    gone = (cells[..., None, :] == worn).all(axis=-1).any(axis=-1)
    return np.where(gone | (found == embossed.array.order), -1, found)


def symbols_to_name(embossed: EmbossedArray) -> int:
    """Return how many symbols it takes to name one of the registered cells."""
    symbols, names = 0, 1
    while names < len(embossed.keys):
        symbols, names = symbols + 1, names * embossed.array.order
    return symbols


def null_log_likelihood(embossed: EmbossedArray, fit: Fit) -> float:
    """Return the log-likelihood of an image that shows symbols of no registered place.

    Every cell shows any symbol, or none, with the same probability; the prior of a place is
    one over their number.
    """
    options = embossed.array.order + 1
    each = _marginal(fit) - math.log(options)
    return float(each.sum()) + fit.value + math.log(len(embossed.keys))


@lru_cache(maxsize=16)
def _marginal(fit: Fit) -> NDArray[np.float64]:
    """Return the log of each cell's likelihoods (m,), summed over all that it may show."""
    total: NDArray[np.float64] = np.log(np.exp(fit.scores).sum(axis=1))
    total.setflags(write=False)
    return total
