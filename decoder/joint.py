"""Maximum likelihood on product arrays: both factors jointly. Thesis 5.3, 5.5.

S(i, j) = sum over cells (a, b) of L_ab(law(SR[i + a], SC[j + b])): summed over a for every i
first, then over b for every j. Where all pairs are too many, rows are taken in falling order
of an upper bound of their best pair, until no other row can be listed or weigh: still exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from decoder.errors import MethodError
from decoder.ranked import Ranked, best_of, best_of_all
from decoder.score import Scores
from decoder.settings import LIKELIHOOD
from generator.array.product import ProductArray
from generator.array.sequence import Sequence

LARGEST_FACTOR = 1 << 16  #: terms of one sequence
_PAIRS = 1 << 18  #: pairs that are looked at together


class Joint:
    """All places of a product array, for windows of one shape."""

    def __init__(self, array: ProductArray, shape: tuple[int, int]) -> None:
        if max(array.rows, array.columns) > LARGEST_FACTOR:
            raise MethodError(
                f"maximum likelihood on {array.rows}x{array.columns} places of a product array "
                f"is limited to {LARGEST_FACTOR} rows and columns",
                fix="give a prior, the cells that are registered, or take method logarithm",
            )
        self.size = array.rows * array.columns
        self.work = min(self.size, _PAIRS)
        self._law = array.law
        self._shape = shape
        self._in_rows = _terms(array.row_sequence, shape[0])  # (a qr, rows)
        self._in_columns = _terms(array.column_sequence, shape[1])  # (b qc, columns)

    def rank(self, scores: Scores, number: int) -> Ranked:
        """Return the best places of scores (N, k, q)."""
        if self.size > _PAIRS:
            parts = [self._searched(window, number) for window in scores]
            fields = ("rows", "columns", "values", "rest")
            return Ranked(*(np.concatenate([getattr(p, f) for p in parts]) for f in fields))
        by_row = self._by_row(scores)
        values = np.matmul(by_row, self._in_columns).reshape(len(scores), -1)
        return self._ranked(*best_of(values, number))

    def _by_row(self, scores: Scores) -> NDArray[np.float32]:
        """Return (N, rows, b qc): scores of each column's term, if the window is in row i."""
        (a, b), (qr, qc) = self._shape, self._law.shape
        parts = scores.reshape(-1, a, b, qr * qc)[..., self._law]  # (N, a, b, qr, qc)
        columns = parts.transpose(0, 2, 4, 1, 3).reshape(-1, b * qc, a * qr)
        return np.asarray(np.matmul(columns, self._in_rows).transpose(0, 2, 1))

    def _searched(self, window: Scores, number: int) -> Ranked:
        by_row = self._by_row(window[None])[0]
        bounds = by_row.reshape(len(by_row), self._shape[1], -1).max(axis=2).sum(axis=1)
        order = np.argsort(-bounds, kind="stable")
        block = max(1, _PAIRS // self._in_columns.shape[1])
        best: Ranked | None = None
        for start in range(0, len(order), block):
            rows = order[start : start + block]
            if best is not None and best.values.shape[1] >= number:
                negligible = best.values[0, 0] - LIKELIHOOD.negligible
                if bounds[rows[0]] < min(best.values[0, -1], negligible):
                    break
            values = (by_row[rows] @ self._in_columns).reshape(1, -1)
            places, chosen, rest = best_of(values, number)
            places = rows[places // self._columns] * self._columns + places % self._columns
            found = self._ranked(places, chosen, rest)
            best = found if best is None else best_of_all([best, found], number)[0]
        assert best is not None
        return best

    @property
    def _columns(self) -> int:
        return int(self._in_columns.shape[1])

    def _ranked(
        self, places: NDArray[np.intp], chosen: NDArray[np.float64], rest: NDArray[np.float64]
    ) -> Ranked:
        rows, columns = np.divmod(places.astype(np.uint64), np.uint64(self._columns))
        return Ranked(rows, columns, chosen, rest)


def _terms(sequence: Sequence, length: int) -> NDArray[np.float32]:
    """Return (length q, N): whether the term after k steps from place i is y."""
    terms = sequence.symbols(np.arange(sequence.period + length))
    windows = np.lib.stride_tricks.sliding_window_view(terms, length)[: sequence.period]
    every = windows[..., None] == np.arange(sequence.field.order)
    return np.asarray(every.reshape(sequence.period, -1).T, dtype=np.float32)
