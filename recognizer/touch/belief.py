"""Whether the best reading of a touch may be believed. Thesis 6.3.

The best of all registered places always exists; it is an answer only if

- no other place explains the image nearly as well (`margin`),
- it explains the image better than symbols of no registered place (`surprise`),
- the symbols that are registered there, worn ones excepted, explain most of the image
  (`explained`), enough of them are in view, and no cell speaks clearly for another symbol
  (`contradicted`),
- where few symbols are plainly read, they are at least so many that they can name one of the
  registered cells (`symbols_to_name`), and leave other places farther behind: bare cells, which are
  as well beyond an edge, between two edges or worn, then weigh as much as the symbols.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.lab import EmbossedArray
from recognizer.touch.locate import Hypothesis, labels_at
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.gain import Image
from recognizer.touch.symbols.refine import explained_share
from recognizer.touch.symbols.template import ResponseTemplate

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

WHOLE = 6.0  #: tactels that look at a cell which counts as seen
CLEARLY, PLAINLY = 8.0, 16.0  #: nats by which a cell speaks for another symbol


@dataclass(frozen=True, slots=True)
class BeliefSettings:
    """When an answer is given."""

    margin: float = 10.0  #: nats over the best other place
    margin_by_few: float = 14.0  #: the same where fewer than `many_inliers` cells speak
    surprise: float = 3.0  #: nats over symbols of no registered place
    sure: float = 7.0  #: nats below which a share of `well` must be explained
    wide: float = 0.9  #: tenths of a mm by which strokes are hardly printed wider; the same holds
    well: float = 0.8
    explained: float = 0.72  #: share of the image's variance
    explained_by_many: float = 0.58  #: the same where `many_inliers` cells agree
    many_inliers: int = 11
    least_inliers: int = 4  #: cells that hold a symbol, are seen, and agree
    contradicted: int = 1  #: cells that speak `CLEARLY` for another symbol; `PLAINLY`: none
    rim_mm: float = 2.0  #: how far the sensor's centre may lie beyond the face
    places: int = 8  #: that are verified at most, two at least
    near: float = 14.0  #: nats below the best within which places are
    verify_steps: int = 4


@dataclass(frozen=True, slots=True)
class Support:
    """What speaks for a reading."""

    surprise: float  #: nats over symbols of no registered place
    explained: float  #: share of the image's variance
    inliers: int  #: cells that are seen, with a registered symbol that is not worn
    clear: int  #: cells that speak clearly for another symbol
    plain: int  #: and plainly
    wider: float  #: tenths of a mm by which strokes would be wider than asked

    def holds(self, limits: BeliefSettings) -> bool:
        """Return whether an encoded surface is believed."""
        few = self.inliers < limits.many_inliers
        doubtful = self.surprise < limits.sure or self.wider > limits.wide
        return (
            self.surprise >= limits.surprise
            and (self.explained >= limits.well or not doubtful)
            and self.explained >= (limits.explained if few else limits.explained_by_many)
            and self.clear <= limits.contradicted
            and self.plain == 0
        )


def support(
    image: Image,
    template: ResponseTemplate,
    embossed: EmbossedArray,
    fit: Fit,
    hypothesis: Hypothesis,
    score: float,
) -> Support:
    """Return what speaks for a place, under the fit it was verified with."""
    cells = weigh_cells(embossed, fit, hypothesis)
    worn = fit.cells[cells.worn]
    return Support(
        surprise=score - null_log_likelihood(embossed, fit),
        explained=explained_share(
            image,
            template,
            fit.pose,
            fit.gain,
            lambda at: unworn_labels_at(embossed, hypothesis, worn, at),
        ),
        inliers=int(cells.agree.sum()),
        clear=int((cells.seen & (cells.against > CLEARLY)).sum()),
        plain=int((cells.seen & (cells.against > PLAINLY)).sum()),
        wider=float(fit.nuisance[0]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class CellEvidence:
    """What the cells in view (m,) say of a place."""

    worn: Flags  #: hold a symbol that is not felt at all
    seen: Flags  #: tactels enough look at them
    agree: Flags  #: seen, with a symbol that is likelier than all other ones and none together
    against: NDArray[np.float64]  #: nats by which they speak for another symbol


def weigh_cells(embossed: EmbossedArray, fit: Fit, hypothesis: Hypothesis) -> CellEvidence:
    """Return what the cells of a fit say of a place."""
    order = embossed.array.order
    held = labels_at(embossed, hypothesis, fit.cells)
    own = fit.scores[np.arange(len(held)), held]
    worn = np.asarray((held < order) & (fit.scores[:, order] > own))
    seen = np.asarray(fit.seen >= WHOLE)
    against = np.where(worn, 0.0, fit.scores[:, :order].max(axis=1) - own)
    tells = own > _marginal(fit) - math.log(2.0)
    return CellEvidence(worn, seen, seen & (held < order) & tells, against)


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


def _marginal(fit: Fit) -> NDArray[np.float64]:
    """Return the log of each cell's likelihoods (m,), summed over all that it may show."""
    total: NDArray[np.float64] = np.log(np.exp(fit.scores).sum(axis=1))
    return total
