"""Find many 64-bit keys among known ones: milestones, and baby steps of the logarithm.

Nearly all keys asked for are unknown, so a table of bits refuses them first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_SPREAD = np.uint64(0x9E3779B97F4A7C15)  # 2^64 / golden ratio: multiplicative hashing


class Keys:
    """Known keys; `find` returns the position of each in the order that they were given."""

    def __init__(self, keys: NDArray[np.uint64]) -> None:
        self._order = np.argsort(keys, kind="stable").astype(np.uint32)
        self._sorted = keys[self._order]
        bits = max(6, int(8 * keys.size - 1).bit_length())
        self._shift = np.uint64(64 - bits)
        self._known = np.zeros(1 << bits, dtype=np.bool_)
        self._known[self._slots(keys)] = True

    @property
    def nbytes(self) -> int:
        """Memory, bytes."""
        return self._order.nbytes + self._sorted.nbytes + self._known.nbytes

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
