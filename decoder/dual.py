"""The most reliable independent frequencies of each window, and the basis dual to them.

N windows at a time, each with an order of its own: elimination over GF(p) that keeps field
elements X_j with f_i . X_j = [i = j] for the frequencies f_i chosen so far. Elements that no
frequency determines stay with all of them at 0: they are what the cells seen leave open.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.array.residue import Digits

Words = NDArray[np.uint64]


def binary_dual(
    words: Words, order: NDArray[np.intp], degree: int
) -> tuple[Words, NDArray[np.intp]]:
    """Return the dual basis (N, D) and the frequencies chosen (N, D), -1 where none is left.

    Parameters
    ----------
    words
        (U,) frequencies.
    order
        (N, U) their numbers, the most reliable first.
    degree
        D.
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
    """Return the dual basis (N, D, D) and the frequencies chosen (N, D), for odd p; -1: none.

    Parameters
    ----------
    frequencies
        (U, D) digits.
    order
        (N, U) their numbers, the most reliable first.
    prime
        p.
    """
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
