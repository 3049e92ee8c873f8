"""The thesis's own way with wrong symbols: look for a good tuple. Thesis 5.4.3, closing remark.

A tuple with a wrong symbol is thrown away, and one is taken that fits its neighbours. Every
window of the array's unique shape inside the view is a tuple; it is good if it belongs
together with all cells that adjoin it; if there is none, with those on three sides, then two
(one, where the view is no wider or no higher than the tuple).
The first good one is converted. The baseline for `likelihood`: it uses a part of what is
seen, answers without a measure of doubt, and counts nothing against an answer but those
neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from decoder.decoded import Decodings, Reason
from decoder.errors import MethodError
from decoder.exact import conversion
from decoder.register import Register
from decoder.window import checked_labels
from generator.array.fold import FoldedArray
from generator.array.product import ProductArray

#: cells above, below, before, after a tuple that must belong to it: the strictest demand first
_NEIGHBOURS = sorted(product((1, 0), repeat=4), key=sum, reverse=True)


def decode_good_tuple(array: FoldedArray | ProductArray, windows: ArrayLike) -> Decodings:
    """Decode views (N, rows, columns) larger than the unique window by their first good tuple.

    Raises `MethodError` for product arrays, whose tuples are one-dimensional, and for views that do
    not hold the array's unique window.
    """
    if isinstance(array, ProductArray):
        raise MethodError(
            "good tuples are looked for in folded arrays", fix="take method likelihood"
        )
    labels = array.terms_of(checked_labels(windows, array.order))
    number, a, b = labels.shape
    height, width = array.window
    if a < height or b < width:
        raise MethodError(
            f"a {a}x{b} view holds no tuple of {height}x{width}",
            fix="take method likelihood, or a larger view",
        )
    method = conversion(array.sequence, "logarithm")
    rows, columns = np.zeros((2, number), dtype=np.uint64)
    open_ = np.ones(number, dtype=np.bool_)
    registers: dict[tuple[int, int, int, int], Register] = {}
    for top, left, r, c in _tuples((a, b), (height, width)):
        part = labels[:, r.start : r.stop, c.start : c.stop].reshape(number, len(r) * len(c))
        ready = np.flatnonzero(open_ & (part >= 0).all(axis=1))
        if ready.size == 0:
            continue
        key = (r.start - top, c.start - left, len(r), len(c))
        if key not in registers:
            cells = np.meshgrid(np.array(r) - top, np.array(c) - left, indexing="ij")
            registers[key] = Register(array.sequence, array.offsets(*cells))
        states, good = registers[key].read(part[ready])
        good &= registers[key].nonzero(states)
        t = method.convert(states[good])
        found = ready[good]
        rows[found] = _moved_back(t % np.uint64(array.rows), top, array.rows)
        columns[found] = _moved_back(t % np.uint64(array.columns), left, array.columns)
        open_[found] = False
    reasons = np.where(open_, Reason.AMBIGUOUS, Reason.NONE).astype(np.uint8)
    return Decodings(array.columns, rows, columns, None, reasons)


def _tuples(
    view: tuple[int, int], size: tuple[int, int]
) -> Iterator[tuple[int, int, range, range]]:
    """Yield every tuple's top and left, with the rows and columns of it and its neighbours."""
    every = product(range(view[0] - size[0] + 1), range(view[1] - size[1] + 1))
    corners = list(every)
    weakest = 0 if view == size else 2 if size[0] < view[0] and size[1] < view[1] else 1
    for up, down, before, after in _NEIGHBOURS:
        if up + down + before + after < weakest:
            return
        for top, left in corners:
            r = range(top - up, top + size[0] + down)
            c = range(left - before, left + size[1] + after)
            if r.start >= 0 and c.start >= 0 and r.stop <= view[0] and c.stop <= view[1]:
                yield top, left, r, c


def _moved_back(places: NDArray[np.uint64], steps: int, cycle: int) -> NDArray[np.uint64]:
    short = places < steps
    return np.where(short, places + np.uint64(cycle - steps % cycle), places - np.uint64(steps))
