"""Maximum likelihood: the likeliest place of windows with wrong and missing symbols.

Scores or labels -> place, margin, runner-up, and a doubt: the probability that the likeliest
place is not the right one. All places (or those of a prior, or of several rotations) are
weighed, against each other and against a surface that carries no code; beyond the doubt
allowed nothing is answered, and the candidates are listed. What weighs them: `ranking`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from decoder.decoded import Candidate, Decodings, Reason
from decoder.errors import WindowError
from decoder.ranking import Places, Ranked, Ranking, best_of_all, concatenate, ranking_of
from decoder.window import (
    SYMBOL_ERROR,
    Scores,
    checked_labels,
    checked_scores,
    hard_scores,
    unrelated_score,
)
from generator.array.fold import FoldedArray
from generator.array.product import ProductArray

DOUBT = 5e-4  #: largest probability of a wrong answer that is still given
BLANK = 0.01  #: probability that a window shows no code at all
_LISTED = 16  #: candidates listed where nothing is answered
_FAR = 7.0  #: nats below the best: no candidate (odds of 1 to 1,100)
_VALUES = 1 << 18  #: log-likelihoods held at a time
_WINDOWS = 1 << 10  #: windows weighed at a time

Weighed = tuple[Ranked, NDArray[np.uint8], NDArray[np.float64], int]


class Likelihood:
    """A prepared maximum likelihood decoder.

    Parameters
    ----------
    array, prior
        The array, and (P, 2) rows and columns at which a window may lie; all by default.
    rotations
        Quarter turns, counter-clockwise (`numpy.rot90`), that may bring a window upright.
    error
        Probability that a symbol is read wrong, for windows given as labels.
    doubt
        Largest probability of a wrong answer that is still given.
    blank
        Probability that a window shows a surface without code; 0 where that cannot be.

    Examples
    --------
    >>> from generator.array import profile
    >>> window = profile("thesis").array().symbols(*np.indices((6, 6)))
    >>> window[2, 3] ^= 1
    >>> found = Likelihood(profile("thesis").array()).decode(window)[0]
    >>> found.row, found.column, round(found.margin, 2)
    (0, 0, 14.72)
    """

    def __init__(
        self,
        array: FoldedArray | ProductArray,
        *,
        prior: ArrayLike | None = None,
        rotations: Sequence[int] = (0,),
        error: float = SYMBOL_ERROR,
        doubt: float = DOUBT,
        blank: float = BLANK,
    ) -> None:
        self.array = array
        self.rotations = tuple(rotations)
        if not self.rotations or not set(self.rotations) <= {0, 1, 2, 3}:
            raise WindowError(
                f"rotations {list(rotations)} were given; they are quarter turns, 0 to 3",
                fix="give (0,) for windows that are upright, (0, 1, 2, 3) for all",
            )
        if not (0 < doubt <= 1 and 0 <= blank < 1):
            raise WindowError(
                f"doubt {doubt} and blank {blank} were given; they are probabilities, doubt "
                "above 0 and blank below 1",
                fix="leave them out for the defaults",
            )
        self.error, self.doubt, self.blank = error, doubt, blank
        self._prior = None if prior is None else np.array(prior)
        self._places: dict[tuple[int, int], Ranking] = {}

    def ranking(self, shape: tuple[int, int]) -> Ranking:
        """Return what weighs windows of one shape."""
        if self._prior is None:
            return ranking_of(self.array, shape)
        if shape not in self._places:
            self._places[shape] = Places(self.array, shape, self._prior)
        return self._places[shape]

    def decode(self, windows: ArrayLike, top: int = 0) -> Decodings:
        """Decode windows (N, rows, columns), labels with -1 where no symbol is seen; or one window.

        Or log-likelihoods (N, rows, columns, q), floating point. `top`: candidates to list for
        every window; by default 16 for those not answered. Raises `WindowError` if they are not of
        this array.
        """
        given = np.asarray(windows)
        if given.dtype.kind == "f":
            scores = checked_scores(given, self.array.order)
        else:
            labels = checked_labels(given, self.array.order)
            scores = hard_scores(labels, self.array.order, self.error)
        if len(scores) == 0:
            none = np.zeros(0, dtype=np.uint64)
            return Decodings(self.array.columns, none, none, None, none.astype(np.uint8))
        weighed = _weigh(self, scores, max(2, top))
        return _answers(self, scores, weighed, top)


def decode_likelihood(
    array: FoldedArray | ProductArray,
    windows: ArrayLike,
    *,
    prior: ArrayLike | None = None,
    rotations: Sequence[int] = (0,),
    error: float = SYMBOL_ERROR,
    doubt: float = DOUBT,
    blank: float = BLANK,
    top: int = 0,
) -> Decodings:
    """Decode windows by maximum likelihood, once; see `Likelihood`."""
    decoder = Likelihood(
        array, prior=prior, rotations=rotations, error=error, doubt=doubt, blank=blank
    )
    return decoder.decode(windows, top)


def _weigh(decoder: Likelihood, scores: Scores, number: int) -> Weighed:
    """Return the best places, their rotation (N, K), the doubt (N,), and how many were weighed."""
    parts, places = [], 0
    for turn in decoder.rotations:
        turned = np.rot90(scores, turn, axes=(1, 2))
        ranking = decoder.ranking((turned.shape[1], turned.shape[2]))
        flat = np.ascontiguousarray(turned).reshape(len(scores), -1, scores.shape[3])
        block = max(1, min(_WINDOWS, _VALUES // ranking.work))
        starts = range(0, max(1, len(scores)), block)
        chunks = [ranking.rank(flat[start : start + block], number) for start in starts]
        parts.append(concatenate(chunks))
        places += ranking.size
    best, source = best_of_all(parts, number) if len(parts) > 1 else (parts[0], None)
    rotations = np.array(decoder.rotations, dtype=np.uint8)
    turns = np.full(best.rows.shape, rotations[0]) if source is None else rotations[source]
    flat = scores.reshape(len(scores), -1, scores.shape[3])
    odds = decoder.blank / (1 - decoder.blank) * places
    nothing = odds * np.exp((unrelated_score(flat) - best.values[:, 0]).clip(max=100.0))
    others = np.where(np.isfinite(best.values[:, 0]), best.rest + nothing, 1e30)
    return best, turns, others / (1 + others), places


def _answers(decoder: Likelihood, scores: Scores, weighed: Weighed, top: int) -> Decodings:
    best, turns, doubts, _ = weighed
    array = decoder.array
    reasons = np.where(doubts > decoder.doubt, Reason.AMBIGUOUS, Reason.NONE).astype(np.uint8)
    listed = {i: _candidates(best, turns, i) for i in range(len(scores))} if top else {}
    refused = np.flatnonzero(reasons)
    if refused.size:
        reasons[refused] = _why(decoder, scores[refused], weighed, refused)
        if not top:
            more = _weigh(decoder, scores[refused], _LISTED)
            for place, i in enumerate(refused.tolist()):
                if reasons[i] != Reason.NOT_ENCODED:
                    listed[i] = _candidates(more[0], more[1], place, _FAR)
    single = best.rows.shape[1] < 2
    margins = np.full(len(scores), np.inf) if single else best.values[:, 0] - best.values[:, 1]
    second = min(1, best.rows.shape[1] - 1)
    indices = None
    if isinstance(array, FoldedArray):
        indices = _indices(array, best.rows[:, 0], best.columns[:, 0])
    return Decodings(
        array.columns,
        best.rows[:, 0],
        best.columns[:, 0],
        indices,
        reasons,
        margins,
        doubts,
        turns[:, 0],
        (best.rows[:, second], best.columns[:, second], turns[:, second]),
        listed,
    )


def _why(
    decoder: Likelihood, scores: Scores, weighed: Weighed, refused: NDArray[np.intp]
) -> NDArray[np.uint8]:
    """Tell too few symbols from a tie, and a tie from a surface without code."""
    best, _, _, places = weighed
    flat = scores.reshape(len(scores), -1, scores.shape[3])
    likely = best.values[refused, 0] + np.log1p(best.rest[refused])
    odds = decoder.blank / (1 - decoder.blank) * places
    without = likely < unrelated_score(flat) + np.log(max(odds, np.finfo(float).tiny))
    reasons = np.where(without, Reason.NOT_ENCODED, Reason.AMBIGUOUS)
    known: dict[bytes, bool] = {}
    for i, seen in enumerate((scores != 0).any(axis=3)):
        key = seen.tobytes()
        if key not in known:
            cells = np.nonzero(seen)
            known[key] = bool(cells[0].size) and decoder.array.identifies(*cells)
        if not known[key]:
            reasons[i] = Reason.TOO_FEW
    return reasons.astype(np.uint8)


def _candidates(
    best: Ranked, turns: NDArray[np.uint8], place: int, far: float = np.inf
) -> tuple[Candidate, ...]:
    values = best.values[place] - best.values[place, 0]
    kept = np.flatnonzero(np.isfinite(values) & (values >= -far)).tolist()
    return tuple(
        Candidate(
            int(best.rows[place, k]),
            int(best.columns[place, k]),
            int(turns[place, k]),
            round(float(values[k]), 6),
        )
        for k in kept
    )


def _indices(
    array: FoldedArray, rows: NDArray[np.uint64], columns: NDArray[np.uint64]
) -> NDArray[np.uint64]:
    """Return t of cells: r e1 + c e2 modulo N; small arrays in 64 bits, others exactly."""
    if array.sequence.period < 1 << 31:
        steps = rows * np.uint64(array.row_step) + columns * np.uint64(array.column_step)
        return steps % np.uint64(array.sequence.period)
    exact = [array.index(r, c) for r, c in zip(rows.tolist(), columns.tolist(), strict=True)]
    return np.array(exact, dtype=np.uint64)
