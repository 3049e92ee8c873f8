"""What weighs places: one interface over the methods of maximum likelihood.

folded array, up to 2^18 places   `transform`, exact
folded array, more                `ordered`, near to it
product array                     `joint`, exact
with a prior                      `places`, exact at any size
"""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

import numpy as np

from decoder.convert import conversion
from decoder.element import elements_of
from decoder.joint import Joint
from decoder.ordered import Ordered
from decoder.ranked import Ranked, best_of
from decoder.score import Scores, unrelated_score
from decoder.transform import LARGEST_TRANSFORM, Transform
from generator.array.fold import FoldedArray
from generator.array.product import ProductArray


class Ranking(Protocol):
    """Weighs places for windows of one shape."""

    @property
    def size(self) -> int:
        """Number of places weighed."""
        ...

    @property
    def work(self) -> int:
        """Numbers held for each window."""
        ...

    def rank(self, scores: Scores, number: int) -> Ranked:
        """Return the best places of scores (N, k, q)."""
        ...


class AllPlaces:
    """Folded arrays: the transform, or ordered statistics where it is too large."""

    def __init__(self, array: FoldedArray, shape: tuple[int, int]) -> None:
        offsets = array.offsets(*np.indices(shape))
        self.size = array.sequence.period
        self._array = array
        small = self.size < LARGEST_TRANSFORM
        self.work = self.size if small else len(offsets) << 6
        self._method = (Transform if small else Ordered)(array.sequence, offsets)

    def rank(self, scores: Scores, number: int) -> Ranked:
        """Return the best places of scores (N, k, q)."""
        method = self._method
        scores = np.take(scores, self._array.permutation, axis=2)  # of terms, no more of symbols
        if isinstance(method, Transform):
            places, values, rest = best_of(method.values(scores), number)
            t = method.index_of_key[places].astype(np.uint64)
        else:
            keys, values, rest = method.rank_keys(scores, number)
            elements = elements_of(self._array.sequence.ring)
            logarithm = conversion(self._array.sequence, "logarithm")
            found = np.flatnonzero(np.isfinite(values.ravel()))
            unseen = np.log(self.size) + unrelated_score(scores) - values[:, 0]
            rest += np.exp(unseen.clip(max=100.0))  # the places that were not tried
            t = np.zeros(values.shape, dtype=np.uint64)
            t.ravel()[found] = logarithm.convert(elements.of_keys(keys.ravel()[found]))
        return Ranked(
            t % np.uint64(self._array.rows), t % np.uint64(self._array.columns), values, rest
        )


@lru_cache(maxsize=32)
def ranking_of(array: FoldedArray | ProductArray, shape: tuple[int, int]) -> Ranking:
    """Return what weighs all places of an array, the same object for the same arguments."""
    if isinstance(array, ProductArray):
        return Joint(array, shape)
    return AllPlaces(array, shape)
