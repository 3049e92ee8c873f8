"""Windows -> places by an exact method, for every family of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from decoder.convert import convert_terms
from decoder.decoded import Candidate, Decodings, Reason
from decoder.product import convert_product
from decoder.register import LISTED
from decoder.window import checked_labels
from generator.array.contract import Labels
from generator.array.fold import FoldedArray
from generator.array.product import ProductArray


def decode_exact(
    array: FoldedArray | ProductArray, windows: ArrayLike, method: str = "logarithm"
) -> Decodings:
    """Decode windows without wrong symbols.

    Parameters
    ----------
    array
        The array.
    windows
        (rows, columns) or (N, rows, columns) labels, -1 where a symbol is not seen.
    method
        "table", "serial", "milestones" or "logarithm".

    Returns
    -------
    Decodings
        With "too few symbols" (and up to 64 candidates) where the cells seen have not full
        rank, "not an encoded surface" where they contradict the array.

    Raises
    ------
    WindowError
        If the windows are not of this array's symbols.
    MethodError
        If the method is unknown, or the array is too large for it.

    Examples
    --------
    >>> from generator.array import profile
    >>> window = [[0, 1], [1, 1], [0, 1], [0, 1], [0, 0], [0, 1]]  # figure 6.17
    >>> decode_exact(profile("thesis").array(), window)[0].t
    2206
    """
    labels = checked_labels(windows, array.order)
    if isinstance(array, ProductArray):
        return _of_product(array, labels, method)
    number, a, b = labels.shape
    offsets = _offsets(array, a, b)
    seen = array.terms_of(labels).reshape(number, a * b)
    terms = convert_terms(array.sequence, offsets, seen, method)
    rows, columns = np.uint64(array.rows), np.uint64(array.columns)
    listed = {
        i: tuple(Candidate(*array.cell(t)) for t in places)
        for i, places in terms.candidates.items()
    }
    return Decodings(
        array.columns,
        terms.indices % rows,
        terms.indices % columns,
        terms.indices,
        terms.reasons,
        candidates=listed,
    )


def _offsets(array: FoldedArray, a: int, b: int) -> list[int]:
    period = array.sequence.period
    return [
        (r * array.row_step + c * array.column_step) % period for r in range(a) for c in range(b)
    ]


def _of_product(array: ProductArray, labels: Labels, method: str) -> Decodings:
    in_rows, in_columns = convert_product(array, labels, method)
    reasons = np.maximum(in_rows.reasons, in_columns.reasons)
    listed = {}
    for i in np.flatnonzero(reasons == Reason.TOO_FEW).tolist():
        pairs = []
        for part in (in_rows, in_columns):
            known = [int(part.indices[i])] if part.reasons[i] == Reason.NONE else []
            pairs.append(part.candidates.get(i, known))
        if 0 < len(pairs[0]) * len(pairs[1]) <= LISTED:
            listed[i] = tuple(Candidate(row, column) for row in pairs[0] for column in pairs[1])
    return Decodings(
        array.columns, in_rows.indices, in_columns.indices, None, reasons, candidates=listed
    )
