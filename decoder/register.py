"""Window -> field element: the fixed linear map that appendix 5 of the thesis leaves out.

Symbols seen at given offsets of an m-sequence are linear functionals of the field element
x^t, so x^t = M w. Elimination over GF(p) of the functionals gives M, the checks that a
window must pass if it shows more cells than it needs, and the elements that stay open if
it shows fewer. The thesis takes the window tuple itself for the remainder r(t) (appendix
5); that holds only after M.
"""

from __future__ import annotations

from functools import cached_property
from itertools import islice, product

import numpy as np
from numpy.typing import NDArray

from decoder.element import Element, elements_of
from generator.array.contract import Labels
from generator.array.residue import Digits, pack_words
from generator.array.sequence import Sequence

LISTED = 64  #: most candidates that are listed


class Register:
    """Symbols seen at offsets (k,) of one sequence, relative to the place, as linear equations."""

    def __init__(self, sequence: Sequence, offsets: list[int]) -> None:
        self.sequence = sequence
        self.elements = elements_of(sequence.ring)
        maps = sequence.functionals(sequence.element(offsets))
        equations = maps.reshape(-1, sequence.ring.degree)
        self._combinations, self._reduced, self.pivots = eliminate(equations, sequence.ring.prime)

    @property
    def determined(self) -> bool:
        """Whether the symbols seen name the place."""
        return len(self.pivots) == self.sequence.ring.degree

    @cached_property
    def _tables(self) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
        """Characteristic 2: (k, q) words of the element, (checks / 64, k, q) words of checks."""
        field, degree = self.sequence.field, self.sequence.ring.degree
        split = self._combinations.T.reshape(-1, field.degree, len(self._combinations))
        parts = np.einsum("qm,kmr->kqr", field.digits.astype(np.float64), split) % 2
        words = np.zeros((*parts.shape[:2], degree))
        words[..., self.pivots] = parts[..., : len(self.pivots)]
        checks = parts[..., len(self.pivots) :]
        starts = range(0, checks.shape[-1], 64)
        blocks = [pack_words(checks[..., start : start + 64]) for start in starts]
        empty = np.zeros((0, *parts.shape[:2]), dtype=np.uint64)
        return pack_words(words), np.array(blocks) if blocks else empty

    def read(self, labels: Labels) -> tuple[Element, NDArray[np.bool_]]:
        """Return the elements (N,) of labels (N, k) seen, and which windows pass their checks.

        Open digits of the element are 0 where the symbols are too few.
        """
        if self.sequence.ring.prime == 2:
            words, checks = self._tables
            places = labels + np.arange(labels.shape[1]) * words.shape[1]
            state = np.bitwise_xor.reduce(words.ravel().take(places), axis=1)
            right = np.ones(len(labels), dtype=np.bool_)
            for block in checks:
                right &= np.bitwise_xor.reduce(block.ravel().take(places), axis=1) == 0
            return state, right
        digits = self.sequence.field.digits[labels].reshape(len(labels), -1).astype(np.float64)
        solved = self.sequence.ring.reduced(digits @ self._combinations.T)
        state = np.zeros((len(labels), self.sequence.ring.degree))
        state[:, self.pivots] = solved[:, : len(self.pivots)]
        return state, np.asarray(~solved[:, len(self.pivots) :].any(axis=1))

    def open_elements(self) -> Element:
        """Return up to `LISTED` + 1 elements that the symbols seen cannot tell from 0."""
        prime, degree = self.sequence.ring.prime, self.sequence.ring.degree
        free = [k for k in range(degree) if k not in self.pivots]
        basis = np.zeros((len(free), degree))
        for row, k in zip(basis, free, strict=True):
            row[k] = 1
            row[self.pivots] = -self._reduced[: len(self.pivots), k] % prime
        scales = islice(product(range(prime), repeat=len(free)), LISTED + 1)
        return self.elements.of_digits(np.array(list(scales), dtype=np.float64) @ basis % prime)

    def nonzero(self, states: Element) -> NDArray[np.bool_]:
        """Return which elements are a place: every one but 0."""
        return np.asarray(self.elements.keys(states) != 0)


