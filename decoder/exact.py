"""Windows without wrong symbols -> places, by every method of the thesis. Thesis 5.1, 5.3-5.5.

Windows are read as linear equations (`register`), so any set of visible cells of full rank
serves, in any array: folded ones by one index, t -> (t mod rows, t mod columns); product arrays
by two, one a factor. Cells beyond the needed ones are checked. A window that fails its checks
is no window of the array; one that shows too few cells gets its candidates listed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from decoder.decoded import Candidate, Decodings, Reason
from decoder.element import Element
from decoder.errors import MethodError
from decoder.logarithm import Logarithm
from decoder.milestones import Milestones, Table, serial
from decoder.register import LISTED, Register, read_scattered
from decoder.window import ERASED, checked_labels
from generator.array.contract import Labels
from generator.array.fold import FoldedArray
from generator.array.product import ProductArray
from generator.array.sequence import Sequence

_FEW_MASKS = 4  # sets of visible cells for which a linear map each is prepared


Conversion = Table | Milestones | Logarithm  #: a method: field elements (N,) -> indices (N,)
METHODS: dict[str, Callable[[Sequence], Conversion]] = {
    "table": Table,
    "serial": serial,
    "milestones": Milestones,
    "logarithm": Logarithm,
}


@lru_cache(maxsize=32)
def conversion(sequence: Sequence, method: str) -> Conversion:
    """Return the prepared method for a sequence, the same object for the same arguments."""
    if method not in METHODS:
        raise MethodError(
            f"unknown method '{method}'", fix=f"choose one of {', '.join(METHODS)}, likelihood"
        )
    return METHODS[method](sequence)


@lru_cache(maxsize=4096)
def _register(sequence: Sequence, offsets: tuple[int, ...]) -> Register:
    return Register(sequence, list(offsets))


@dataclass(frozen=True, slots=True)
class Terms:
    """Indices found on one sequence."""

    indices: NDArray[np.uint64]  #: (N,) has no meaning where a reason is given
    reasons: NDArray[np.uint8]  #: (N,) values of `Reason`
    candidates: dict[int, list[int]]  #: indices that an undetermined window allows


def convert_terms(sequence: Sequence, offsets: list[int], labels: Labels, method: str) -> Terms:
    """Find the indices of symbols (N, k), -1 where none is seen, at offsets of one sequence."""
    number = len(labels)
    found = Terms(np.zeros(number, np.uint64), np.zeros(number, np.uint8), {})
    prepared = conversion(sequence, method)
    masks = _masks(labels >= 0)
    if len(masks) > _FEW_MASKS:
        states, determined, right = read_scattered(sequence, offsets, labels)
        found.indices[determined & right] = prepared.convert(states[determined & right])
        found.reasons[determined & ~right] = Reason.NOT_ENCODED
        masks = [
            (mask, left) for mask, members in masks if (left := members[~determined[members]]).size
        ]
    for mask, members in masks:
        seen = np.flatnonzero(mask)
        if seen.size == 0:
            found.reasons[members] = Reason.TOO_FEW
            continue
        register = _register(sequence, tuple(offsets[cell] for cell in seen.tolist()))
        whole = members.size == number and seen.size == labels.shape[1]
        states, right = register.read(labels if whole else labels[np.ix_(members, seen)])
        if not register.determined:
            _list_candidates(found, register, prepared, members, states, right)
            continue
        right &= register.nonzero(states)
        if right.all():
            found.indices[members] = prepared.convert(states)
        else:
            found.indices[members[right]] = prepared.convert(states[right])
            found.reasons[members[~right]] = Reason.NOT_ENCODED
    return found


def _masks(seen: NDArray[np.bool_]) -> list[tuple[NDArray[np.bool_], NDArray[np.intp]]]:
    """Group windows by the cells that they show."""
    if seen.all():
        return [(seen[0], np.arange(len(seen)))] if len(seen) else []
    whole, place = np.unique(seen, axis=0, return_inverse=True)
    order = np.argsort(place.ravel(), kind="stable")
    bounds = np.searchsorted(place.ravel()[order], np.arange(len(whole) + 1))
    return [(mask, order[bounds[i] : bounds[i + 1]]) for i, mask in enumerate(whole)]


def _list_candidates(
    found: Terms,
    register: Register,
    prepared: Conversion,
    members: NDArray[np.intp],
    states: Element,
    right: NDArray[np.bool_],
) -> None:
    """Give the reason, and the places that stay open if they are few."""
    found.reasons[members] = np.where(right, Reason.TOO_FEW, Reason.NOT_ENCODED)
    others = register.open_elements()
    if len(others) > LISTED:
        return
    ring = register.sequence.ring
    for i in np.flatnonzero(right):
        allowed = others ^ states[i] if ring.prime == 2 else ring.reduced(others + states[i])
        allowed = allowed[register.nonzero(allowed)]
        found.candidates[int(members[i])] = sorted(prepared.convert(allowed).tolist())


def convert_product(array: ProductArray, labels: Labels, method: str) -> tuple[Terms, Terms]:
    """Return the indices along the rows and along the columns of (N, a, b) windows.

    Every symbol gives the term of its row and the term of its column: one visible symbol in every
    row and every column that is needed serves, max(k1, k2) of them for a k1 x k2 window, not
    p + q - 1 as the thesis says for figure 5.11. Symbols of one row must agree.
    """
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


def decode_exact(
    array: FoldedArray | ProductArray, windows: ArrayLike, method: str = "logarithm"
) -> Decodings:
    """Decode windows without wrong symbols: (N, rows, columns) labels, -1 where none is seen.

    Or one window. "too few symbols" (and up to 64 candidates) where the cells seen have not full
    rank, "not an encoded surface" where they contradict the array. Raises `WindowError` if the
    windows are not of this array's symbols, `MethodError` if the method is unknown or the array too
    large for it.

    >>> from generator.array import profile
    >>> window = [[0, 1], [1, 1], [0, 1], [0, 1], [0, 0], [0, 1]]  # figure 6.17
    >>> decode_exact(profile("thesis").array(), window)[0].t
    2206
    """
    labels = checked_labels(windows, array.order)
    if isinstance(array, ProductArray):
        return _of_product(array, labels, method)
    offsets = array.offsets(*np.indices(labels.shape[1:]))
    seen = array.terms_of(labels).reshape(len(labels), len(offsets))
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
