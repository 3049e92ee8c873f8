"""Likelihood of places that are known beforehand: the cells that a database registers.

Exact for arrays of any size: every candidate's window is compared with the scores, as one
matrix product.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from decoder.errors import WindowError
from decoder.ranked import Ranked, best_of
from decoder.score import Scores
from generator.array.contract import SymbolArray
from generator.array.torus import on_torus

MOST_PLACES = 1 << 20
_CODEBOOK = 1 << 27  #: entries: cells times symbols times places, 0.5 GB


class Places:
    """Candidate places of windows of one shape.

    Parameters
    ----------
    array
        The array.
    shape
        Rows and columns of the window.
    prior
        (P, 2) rows and columns of the places that are possible, P >= 1.
    """

    def __init__(self, array: SymbolArray, shape: tuple[int, int], prior: ArrayLike) -> None:
        given = np.asarray(prior)
        if given.ndim != 2 or given.shape[1] != 2 or not 1 <= len(given) <= MOST_PLACES:
            raise WindowError(
                f"a prior is an array of (row, column) pairs, 1 to {MOST_PLACES} of them, not of "
                f"shape {given.shape}",
                fix="give np.stack([rows, columns], axis=1) of the registered cells",
            )
        if len(given) * shape[0] * shape[1] * array.order > _CODEBOOK:
            raise WindowError(
                f"{len(given)} candidates for a {shape[0]}x{shape[1]} window are too many",
                fix="leave the prior out, or give fewer places",
            )
        unique = np.unique(
            np.stack(
                [on_torus(given[:, 0], array.rows), on_torus(given[:, 1], array.columns)], axis=1
            ),
            axis=0,
        )
        self.rows, self.columns = unique[:, 0], unique[:, 1]
        a, b = np.indices(shape).reshape(2, -1).astype(np.uint64)
        labels = array.symbols(
            _shift_places(self.rows, a, array.rows), _shift_places(self.columns, b, array.columns)
        )
        every = labels[..., None] == np.arange(array.order)
        self._codebook = every.reshape(len(unique), -1).T.astype(np.float32)

    @property
    def size(self) -> int:
        """Number of candidates."""
        return self.rows.size

    @property
    def work(self) -> int:
        """Numbers held for each window."""
        return self.rows.size

    def rank(self, scores: Scores, number: int) -> Ranked:
        """Return the best places of scores (N, k, q)."""
        values = scores.reshape(len(scores), -1) @ self._codebook
        places, chosen, rest = best_of(values, number)
        return Ranked(self.rows[places], self.columns[places], chosen, rest)


def _shift_places(
    places: NDArray[np.uint64], steps: NDArray[np.uint64], cycle: int
) -> NDArray[np.uint64]:
    """Return (P, k) places + steps on a cycle of up to 2^64, without overflow."""
    steps = steps % np.uint64(cycle)
    room = np.uint64(cycle) - steps
    return np.where(places[:, None] >= room, places[:, None] - room, places[:, None] + steps)