def eliminate(equations: Digits, prime: int) -> tuple[Digits, Digits, list[int]]:
    """Return (E, R, pivots): E @ equations = R modulo p, R in reduced row echelon form."""
    number, degree = equations.shape
    whole = np.concatenate([equations, np.eye(number)], axis=1).astype(np.int64)
    pivots: list[int] = []
    for column in range(degree):
        top = len(pivots)
        below = np.flatnonzero(whole[top:, column])
        if below.size == 0:
            continue
        whole[[top, top + below[0]]] = whole[[top + below[0], top]]
        whole[top] = whole[top] * pow(int(whole[top, column]), -1, prime) % prime
        factors = whole[:, column].copy()
        factors[top] = 0
        rows = np.flatnonzero(factors)
        whole[rows] = (whole[rows] - factors[rows, None] * whole[top]) % prime
        pivots.append(column)
        if len(pivots) == number:
            break
    result = whole.astype(np.float64)
    return result[:, degree:], result[:, :degree], pivots


Words = NDArray[np.uint64]


def binary_dual(
    words: Words, order: NDArray[np.intp], degree: int
) -> tuple[Words, NDArray[np.intp]]:
    """Return the dual basis (N, D), and the frequencies chosen (N, D), for p = 2; -1: none.

    Each window's most reliable independent frequencies are chosen: elimination over GF(p) that
    keeps field elements X_j with f_i . X_j = [i = j] for the frequencies f_i chosen so far.
    Elements that no frequency determines stay with all of them at 0: they are what the cells seen
    leave open. `words` (U,) are the frequencies, `order` (N, U) their numbers, the most reliable
    first.
    """
    windows = len(order)
    lines = np.arange(windows)
    basis = np.tile(np.uint64(1) << np.arange(degree, dtype=np.uint64), (windows, 1))
    chosen = np.full((windows, degree), -1)
    free = np.ones((windows, degree), dtype=np.bool_)
    for place in range(order.shape[1]):
        frequency = order[:, place]
        inner = np.bitwise_count(basis & words[frequency, None]) & 1 == 1
        able = inner & free
        pivot = able.argmax(axis=1)
        use = able[lines, pivot]
        inner[lines, pivot] = False
        dual = np.where(use, basis[lines, pivot], np.uint64(0))
        basis ^= np.where(inner, dual[:, None], np.uint64(0))
        chosen[lines[use], pivot[use]] = frequency[use]
        free[lines[use], pivot[use]] = False
        if place >= degree - 1 and not free.any():
            break
    return basis, chosen


def odd_dual(
    frequencies: Digits, order: NDArray[np.intp], prime: int
) -> tuple[Digits, NDArray[np.intp]]:
    """Return the dual basis (N, D, D) and frequencies chosen (N, D), for odd p: `binary_dual`."""
    windows, degree = len(order), frequencies.shape[1]
    lines = np.arange(windows)
    basis = np.tile(np.eye(degree), (windows, 1, 1))
    chosen = np.full((windows, degree), -1)
    free = np.ones((windows, degree), dtype=np.bool_)
    inverse = np.array([0, *(pow(k, -1, prime) for k in range(1, prime))], dtype=np.float64)
    for place in range(order.shape[1]):
        frequency = order[:, place]
        inner = (basis @ frequencies[frequency][..., None])[..., 0] % prime
        able = (inner != 0) & free
        pivot = able.argmax(axis=1)
        use = able[lines, pivot]
        scale = inverse[inner[lines, pivot].astype(np.intp)] * use
        dual = basis[lines, pivot] * scale[:, None] % prime
        inner[lines, pivot] = 0
        basis = (basis - inner[..., None] * dual[:, None]) % prime
        basis[lines[use], pivot[use]] = dual[use]
        chosen[lines[use], pivot[use]] = frequency[use]
        free[lines[use], pivot[use]] = False
        if place >= degree - 1 and not free.any():
            break
    return basis, chosen


def read_scattered(
    sequence: Sequence, offsets: list[int], labels: Labels
) -> tuple[Element, NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the elements (N,), which windows are determined, and which pass their checks.

    `Register` prepares one linear map, which pays when many windows show the same cells. Here every
    window (N, k) has cells of its own, -1 where none is seen: the elimination runs over the batch.
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
