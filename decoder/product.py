"""Product arrays: two one-dimensional conversions. Thesis 5.3, 5.5.

Every symbol gives the term of its row and the term of its column, so one visible symbol in
every row and every column that is needed serves: max(k1, k2) of them for a k1 x k2 window,
not p + q - 1 as the thesis says for figure 5.11. Symbols of one row must agree.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from decoder.convert import Terms, convert_terms
from decoder.decoded import Reason
from decoder.window import ERASED
from generator.array.contract import Labels
from generator.array.product import ProductArray


def convert_product(array: ProductArray, labels: Labels, method: str) -> tuple[Terms, Terms]:
    """Return the indices along the rows and along the columns of (N, a, b) windows."""
    factors = np.concatenate([array.factors, np.full((1, 2), ERASED)])[labels]
    found = []
    for axis, sequence in enumerate((array.row_sequence, array.column_sequence)):
        terms, agree = _agreement(factors[..., axis], 2 - axis)
        part = convert_terms(sequence, list(range(terms.shape[1])), terms, method)
        found.append((part, agree))
    (in_rows, rows_agree), (in_columns, columns_agree) = found
    wrong = ~(rows_agree & columns_agree)
    for part in (in_rows, in_columns):
        part.reasons[wrong] = Reason.NOT_ENCODED
    return in_rows, in_columns


def _agreement(factors: Labels, axis: int) -> tuple[Labels, NDArray[np.bool_]]:
    """Return the (N, k) terms that the symbols of each line show, and whether they agree."""
    high = factors.max(axis=axis)
    low = np.where(factors == ERASED, np.iinfo(np.int64).max, factors).min(axis=axis)
    return high, np.asarray(((high == low) | (high == ERASED)).all(axis=1))
