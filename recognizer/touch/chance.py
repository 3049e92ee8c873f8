"""How many registered places a foreign surface would match as well by chance.

Fit + hypothesis + what is registered -> doubt, the E-value of sequence databases: the expected
number of registered places that reach at least the score of the hypothesis, where symbols are drawn
at random (each alike likely, one independent of the other). A cell that shows its symbol clearly
contributes 1 / q; a soft one, the share of symbols that score as well, together with what the
others leave; one that the place leaves bare, nothing but what it is behind. A place whose border is
another one than the image shows falls behind for that alone: at the edge of a face mostly edges are
counted that run alike, in its corner corners.

The probability is summed over all symbols of all cells at once, on a grid of nats, every score
rounded up: it is never too small but for what the fit of pose and gain to the symbols that are
registered there adds to them. Thesis 6.3.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.lab import EmbossedArray
from recognizer.touch.locate import Hypothesis, bounded_scores, labels_at
from recognizer.touch.settings import ReaderSettings
from recognizer.touch.symbols.fit import Fit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


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
        Whether places fall behind where their own borders are others, which is gone into where the
        doubt would decide anything without, in a lab that is small enough. Else all count alike.
    """
    scores = bounded_scores(fit, settings.hypotheses)
    held = labels_at(embossed, hypothesis, fit.cells)
    shown = held < embossed.array.order
    alike = [
        one for one in arrays if (one.alphabet, one.style) == (embossed.alphabet, embossed.style)
    ]
    belief, places = settings.belief, [len(one.keys) for one in alike]
    most = sum(places) * chance_of_match(scores[shown, :-1], held[shown], belief.grain)
    if not borders or most <= min(belief.doubt, settings.next.doubt):
        return most
    own = scores[np.arange(len(held)), held]
    behind = np.floor((own[:, None] - scores) / belief.grain).astype(np.int64)
    anchor = int(np.argmax(np.where(shown, fit.seen, -1.0)))
    cells = fit.cells - fit.cells[anchor]
    few = settings.hypotheses.large
    share = most / max(sum(places), 1)
    return sum(
        _expect_matches(one, cells, behind) if len(one.keys) <= few else share * len(one.keys)
        for one in alike
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
    behind = np.floor((scores[np.arange(len(held)), held][:, None] - scores) / grain)
    return _share_within(behind.astype(np.int64), 0)


def _share_within(behind: Ints, most: int) -> float:
    """Return how likely random symbols of cells (m, q) fall behind by no more than `most`."""
    if len(behind) == 0:
        return float(most >= 0)
    ahead = behind.min(axis=1)
    slack = int(most - ahead.sum())  # by which all but the likeliest may fall behind
    if slack < 0:
        return 0.0
    reached = np.zeros(slack + 1)
    reached[0] = 1.0
    for cell in np.minimum(behind - ahead[:, None], slack + 1):
        each = np.bincount(cell, minlength=slack + 2)[: slack + 1] / behind.shape[1]
        reached = np.convolve(reached, each)[: slack + 1]
    return float(reached.sum())


def _expect_matches(embossed: EmbossedArray, cells: Ints, behind: Ints) -> float:
    """Return how many places random symbols match, borders and all.

    Parameters
    ----------
    cells
        (m, 2) column and upward row, from a cell that the place holds.
    behind
        (m, q + 1) by how much each symbol, and none, falls behind the hypothesis there.
    """
    symbol, none = behind[:, :-1], behind[:, -1]
    least = symbol.min(axis=1)
    tell = np.flatnonzero((symbol != none[:, None]).any(axis=1))
    tell = tell[np.argsort(-np.abs(none - least)[tell], kind="stable")]
    # by how much all cells to come make up for the others at most
    rest = np.append(np.cumsum(np.minimum(least, none)[tell][::-1])[::-1], 0)
    rest = rest + none.sum() - none[tell].sum()
    array, owners = embossed.array, embossed.owners[:-1]
    row, column = (
        part.astype(np.int64) for part in np.divmod(embossed.keys, np.uint64(array.columns))
    )
    total, held = np.zeros(len(row), np.int64), np.zeros((0, len(row)), np.bool_)
    for done, n in enumerate(tell.tolist(), 1):
        i, j = cells[n].tolist()
        holder, _ = embossed.at((row - j) % array.rows, (column + i) % array.columns)
        here = holder == owners
        total = total + np.where(here, least[n], none[n])
        held = np.concatenate([held, here[None]])
        kept = total + rest[done] <= 0
        row, column, owners = row[kept], column[kept], owners[kept]
        total, held = total[kept], held[:, kept]
    outlines, count = np.unique(held, axis=1, return_counts=True)
    return float(
        sum(
            number
            * _share_within(symbol[tell[outline]], int(none[tell[outline]].sum()) - int(none.sum()))
            for outline, number in zip(outlines.T, count.tolist(), strict=True)
        )
    )
