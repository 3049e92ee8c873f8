"""Ordered statistics: near maximum likelihood beyond 2^18 places.

The score of place x is sum_f Re c_f w^(f . x) (`spectrum`), the correlation with a linear
code over GF(p), soft weights and q-ary symbols included. The most reliable independent
frequencies, read as they were seen, give one place; it and every place that differs in one
or two of them are weighed, all in one matrix product: with s the characters of the first
place and G those that each flip changes, the scores are Re G diag(c s) G^T. Tries after the
first shuffle the order of reliability, so that other frequencies are believed.

References
----------
M. P. C. Fossorier, S. Lin, IEEE Trans. Inf. Theory 41 (1995).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from decoder.element import elements_of
from decoder.register import binary_dual, odd_dual
from decoder.transform import Coefficients, Spectrum
from decoder.window import Scores
from generator.array.residue import pack_words
from generator.array.sequence import Sequence

TRIES = 4  #: orders of reliability that are decoded
_KEPT = 6  #: best places of each try that are weighed against each other
_JITTER = 0.6  #: spread of the shuffles between tries, as a share of the reliability

Keys = NDArray[np.uint64]


class Ordered:
    """Near maximum likelihood for symbols seen at given offsets of one sequence."""

    def __init__(self, sequence: Sequence, offsets: list[int], tries: int = TRIES) -> None:
        self.spectrum = Spectrum(sequence, offsets)
        self._sequence = sequence
        self._tries = tries
        binary = sequence.ring.prime == 2
        self._words = pack_words(self.spectrum.frequencies) if binary else None

    def rank_keys(
        self, scores: Scores, number: int
    ) -> tuple[Keys, NDArray[np.float64], NDArray[np.float64]]:
        """Return keys of field elements and values (N, K) and rest (N,) of scores (N, k, q).

        `rest` knows the places that were tried; the others are not in it.
        """
        constant, weights = self.spectrum.of(scores)
        shuffle = np.random.default_rng(0)
        keys, values = [], []
        for attempt in range(self._tries):
            reliability = np.abs(weights)
            if attempt:
                noise = shuffle.random(weights.shape[1], dtype=np.float32)
                reliability *= 1 - _JITTER * noise
            order = np.argsort(-reliability, axis=1, kind="stable")
            found = self._weighed(weights, order)
            keys.append(found[0])
            values.append(found[1])
        ranked, exact, rest = _distinct(np.concatenate(keys, 1), np.concatenate(values, 1))
        alike = float(self._sequence.ring.prime) ** found[2] - 1  # symbols seen: not full rank
        rest = np.maximum(rest, alike)
        return ranked[:, :number], exact[:, :number] + constant[:, None], rest

    def _weighed(
        self, weights: Coefficients, order: NDArray[np.intp]
    ) -> tuple[Keys, NDArray[np.float32], NDArray[np.intp]]:
        """Return keys and scores (N, 6) of the best places of one try, and open digits (N,)."""
        if self._words is None:
            return self._weighed_odd(weights, order)
        basis, believed = binary_dual(self._words, order, self._sequence.ring.degree)
        lines = np.arange(len(weights))[:, None]
        trusted = np.where(believed < 0, 0, weights[lines, believed])
        wrong = np.where(trusted < 0, basis, np.uint64(0))
        first = np.bitwise_xor.reduce(wrong, axis=1)
        flips = np.concatenate([np.zeros((len(basis), 1), np.uint64), basis], axis=1)
        signs = _signs(flips[..., None] & self._words)  # (N, D + 1, U)
        seen = weights * _signs(first[:, None] & self._words)
        left, right, scores = _best_flips(signs, seen)
        keys = first[:, None] ^ flips[lines, left] ^ flips[lines, right]
        return keys, scores, np.count_nonzero(trusted == 0, axis=1)

    def _weighed_odd(
        self, weights: Coefficients, order: NDArray[np.intp]
    ) -> tuple[Keys, NDArray[np.float32], NDArray[np.intp]]:
        ring, frequencies = self._sequence.ring, self.spectrum.frequencies
        prime, degree = ring.prime, ring.degree
        basis, believed = odd_dual(frequencies, order, prime)  # (N, D, D)
        lines = np.arange(len(weights))[:, None]
        trusted = np.where(believed < 0, 0, weights[lines, believed])
        angle = np.angle(trusted) * prime / (2 * np.pi)
        first = ring.reduced((np.rint(-angle)[:, None] @ basis)[:, 0] + prime * prime)
        scales = np.arange(1, prime)[:, None, None, None]
        flips = ring.reduced(scales * basis).transpose(1, 0, 2, 3).reshape(len(basis), -1, degree)
        flips = np.concatenate([np.zeros((len(basis), 1, degree)), flips], axis=1)
        roots = np.exp(2j * np.pi / prime * np.arange(prime)).astype(np.complex64)
        signs = roots[ring.reduced(flips @ frequencies.T).astype(np.intp)]
        seen = weights * roots[ring.reduced(first @ frequencies.T).astype(np.intp)]
        left, right, scores = _best_flips(signs, seen)
        places = ring.reduced(first[:, None] + flips[lines, left] + flips[lines, right])
        keys = elements_of(ring).keys(places)
        return keys, scores, np.count_nonzero(trusted == 0, axis=1)


def _best_flips(
    signs: NDArray[Any], seen: NDArray[Any]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]:
    """Return the best pairs of flips (N, 6), 0 for none, and their scores."""
    whole = np.matmul(signs * seen[:, None], signs.transpose(0, 2, 1)).real
    a, b = np.triu_indices(signs.shape[1], 1)  # one flip (a = 0) or two
    a, b = np.append(0, a), np.append(0, b)
    scores = whole.reshape(len(whole), -1)[:, a * signs.shape[1] + b]
    kept = np.argpartition(-scores, _KEPT, axis=1)[:, :_KEPT]
    return a[kept], b[kept], np.take_along_axis(scores, kept, axis=1)


def _signs(words: Keys) -> NDArray[np.float32]:
    """Return (-1)^(number of bits)."""
    return np.float32(1) - np.float32(2) * (np.bitwise_count(words) & 1).astype(np.float32)


def _distinct(
    keys: Keys, values: NDArray[np.float32]
) -> tuple[Keys, NDArray[np.float64], NDArray[np.float64]]:
    """Return distinct keys other than 0, best first, the others with -inf."""
    order = np.argsort(keys, axis=1, kind="stable")
    keys = np.take_along_axis(keys, order, axis=1)
    exact = np.take_along_axis(values, order, axis=1).astype(np.float64)
    again = np.zeros(keys.shape, dtype=np.bool_)
    again[:, 1:] = keys[:, 1:] == keys[:, :-1]
    exact[again | (keys == 0)] = -np.inf
    order = np.argsort(-exact, axis=1, kind="stable")
    keys = np.take_along_axis(keys, order, axis=1)
    exact = np.take_along_axis(exact, order, axis=1)
    with np.errstate(invalid="ignore"):
        rest = np.exp(exact[:, 1:] - exact[:, :1]).sum(axis=1)
    return keys, exact, np.nan_to_num(rest, nan=0.0)
