"""Field elements by the million: products, linear maps and powers in GF(p)[x]/H.

A window of an m-sequence is a field element x^t, so shifting the register of thesis 5.1 is
a multiplication by x. Characteristic 2: an element is one 64-bit word, digit k at bit k;
products and linear maps go through tables of bytes. Odd characteristic: the last axis holds
the D digits, as float64 integers, and BLAS does the work. Who takes `Elements` indexes by their
leading axes alone.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from math import log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.array.residue import Digits, Residues, pack_words

Element = NDArray[Any]  #: (...) uint64 words, or (..., D) float64 digits
Map = NDArray[Any]  #: a linear map digits -> digits @ matrix, as `map_of` prepares it


class BinaryElements:
    """GF(2)[x]/H, D <= 64: one word per element."""

    def __init__(self, ring: Residues) -> None:
        self.ring = ring
        self._bytes = -(-ring.degree // 8)
        self._offsets = 256 * np.arange(2 * self._bytes, dtype=np.intp)[:, None]
        self.one = np.ones(1, dtype=np.uint64)

    def of_digits(self, digits: Digits) -> Element:
        """Return words from (..., D) digits."""
        return pack_words(digits)

    def keys(self, a: Element) -> NDArray[np.uint64]:
        """Return the words themselves."""
        return a

    def of_keys(self, keys: NDArray[np.uint64]) -> Element:
        """Return the words themselves."""
        return keys

    def map_of(self, matrix: Digits) -> Map:
        """Return the table of the images of every byte, (bytes * 256,) words."""
        return _byte_table(pack_words(matrix), self._bytes)

    def apply(self, prepared: Map, a: Element) -> Element:
        """Return the images of words: one lookup per byte."""
        places = _bytes_of(a, self._bytes) + self._offsets[: self._bytes]
        images = np.bitwise_xor.reduce(prepared.take(places), axis=0)
        return np.asarray(images.reshape(a.shape))

    @cached_property
    def _reduction(self) -> NDArray[np.uint64]:
        """Images of the bytes of a product of two words, reduced modulo H."""
        rows = np.zeros((16 * self._bytes, self.ring.degree))
        known = self.ring.powers_of_x
        rows[: len(known)] = known[: len(rows)]
        return _byte_table(pack_words(rows), 2 * self._bytes)

    def product(self, a: Element, b: Element) -> Element:
        """Return a b: every byte times every byte by table, then reduced."""
        a, b = np.broadcast_arrays(a, b)
        n = self._bytes
        left, right = _bytes_of(a, n) << 8, _bytes_of(b, n)
        partial = np.zeros((2 * n, left.shape[1]), dtype=np.uint16)
        for i in range(n):
            partial[i : i + n] ^= _byte_products().take(left[i] | right)
        whole = (partial & 0xFF).astype(np.intp)
        whole[1:] ^= partial[:-1] >> 8
        whole += self._offsets
        reduced = np.bitwise_xor.reduce(self._reduction.take(whole), axis=0)
        return np.asarray(reduced.reshape(a.shape))


class OddElements:
    """GF(p)[x]/H, p odd: D digits per element."""

    def __init__(self, ring: Residues) -> None:
        self.ring = ring
        powers = [ring.prime**k for k in range(ring.degree)]
        self._weights = np.array(powers, dtype=np.uint64)
        self.one = ring.powers_of_x[:1]

    def of_digits(self, digits: Digits) -> Element:
        """Return the digits themselves."""
        return digits

    def keys(self, a: Element) -> NDArray[np.uint64]:
        """Return sum of digit_k p^k, below p^D <= 2^64."""
        return np.asarray((a.astype(np.uint64) * self._weights).sum(axis=-1, dtype=np.uint64))

    def of_keys(self, keys: NDArray[np.uint64]) -> Element:
        """Return the digits of keys."""
        digits = keys[..., None] // self._weights % np.uint64(self.ring.prime)
        return digits.astype(np.float64)

    def map_of(self, matrix: Digits) -> Map:
        """Return the matrix itself."""
        return matrix

    def apply(self, prepared: Map, a: Element) -> Element:
        """Return a @ matrix modulo p."""
        return self.ring.reduced(a @ prepared)

    def product(self, a: Element, b: Element) -> Element:
        """Return a b: the Toeplitz matrix of a, times b, reduced."""
        a, b = np.broadcast_arrays(a, b)
        degree = self.ring.degree
        wide = np.zeros((*a.shape[:-1], 3 * degree - 2))
        wide[..., degree - 1 : 2 * degree - 1] = a
        toeplitz = np.lib.stride_tricks.sliding_window_view(wide, degree, axis=-1)
        convolved = toeplitz @ b[..., ::-1, None]
        rows = self.ring.powers_of_x[: 2 * degree - 1]
        return self.ring.reduced(self.ring.reduced(convolved[..., 0]) @ rows)


Elements = BinaryElements | OddElements


@lru_cache(maxsize=64)
def elements_of(ring: Residues) -> Elements:
    """Return the arithmetic of a ring, the same object for the same ring."""
    return BinaryElements(ring) if ring.prime == 2 else OddElements(ring)


class Shifts:
    """Successive products with one element g: runs of a register, all steps at once."""

    def __init__(self, elements: Elements, base: Digits) -> None:
        self.elements = elements
        self._square = base
        self._maps: list[Map] = []

    def map(self, k: int) -> Map:
        """Return the map of multiplication by g^(2^k)."""
        ring = self.elements.ring
        while len(self._maps) <= k:
            self._maps.append(self.elements.map_of(ring.multiplication(self._square)))
            self._square = ring.product(self._square, self._square)
        return self._maps[k]

    def run(self, start: Element, steps: int) -> Element:
        """Return start g^k for k = 0 ... steps - 1 on a new first axis; doubles each time."""
        whole = np.empty((steps, *start.shape), dtype=start.dtype)
        whole[0] = start
        done = 1
        while done < steps:
            more = min(done, steps - done)
            whole[done : done + more] = self.elements.apply(
                self.map(done.bit_length() - 1), whole[:more]
            )
            done += more
        return whole


def frobenius(ring: Residues) -> tuple[int, Digits]:
    """Return (r, matrix) of the linear map a -> a^r, r the largest p^w <= 16 or p itself."""
    prime = ring.prime
    width = max(1, int(log(16) / log(prime) + 1e-9))
    radix = prime**width
    image = ring.power_of_x(radix)
    rows = [ring.powers_of_x[0]]
    for _ in range(ring.degree - 1):
        rows.append(ring.product(rows[-1], image))
    return radix, np.array(rows)


def _bytes_of(words: Element, number: int) -> NDArray[np.intp]:
    """Return (number, N) bytes of words, lowest first."""
    flat = np.ascontiguousarray(words, dtype="<u8").reshape(-1)
    return flat.view(np.uint8).reshape(-1, 8).T[:number].astype(np.intp)


def _byte_table(rows: NDArray[np.uint64], number: int) -> NDArray[np.uint64]:
    """Return (number * 256,) XOR of the rows that the bits of each byte choose."""
    whole = np.zeros(8 * number, dtype=np.uint64)
    whole[: rows.size] = rows[: whole.size]
    table = np.zeros((number, 256), dtype=np.uint64)
    for bit, row in enumerate(whole.reshape(number, 8).T):
        table[:, 1 << bit : 2 << bit] = table[:, : 1 << bit] ^ row[:, None]
    return table.ravel()


@lru_cache(maxsize=1)
def _byte_products() -> NDArray[np.uint16]:
    """Return (65536,) carry-less products of two bytes, at 256 a + b."""
    a = np.arange(256, dtype=np.uint16)
    table = np.zeros((256, 256), dtype=np.uint16)
    for bit in range(8):
        table ^= (a[:, None] >> bit & 1) * (a << bit)
    return table.ravel()


_SPREAD = np.uint64(0x9E3779B97F4A7C15)  # 2^64 / golden ratio: multiplicative hashing


class Keys:
    """Find many 64-bit keys among known ones; a table of bits refuses most unknown keys first."""

    def __init__(self, keys: NDArray[np.uint64]) -> None:
        self._order = np.argsort(keys, kind="stable").astype(np.uint32)
        self._sorted = keys[self._order]
        bits = max(6, int(8 * keys.size - 1).bit_length())
        self._shift = np.uint64(64 - bits)
        self._known = np.zeros(1 << bits, dtype=np.bool_)
        self._known[self._slots(keys)] = True

    def _slots(self, keys: NDArray[np.uint64]) -> NDArray[np.intp]:
        return np.asarray((keys * _SPREAD) >> self._shift).astype(np.intp)

    def find(self, keys: NDArray[np.uint64]) -> NDArray[np.int64]:
        """Return the position of each key, same shape; -1 where it is not known."""
        found = np.full(keys.shape, -1, dtype=np.int64)
        likely = self._known[self._slots(keys)]
        if likely.any():
            asked = keys[likely]
            place = np.searchsorted(self._sorted, asked).clip(max=self._sorted.size - 1)
            hit = self._sorted[place] == asked
            found[likely] = np.where(hit, self._order[place].astype(np.int64), -1)
        return found
