"""The fast Walsh-Hadamard transform, for every characteristic, in batches.

All q^n values of a character sum at once. A place is a pair (high, low) of halves of its
digits, and a character of it is the product of two. So the sum runs over the low halves
first, for the few frequencies that occur, and then over the high ones: a matrix product with
a table of characters, radix sqrt(q^n), faster here than radix 2 in passes over memory. Frequencies
with equal high halves are not summed first: the sums take longer than the product that they save.
Characters are +1 and -1 for p = 2; for odd p real and imaginary parts stand side by side,
so that all of it is real.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from decoder.window import Scores
from generator.array.sequence import Sequence

Coefficients = NDArray[np.float32] | NDArray[np.complex64]


class Spectrum:
    """Frequencies of the symbols seen at offsets (k,) of one sequence."""

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


LARGEST_TRANSFORM = 1 << 18  #: places; a window then takes 1 MB


class Transform:
    """Scores of all places of a sequence for symbols seen at given offsets."""

    def __init__(self, sequence: Sequence, offsets: list[int]) -> None:
        self.spectrum = Spectrum(sequence, offsets)
        prime, degree = sequence.ring.prime, sequence.ring.degree
        half = degree // 2
        weights = prime ** np.arange(degree - half)
        frequencies = self.spectrum.frequencies.astype(np.int64)
        low, high = frequencies[:, :half] @ weights[:half], frequencies[:, half:] @ weights
        self._low = _characters(prime, half, low)  # (U, R_low)
        high_table = _characters(prime, degree - half, high).T  # (R_high, U)
        if prime > 2:
            high_table = np.concatenate([high_table.real, -high_table.imag], axis=1)
        self._high = np.ascontiguousarray(high_table)

    def values(self, scores: Scores) -> NDArray[np.float32]:
        """Return (N, q^n) log-likelihoods by key; key 0, no place, has -inf."""
        constant, coefficients = self.spectrum.of(scores)
        partial = coefficients[:, :, None] * self._low
        if partial.dtype.kind == "c":
            partial = np.concatenate([partial.real, partial.imag], axis=1)
        values = np.matmul(self._high, partial).reshape(len(scores), -1)
        values += constant[:, None].astype(np.float32)
        values[:, 0] = -np.inf
        return np.asarray(values)


def _characters(prime: int, digits: int, frequencies: NDArray[np.int64]) -> NDArray[Any]:
    """Return (F, p^d) characters w^(f . x) of frequencies given by their keys."""
    weights = prime ** np.arange(digits)
    places = np.arange(prime**digits)[:, None] // weights % prime
    inner = (frequencies[:, None] // weights % prime) @ places.T % prime
    if prime == 2:
        return np.asarray(1 - 2 * inner, dtype=np.float32)
    return np.asarray(np.exp(2j * np.pi / prime * inner), dtype=np.complex64)
