"""Windows as arrays and as text, checked.

A batch is (N, rows, columns) labels, -1 where a symbol is not seen, or (N, rows, columns, q)
scores: the log-likelihood of every symbol at every cell, in nats, all 0 where none is seen.
Text: rows apart by spaces, `?` for an erased symbol: "01 11 0? 01 00 01".
"""

from __future__ import annotations

from math import log
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from decoder.errors import WindowError
from generator.array.contract import Labels

ERASED = -1  #: label of a symbol that is not seen
SYMBOL_ERROR = 0.05  #: probability that a symbol is read wrong, where no scores say so
LARGEST_SCORE = 1e6  #: nats; beyond it single precision loses single cells


def parse_window(text: str, order: int) -> Labels:
    """Return the (rows, columns) labels of a text; labels above 9 apart by commas: "10,3 0,?".

    A row of one label above 9 ends with a comma: "10, 3, ?,".

    Raises `WindowError` with the row if a symbol is unknown or the rows differ in length.
    """
    rows = []
    for number, row in enumerate(text.split(), 1):
        cells = row.removesuffix(",").split(",") if "," in row else list(row)
        for cell in cells:
            if cell != "?" and not (cell.isascii() and cell.isdigit() and int(cell) < order):
                raise WindowError(
                    f"row {number} '{row}': '{cell}' is no symbol of this array, which has 0 to "
                    f"{order - 1}, or ? for one that is not seen",
                    fix="write one digit per symbol, rows apart by spaces, as '01 11 0?'"
                    if order <= 10
                    else "write commas between symbols, rows apart by spaces, as '0,11 ?,3'",
                )
        rows.append([ERASED if cell == "?" else int(cell) for cell in cells])
    if not rows:
        raise WindowError("the window is empty", fix="write rows apart by spaces, as '01 11'")
    if len({len(row) for row in rows}) > 1:
        lengths = ", ".join(str(len(row)) for row in rows)
        raise WindowError(
            f"the rows of a window must be equally long; these have {lengths} symbols",
            fix="write ? for symbols that are not seen",
        )
    return np.array(rows, dtype=np.int64)


def checked_labels(windows: ArrayLike, order: int) -> Labels:
    """Return (N, rows, columns) labels; a single window gets N = 1."""
    given: NDArray[Any] = np.asarray(windows)
    if given.dtype.kind not in "iub" or given.ndim not in (2, 3) or 0 in given.shape[-2:]:
        raise WindowError(
            f"a window is (rows, columns) labels, a batch (N, rows, columns), not {given.shape} "
            f"of {given.dtype}",
            fix="give integers, -1 where a symbol is not seen",
        )
    labels = given.astype(np.int64, copy=False)
    labels = labels[None] if labels.ndim == 2 else labels
    if labels.size and (labels.min() < ERASED or labels.max() >= order):
        raise WindowError(
            f"labels from {labels.min()} to {labels.max()} were given; this array has 0 to "
            f"{order - 1}, and -1 for a symbol that is not seen",
            fix="check which array the window belongs to",
        )
    return labels


def checked_scores(scores: ArrayLike, order: int) -> NDArray[np.float32]:
    """Return (N, rows, columns, q) scores; a single window gets N = 1."""
    given: NDArray[Any] = np.asarray(scores)
    if given.dtype.kind != "f" or given.ndim not in (3, 4) or given.shape[-1] != order:
        raise WindowError(
            f"scores are (rows, columns, {order}) log-likelihoods, or a batch of these, not "
            f"{given.shape} of {given.dtype}",
            fix=f"give one number for each of the {order} symbols at each cell",
        )
    given = given[None] if given.ndim == 3 else given
    if 0 in given.shape[1:]:
        raise WindowError("a window has at least one cell", fix="give one row and one column")
    if not np.isfinite(given).all() or (given.size and np.abs(given).max() > LARGEST_SCORE):
        raise WindowError(
            f"scores must be finite log-likelihoods, at most {LARGEST_SCORE:g} nats apart; "
            f"{np.count_nonzero(~np.isfinite(given))} are NaN or infinite",
            fix="write a symbol that cannot be as -50, and a cell that is not seen as zeros",
        )
    return np.asarray(given - given.max(axis=-1, keepdims=True), dtype=np.float32)


Scores = NDArray[np.float32]


def hard_scores(labels: Labels, order: int, error: float = SYMBOL_ERROR) -> Scores:
    """Return the scores of labels (...), -1 where none is seen, wrong with probability `error`.

    Every wrong symbol is equally likely; `error` is above 0 and below 1 - 1/q, where a symbol says
    nothing.

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
