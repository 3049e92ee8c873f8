"""How many registered places a foreign surface would match as well by chance.

Fit + hypothesis + what is registered -> doubt, the E-value of sequence databases: number of places
times the probability that symbols drawn at random (each alike likely, one independent of the
other) reach at least the score that the hypothesis reached. A cell that shows its symbol clearly
contributes 1 / q; a soft one, the share of symbols that score as well, together with what the
others leave; a bare one, 1. Of bare cells only the places are counted whose own border agrees with
them: a place that holds symbols where the face is bare falls behind farther than the hypothesis.

Where that leaves too large a doubt, the border of the face counts as what it is, a part of what
has to match (`expected_by_border`). A foreign face that bears symbols of this pitch ends somewhere:
it shows an outline in whole cells, and a distance from its end to the last symbols. Given the
outline, symbols are random as before; a place matches only if its own outline does, so places are
counted one by one: one that bears a symbol where none is felt falls behind, and so does one that
bears none where one is felt, which then has fewer symbols to match. Edges match edges, and in a
corner corners. Given outline and symbols, the end of the face still lies anywhere within half a
pitch, each way that it runs: `border.share_of_borders` says how many of these ends fit as well.
With places p, their outlines o(p), and the ways w that the border runs,

    doubt = sum over p of P(symbols of o(p) score as well) x product over w of share(w).

Two labs whose parts have the same sizes end alike, and the shares are then no evidence; doubt is
too small by them there, at most by the 16 that two ways of a quarter each give. What the plate
does not surely press is no border: a bare cell costs others only as far as a symbol would be felt.

The probability is summed over all symbols of all cells at once, on a grid of nats, every score
rounded up: it is never too small but for what the fit of pose and gain to the symbols that are
registered there adds to them. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.belief import VerifiedHypothesis
from recognizer.touch.border import points_on_lattice, share_of_borders, surely_pressed
from recognizer.touch.hypothesis import Hypothesis, bounded_scores, labels_at
from recognizer.touch.lab import EmbossedArray
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


def expected_by_border(
    arrays: Iterable[EmbossedArray],
    found: VerifiedHypothesis,
    tip_mm: float,
    settings: ReaderSettings,
) -> float:
    """Return how many registered places a foreign face matches as well, border and all.

    Infinite in a lab that is too large for places to be counted one by one.

    Parameters
    ----------
    arrays
        Of the lab. Those count that are embossed alike.
    tip_mm
        Diameter of a tactel's tip.
    """
    embossed, fit = found.embossed, found.fit
    alike = [
        one for one in arrays if (one.alphabet, one.style) == (embossed.alphabet, embossed.style)
    ]
    if sum(len(one.keys) for one in alike) > settings.hypotheses.large:
        return math.inf
    scores = bounded_scores(fit, settings.hypotheses)
    held = labels_at(embossed, found.hypothesis, fit.cells)
    shown = held < embossed.array.order
    ahead = scores[np.arange(len(held)), held][:, None] - scores
    sure = np.where(shown, 1.0, _pressed_share(found, settings))
    ahead = np.where(ahead > 0, ahead * sure[:, None], ahead)
    behind = np.floor(ahead / settings.belief.grain).astype(np.int64)
    anchor = int(np.argmax(np.where(shown, fit.seen, -1.0)))
    cells = fit.cells - fit.cells[anchor]
    places = sum(_expect_matches(one, cells, behind) for one in alike)
    return places * share_of_borders(found, tip_mm, settings.border)


def _pressed_share(found: VerifiedHypothesis, settings: ReaderSettings) -> Array:
    """Return of each cell (m,) the share of its tactels that a symbol there would surely press."""
    image, fit, border = found.image, found.fit, settings.border
    pressed = surely_pressed(image, fit.gain, border.symbol, border)
    at = np.floor(points_on_lattice(image, fit) / found.template.pitch_mm).astype(np.int64)
    on = (at[None] == fit.cells[:, None]).all(axis=2)
    return np.asarray((on & pressed).sum(axis=1) / np.maximum(on.sum(axis=1), 1))


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
    for cell in (behind - ahead[:, None]).tolist():
        before, reached = reached, np.zeros(slack + 1)
        for step in cell:
            if step <= slack:
                reached[step:] += before[: slack + 1 - step]
        reached /= len(cell)
    return float(reached.sum())


def _expect_matches(embossed: EmbossedArray, cells: Ints, behind: Ints) -> float:
    """Return how many places random symbols match, outlines and all.

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
    total = np.zeros(len(row), np.int64)
    for done, n in enumerate(tell.tolist(), 1):
        total += np.where(_bears(embossed, row, column, owners, cells[n]), least[n], none[n])
        kept = total + rest[done] <= 0
        if not kept.all():
            row, column, owners, total = row[kept], column[kept], owners[kept], total[kept]
    at = row[:, None], column[:, None], owners[:, None]
    bears = _bears(embossed, *at, cells[tell].T)
    outlines, count = np.unique(np.packbits(bears, axis=1), axis=0, return_counts=True)
    bears = np.unpackbits(outlines, axis=1, count=len(tell)).astype(np.bool_)
    bare = int(none.sum())
    return float(
        sum(
            number * _share_within(symbol[tell[one]], int(none[tell[one]].sum()) - bare)
            for one, number in zip(bears, count.tolist(), strict=True)
        )
    )


def _bears(
    embossed: EmbossedArray, row: Ints, column: Ints, owners: NDArray[np.int32], cell: Ints
) -> NDArray[np.bool_]:
    """Return whether places hold symbols of their own face at cells (2, ...) counted from them."""
    array = embossed.array
    held_by, _ = embossed.at((row - cell[1]) % array.rows, (column + cell[0]) % array.columns)
    return np.asarray(held_by == owners)


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
