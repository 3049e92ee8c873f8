"""Scores of all places as a character sum over the field.

S(x) = sum over cells of L_cell(symbol of the cell at place x), and a symbol is a linear
functional of the place's field element x. In characters of the additive group (the trace
characters of GF(4), GF(8), ...), S(x) = c_0 + sum_f Re c_f w^(f . x), w = exp(2 pi i / p),
with one frequency f in GF(p)^D for each cell and each pair of opposite characters: k (q-1)
of them in characteristic 2, where w = -1 and all is real, and half as many for odd p.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from decoder.score import Scores
from generator.array.sequence import Sequence

Coefficients = NDArray[np.float32] | NDArray[np.complex64]


class Spectrum:
    """Frequencies of the symbols seen at given offsets of one sequence.

    Parameters
    ----------
    sequence
        The m-sequence.
    offsets
        (k,) relative indices of the cells.
    """

    def __init__(self, sequence: Sequence, offsets: list[int]) -> None:
        field, prime = sequence.field, sequence.ring.prime
        self.prime = prime
        halves = _halves(field.digits, prime)  # (u, m)
        maps = sequence.functionals(sequence.element(offsets))  # (k, m, D)
        every = np.einsum("um,kmd->kud", halves, maps) % prime
        #: (U, D) digits of every frequency, each once
        self.frequencies, place = np.unique(
            every.reshape(-1, sequence.ring.degree), axis=0, return_inverse=True
        )
        self._merge = None
        if len(self.frequencies) < place.size:  # cells in the same GF(q) line share them
            self._merge = np.zeros((place.size, len(self.frequencies)), dtype=np.float32)
            self._merge[np.arange(place.size), place.ravel()] = 1.0
        self._place = np.argsort(place.ravel())
        angles = 2 * np.pi / prime * (field.digits @ halves.T)  # (q, u)
        scale = (1 if prime == 2 else 2) / field.order
        characters = scale * np.exp(-1j * angles)
        real = characters.real.astype(np.float32)
        self._characters: Coefficients = real if prime == 2 else characters.astype(np.complex64)

    def of(self, scores: Scores) -> tuple[NDArray[np.float64], Coefficients]:
        """Return c_0 (N,) and the coefficients (N, U) of scores (N, k, q)."""
        constant = scores.mean(axis=2, dtype=np.float64).sum(axis=1)
        every = (scores @ self._characters).reshape(len(scores), -1)
        merged = every[:, self._place] if self._merge is None else every @ self._merge
        return constant, np.asarray(merged)


def _halves(digits: NDArray[np.int64], prime: int) -> NDArray[np.int64]:
    """Return one of each pair u, -u of the nonzero vectors of GF(p)^m."""
    first = (digits != 0).argmax(axis=1)
    leading = digits[np.arange(len(digits)), first]
    return np.asarray(digits[(leading > 0) & (leading <= max(1, (prime - 1) // 2))])
