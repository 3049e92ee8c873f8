"""GF(p)[x] modulo a polynomial H of degree D: where every m-sequence lives.

The root of a primitive polynomial of degree n over GF(p^m) has a minimal polynomial H of
degree D = n m over the prime field GF(p), so sequences over every GF(q) are computed here.
Vectors of D digits are float64 arrays that hold integers: products go through BLAS and stay
exact, because D (p - 1)^2 is far below 2^53.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import prod

import numpy as np
from numpy.typing import NDArray

Digits = NDArray[np.float64]  # (..., D) integers 0 ... p - 1
Words = NDArray[np.uint64]  # (...) D <= 64 binary digits, digit k at bit k

TABLE_STEPS = 4096  #: powers of one element that a `Powers` may keep


class Residues:
    """The ring GF(p)[x]/H; `modulus` (D + 1,) are the coefficients of H from x^0 to x^D, monic."""

    def __init__(self, prime: int, modulus: Sequence[int]) -> None:
        self.prime = prime
        self.modulus = tuple(modulus)
        self.degree = len(self.modulus) - 1
        low = -np.array(self.modulus[:-1], dtype=np.float64) % prime
        rows = np.eye(2 * self.degree, self.degree)  # row k: x^k modulo H
        for k in range(self.degree, 2 * self.degree):
            row = rows[k - 1, -1] * low
            row[1:] += rows[k - 1, :-1]
            rows[k] = row % prime
        rows.setflags(write=False)
        self.powers_of_x = rows  #: (2 D, D)

    def reduced(self, numbers: Digits) -> Digits:
        """Return non-negative integers modulo p."""
        return np.asarray(numbers - self.prime * np.floor(numbers / self.prime))

    def product(self, a: Digits, b: Digits) -> Digits:
        """Return a b modulo H; (D,) each."""
        return self.reduced(
            self.reduced(np.convolve(a, b)) @ self.powers_of_x[: 2 * self.degree - 1]
        )

    def power_of_x(self, exponent: int) -> Digits:
        """Return x^exponent modulo H, exponent >= 0; (D,)."""
        result: Digits = self.powers_of_x[0]
        for bit in bin(exponent)[2:]:
            result = self.product(result, result)
            if bit == "1":
                shifted = result[-1] * self.powers_of_x[self.degree]
                shifted[1:] += result[:-1]
                result = self.reduced(shifted)
        return result

    def multiplication(self, a: Digits) -> Digits:
        """Return the (D, D) matrix of multiplication by a: b @ matrix = a b modulo H."""
        toeplitz = np.zeros((self.degree, 2 * self.degree))
        toeplitz[:, : self.degree] = a
        sheared = toeplitz.ravel()[: self.degree * (2 * self.degree - 1)]
        shifted = sheared.reshape(self.degree, 2 * self.degree - 1)  # row j: a x^j, not reduced
        return self.reduced(shifted @ self.powers_of_x[: 2 * self.degree - 1])

    def is_primitive(self, factors: Mapping[int, int]) -> bool:
        """Whether x generates the group of order N = p^D - 1, given N's prime factors.

        Then H is irreducible too: no other modulus of degree D has an element of that order.
        """
        period = prod(prime**exponent for prime, exponent in factors.items())
        one = self.powers_of_x[0]
        if self.modulus[0] == 0 or not np.array_equal(self.power_of_x(period), one):
            return False
        return not any(np.array_equal(self.power_of_x(period // prime), one) for prime in factors)


class Powers:
    """Powers of one element (D,), at many exponents at a time, modulo `order`: base^order = 1."""

    def __init__(self, ring: Residues, base: Digits, order: int) -> None:
        self.ring = ring
        self.order = order
        self.base = base
        self._ladder: list[Digits] = []  # multiplication by base^(2^k)
        self._table: Digits | None = None

    def at(self, exponents: NDArray[np.uint64]) -> Digits:
        """Return base^exponents, (k,) below `order`, as (k, D) digits; short cycles are kept."""
        if self._table is None and self.order <= min(TABLE_STEPS, 8 * exponents.size):
            self._table = self._computed(np.arange(self.order, dtype=np.uint64))
        if self._table is not None:
            return np.asarray(self._table[exponents.astype(np.intp)])
        return self._computed(exponents)

    def _computed(self, exponents: NDArray[np.uint64]) -> Digits:
        if exponents.size == 0:
            return np.zeros((0, self.ring.degree))
        start = exponents.min()
        rest = exponents - start  # a face needs neighbours: few bits differ
        result = np.zeros((exponents.size, self.ring.degree))
        result[:, 0] = 1.0
        result = self._climb(result, rest)
        if start:
            head = np.zeros((1, self.ring.degree))
            head[0, 0] = 1.0
            head = self._climb(head, np.array([start], dtype=np.uint64))
            result = self.ring.reduced(result @ self.ring.multiplication(head[0]))
        return result

    def _climb(self, result: Digits, exponents: NDArray[np.uint64]) -> Digits:
        for bit in range(int(exponents.max()).bit_length()):
            chosen = (exponents >> np.uint64(bit)) & np.uint64(1) == 1
            step = self._rung(bit)
            if chosen.any():
                result[chosen] = self.ring.reduced(result[chosen] @ step)
        return result

    def _rung(self, bit: int) -> Digits:
        ladder = self._ladder
        if len(ladder) <= bit:
            ladder = ladder.copy()  # replaced at once, so that threads never see half of it
            while len(ladder) <= bit:
                last = ladder[-1][0] if ladder else None  # base^(2^(k-1)), times x^0
                square = self.base if last is None else self.ring.product(last, last)
                ladder.append(self.ring.multiplication(square))
            self._ladder = ladder
        return ladder[bit]


def pack_words(digits: Digits) -> Words:
    """Return (..., D) binary digits, D <= 64, as one 64-bit word each."""
    bits = np.packbits(digits.astype(np.uint8), axis=-1, bitorder="little")
    whole = np.zeros((*bits.shape[:-1], 8), dtype=np.uint8)
    whole[..., : bits.shape[-1]] = bits
    return whole.view("<u8")[..., 0].astype(np.uint64)


def rank_modulo(rows: Digits, prime: int) -> int:
    """Return the rank over GF(prime) of a (k, D) matrix of digits."""
    left = rows.astype(np.int64)
    rank = 0
    for column in range(left.shape[1]):
        pivots = np.flatnonzero(left[rank:, column])
        if pivots.size == 0:
            continue
        pivot = rank + int(pivots[0])
        left[[rank, pivot]] = left[[pivot, rank]]
        left[rank] = left[rank] * pow(int(left[rank, column]), -1, prime) % prime
        left[rank + 1 :] -= left[rank + 1 :, column, None] * left[rank]
        left[rank + 1 :] %= prime
        rank += 1
        if rank == left.shape[0]:
            break
    return rank


def binary_rank(words: list[int], full: int) -> int:
    """Return the rank over GF(2) of rows given as integers; stops at `full`."""
    basis: list[int] = []
    for word in words:
        for pivot in basis:
            word = min(word, word ^ pivot)
        if word:
            basis.append(word)
            if len(basis) == full:
                break
    return len(basis)
