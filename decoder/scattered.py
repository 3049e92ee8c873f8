"""Windows that each miss other symbols: their field elements, all in one elimination.

`register` prepares one linear map for the cells seen, which pays when many windows show the
same cells. Here every window has cells of its own, so the elimination itself runs over the
batch (`dual`): independent cells that are seen are chosen, and the element is put together
from the dual basis and checked against all cells seen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from decoder.dual import binary_dual, odd_dual
from decoder.element import Element, elements_of
from generator.array.contract import Labels
from generator.array.residue import pack_words
from generator.array.sequence import Sequence


def read_scattered(
    sequence: Sequence, offsets: list[int], labels: Labels
) -> tuple[Element, NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the elements (N,), which windows are determined, and which pass their checks.

    Parameters
    ----------
    sequence
        The m-sequence.
    offsets
        (k,) relative indices.
    labels
        (N, k) symbols, -1 where none is seen.
    """
    ring, field = sequence.ring, sequence.field
    functionals = sequence.functionals(sequence.element(offsets)).reshape(-1, ring.degree)
    seen = np.repeat(labels >= 0, field.degree, axis=1)  # by digits, (N, k m)
    digits = field.digits[np.maximum(labels, 0)].reshape(len(labels), -1)
    order = np.argsort(~seen, axis=1, kind="stable")
    lines = np.arange(len(labels))[:, None]
    states: Element
    known: NDArray[np.bool_]
    if ring.prime == 2:
        words = pack_words(functionals)
        basis, chosen = binary_dual(words, order, ring.degree)
        known = (chosen >= 0) & seen[lines, chosen]
        parts = np.where(known & (digits[lines, chosen] == 1), basis, np.uint64(0))
        states = np.bitwise_xor.reduce(parts, axis=1)
        expected = np.bitwise_count(states[:, None] & words) & 1
    else:
        vectors, chosen = odd_dual(functionals, order, ring.prime)
        known = (chosen >= 0) & seen[lines, chosen]
        scales = np.where(known, digits[lines, chosen], 0).astype(np.float64)
        states = ring.reduced((scales[:, None] @ vectors)[:, 0])
        expected = ring.reduced(states @ functionals.T)
    right = ((expected == digits) | ~seen).all(axis=1)
    right &= elements_of(ring).keys(states) != 0
    return states, np.asarray(known.all(axis=1)), right
