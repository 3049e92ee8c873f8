"""Whether the best reading of a touch may be believed. Thesis 6.3.

The best of all registered places always exists; it is an answer only if

- no other place explains the image nearly as well (`margin`),
- it explains the image better than symbols of no registered place (`surprise`),
- the symbols that are registered there, worn ones excepted, explain most of the image
  (`explained`), enough of them are in view, and no cell speaks clearly for another symbol
  (`contradicted`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.lab import Encoding
from recognizer.locate import Place, shown_at
from recognizer.symbols.fit import Fit
from recognizer.symbols.refine import Image, explained_share
from recognizer.symbols.template import Template

Ints = NDArray[np.int64]

WHOLE = 6.0  #: tactels that look at a cell which counts as seen
CLEARLY, PLAINLY = 8.0, 16.0  #: nats by which a cell speaks for another symbol


@dataclass(frozen=True, slots=True)
class Thresholds:
    """When an answer is given."""

    margin: float = 10.0  #: nats over the best other place
    surprise: float = 3.0  #: nats over symbols of no registered place
    sure: float = 7.0  #: nats from which on less than `well` may be explained
    well: float = 0.8
    explained: float = 0.72  #: share of the image's variance
    explained_by_many: float = 0.58  #: the same where `many` cells agree
    many: int = 11
    cells: int = 4  #: that hold a symbol and are seen
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
    cells: int  #: seen, with a registered symbol that is not worn
    clear: int  #: cells that speak clearly for another symbol
    plain: int  #: and plainly

    def holds(self, limits: Thresholds) -> bool:
        """Return whether an encoded surface is believed."""
        few = self.cells < limits.many
        return (
            self.surprise >= limits.surprise
            and (self.surprise >= limits.sure or self.explained >= limits.well)
            and self.explained >= (limits.explained if few else limits.explained_by_many)
            and self.clear <= limits.contradicted
            and self.plain == 0
        )


def support(
    image: Image, template: Template, encoding: Encoding, fit: Fit, place: Place, score: float
) -> Support:
    """Return what speaks for a place, under the fit it was verified with."""
    order = encoding.array.order
    held = shown_at(encoding, place, fit.cells)
    here = np.arange(len(held))
    own = fit.scores[here, held]
    worn = (held < order) & (fit.scores[:, order] > own)
    others = fit.scores[:, :order].max(axis=1)
    against = np.where(worn, 0.0, others - own)
    seen = fit.seen >= WHOLE

    def labels(cells: Ints) -> Ints:
        found = shown_at(encoding, place, cells.reshape(-1, 2)).reshape(cells.shape[:-1])
        found[_within(cells, fit.cells[worn])] = order
        return np.where(found == order, -1, found)

    return Support(
        surprise=score - unplaced(encoding, fit),
        explained=explained_share(image, template, fit.pose, fit.gain, labels),
        cells=int((seen & (held < order) & ~worn).sum()),
        clear=int((seen & (against > CLEARLY)).sum()),
        plain=int((seen & (against > PLAINLY)).sum()),
    )


def unplaced(encoding: Encoding, fit: Fit) -> float:
    """Return the log-likelihood of an image that shows symbols of no registered place.

    Every cell shows any symbol, or none, with the same probability; the prior of a place is
    one over their number.
    """
    options = encoding.array.order + 1
    each = np.log(np.exp(fit.scores).sum(axis=1)) - math.log(options)
    return float(each.sum()) + fit.value + math.log(len(encoding.keys))


def _within(cells: Ints, some: Ints) -> NDArray[np.bool_]:
    """Return which cells (..., 2) are among some (k, 2)."""
    found = np.zeros(cells.shape[:-1], np.bool_)
    for cell in some:
        found |= (cells == cell).all(axis=-1)
    return found
