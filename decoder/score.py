"""What symbols seen say about each symbol: log-likelihoods, in nats.

A score is (N, k, q): how much less likely symbol y at cell k is than the likeliest one, so
0 or negative. Cells that are not seen have zeros.
"""

from __future__ import annotations

from math import log

import numpy as np
from numpy.typing import NDArray

from decoder.errors import WindowError
from decoder.settings import LIKELIHOOD
from generator.array.contract import Labels

Scores = NDArray[np.float32]


def hard_scores(labels: Labels, order: int, error: float = LIKELIHOOD.symbol_error) -> Scores:
    """Return the scores of labels that are wrong with probability `error`.

    Parameters
    ----------
    labels
        (...) symbols, -1 where none is seen.
    order
        q; every wrong symbol is equally likely.
    error
        Above 0 and below 1 - 1/q, where a symbol says nothing.

    Examples
    --------
    >>> hard_scores(np.array([0, -1]), 2, 0.2).tolist()
    [[0.0, -1.3862943649291992], [0.0, 0.0]]
    """
    if not 0 < error < 1 - 1 / order:
        raise WindowError(
            f"a symbol error rate of {error} was given; it lies above 0 and below "
            f"{1 - 1 / order:g}, where a symbol of {order} says nothing",
            fix="give 0.01 for reliable symbols",
        )
    table = np.full((order + 1, order), -log((1 - error) * (order - 1) / error), dtype=np.float32)
    np.fill_diagonal(table, 0.0)
    table[-1] = 0.0  # label -1
    return table[labels]


def unrelated_score(scores: Scores) -> NDArray[np.float64]:
    """Return the log-likelihood of each window (N, k, q) if its symbols are unrelated.

    It is the share of a surface without code, and the expected share of one wrong place.
    """
    return np.asarray(np.log(np.exp(scores, dtype=np.float64).mean(axis=2)).sum(axis=1))
