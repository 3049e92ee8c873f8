"""What the image says of a place: the evidence that `verdict` judges. Thesis 6.3."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from generator.database.registered import Bend
from recognizer.touch.hypothesis import Hypothesis, PlaceHypothesis, labels_of
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.options import TIE_NATS
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.image import Image
from recognizer.touch.symbols.linearize import LabelsAt
from recognizer.touch.symbols.posterior import explained_share, refit_pose
from recognizer.touch.verdict import CONTRADICTION, STRONG_CONTRADICTION, Evidence

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

IN_VIEW = 6.0  #: tactels on a cell that counts as seen


@dataclass(frozen=True, eq=False)
class VerifiedHypothesis(PlaceHypothesis):
    """A place with pose and gain fitted to the symbols that the database holds there."""

    image: Image  #: on a round face: under the curvature there
    bend: Bend | None = None  #: of a round face, in the axes of the sensor

    def same_place(self, other: VerifiedHypothesis) -> bool:
        """Whether both are one place, up to a cell's rounding."""
        if self.embossed is not other.embossed or self.hypothesis.face != other.hypothesis.face:
            return False
        array, away = self.embossed.array, np.subtract(self.index, other.index) + 1
        return bool((away % (array.rows, array.columns) <= 2).all())

    @cached_property
    def cells(self) -> CellEvidence:
        """Evidence of the cells in view."""
        return weigh_cells(self.embossed, self.fit, self.hypothesis)

    @cached_property
    def labels_at(self) -> LabelsAt:
        """Labels of the cells, without worn symbols."""
        return unworn_labels_at(self.embossed, self.hypothesis, self.fit.cells[self.cells.worn])

    @cached_property
    def evidence(self) -> Evidence:
        """Evidence for the place, and against it."""
        fit, cells = self.fit, self.cells
        against = cells.seen & (cells.against > CONTRADICTION)
        inliers = int(cells.agree.sum())
        return Evidence(
            log_likelihood_ratio=self.score - null_log_likelihood(self.embossed, fit),
            inliers=inliers,
            bits=bits_of(self.embossed, inliers),
            contradictions=int(against.sum()),
            strong_contradictions=int((against & (cells.against > STRONG_CONTRADICTION)).sum()),
            worn=int((cells.worn & cells.seen).sum()),
            explained=explained_share(self.image, fit.pose, fit.gain, self.labels_at),
            stroke_excess=fit.stroke_excess,
        )

    def last_fit(self) -> Fit:
        """Return the fit with pose and covariance by its unworn symbols."""
        return refit_pose(self.image, self.fit, self.labels_at)


@dataclass(frozen=True, slots=True, eq=False)
class CellEvidence:
    """Evidence of the cells in view (m,) for a place."""

    worn: Flags  #: hold a symbol that is not felt at all
    seen: Flags  #: have enough tactels on them
    agree: Flags  #: seen, with a symbol that is likelier than all other ones and none together
    against: NDArray[np.float64]  #: nats by which they show another symbol


def weigh_cells(embossed: EmbossedArray, fit: Fit, hypothesis: Hypothesis) -> CellEvidence:
    """Return the evidence of a fit's cells for a place."""
    order = embossed.array.order
    held = labels_of(embossed, hypothesis, fit.cells)
    own = fit.scores[np.arange(len(held)), held]
    worn = np.asarray((held < order) & (fit.scores[:, order] > own + TIE_NATS))
    seen = np.asarray(fit.seen >= IN_VIEW)
    # a symbol that is worn shows none; one that shows another letter was never there
    against = fit.scores[:, :order].max(axis=1) - np.where(worn, fit.scores[:, order], own)
    likely = own > _marginal(fit) - math.log(2.0)
    return CellEvidence(worn, seen, seen & (held < order) & likely, against)


def unworn_labels_at(embossed: EmbossedArray, hypothesis: Hypothesis, worn: Ints) -> LabelsAt:
    """Return the labels of cells (..., 2) at a place, -1 for none, or worn away (k, 2)."""

    def labels(cells: Ints) -> Ints:
        found = labels_of(embossed, hypothesis, cells.reshape(-1, 2)).reshape(cells.shape[:-1])
        gone = (cells[..., None, :] == worn).all(axis=-1).any(axis=-1)
        return np.where(gone | (found == embossed.array.order), -1, found)

    return labels


def bits_of(embossed: EmbossedArray, symbols: int) -> float:
    """Return how many bits so many symbols say."""
    return symbols * math.log2(embossed.array.order)


def symbols_to_name(embossed: EmbossedArray) -> int:
    """Return how many symbols it takes to name one of the registered cells."""
    symbols, names = 0, 1
    while names < len(embossed.keys):
        symbols, names = symbols + 1, names * embossed.array.order
    return symbols


def null_log_likelihood(embossed: EmbossedArray, fit: Fit) -> float:
    """Return the log-likelihood of an image that shows symbols of no registered place.

    Every cell shows any symbol, or none, with one probability; a place's prior is one over their
    number.
    """
    options = embossed.array.order + 1
    each = _marginal(fit) - math.log(options)
    return float(each.sum()) + fit.value + math.log(len(embossed.keys))


def _marginal(fit: Fit) -> NDArray[np.float64]:
    """Return the log of each cell's likelihoods (m,), summed over all symbols and none."""
    return np.asarray(np.log(np.exp(fit.scores).sum(axis=1)))
