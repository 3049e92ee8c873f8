"""How many registered places a foreign surface would match as well by chance.

Fit + hypothesis + what is registered -> doubt, the E-value of sequence databases: number of places
times the probability that symbols drawn at random (each alike likely, one independent of the
other) reach at least the score that the hypothesis reached. A cell that shows its symbol clearly
contributes 1 / q; a soft one, the share of symbols that score as well, together with what the
others leave; a bare one, 1. Of bare cells only the places are counted whose own border agrees with
them: a place that holds symbols where the face is bare falls behind farther than the hypothesis.

The probability is summed over all symbols of all cells at once, on a grid of nats, every score
rounded up: it is never too small but for what the fit of pose and gain to the symbols that are
registered there adds to them. Thesis 6.3.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.lab import EmbossedArray
from recognizer.touch.locate import Hypothesis, bounded_scores, labels_at
from recognizer.touch.place_scores import count_places
from recognizer.touch.settings import ReaderSettings
from recognizer.touch.symbols.fit import Fit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def expected_matches(
    arrays: Iterable[EmbossedArray],
    embossed: EmbossedArray,
    fit: Fit,
    hypothesis: Hypothesis,
    settings: ReaderSettings,
    *,
    borders: bool = True,
) -> float:
    """Return how many registered places random symbols would match as well as a hypothesis.

    Parameters
    ----------
    arrays
        Of the lab. Those count that are embossed alike: the same symbols, as large.
    embossed
        The one of the hypothesis.
    borders
        Whether those only count whose own borders agree with the bare cells; else all.
    """
    scores = bounded_scores(fit, settings.hypotheses)
    held = labels_at(embossed, hypothesis, fit.cells)
    shown = held < embossed.array.order
    chance = chance_of_match(scores[shown, :-1], held[shown], settings.belief.grain)
    border = _border_of(fit, scores, held)
    largest = settings.hypotheses.large
    return chance * sum(
        _count_places(one, border, largest) if borders else len(one.keys)
        for one in arrays
        if (one.alphabet, one.style) == (embossed.alphabet, embossed.style)
    )


def chance_of_match(scores: Array, held: Ints, grain: float) -> float:
    """Return the probability that random symbols score as well as those that are held.

    Parameters
    ----------
    scores
        (m, q) log-likelihoods of the symbols of each cell, nats.
    held
        (m,) symbols.
    grain
        Nats to which scores are rounded, towards a larger probability.
    """
    if len(held) == 0:
        return 1.0
    order = scores.shape[1]
    behind = np.floor((scores[np.arange(len(held)), held][:, None] - scores) / grain)
    behind = behind.astype(np.int64)
    ahead = behind.min(axis=1)
    slack = int(-ahead.sum())  # by which the held symbols fall behind the likeliest ones
    reached = np.zeros(slack + 1)
    reached[0] = 1.0
    for cell in np.minimum(behind - ahead[:, None], slack + 1):
        each = np.bincount(cell, minlength=slack + 2)[: slack + 1] / order
        reached = np.convolve(reached, each)[: slack + 1]
    return float(reached.sum())


@dataclass(frozen=True, slots=True, eq=False)
class _Border:
    """What the bare cells of a hypothesis ask of a place."""

    cells: Ints  #: (n, 2) column and upward row, from a cell that the place holds
    price: Array  #: (n,) nats by which a symbol there falls behind, falling
    slack: float  #: nats by which the hypothesis itself falls behind


def _border_of(fit: Fit, scores: Array, held: Ints) -> _Border:
    order = scores.shape[1] - 1
    price = np.where(held == order, scores[:, -1] - scores[:, :-1].max(axis=1), 0.0)
    dear = np.argsort(-price, kind="stable")[: int((price > 0).sum())]
    anchor = int(np.argmax(np.where(held < order, fit.seen, -1.0)))
    own = scores[np.arange(len(held)), held]
    slack = float((scores.max(axis=1) - own).sum())
    return _Border(fit.cells[dear] - fit.cells[anchor], price[dear], slack)


def _count_places(embossed: EmbossedArray, border: _Border, largest: int) -> int:
    """Return how many registered cells can be the held one; all, in a lab larger than `largest`."""
    if len(embossed.keys) > largest:
        return len(embossed.keys)
    return count_places(embossed, border.cells, border.price, border.slack)
