"""What a view can do: rank and minimum distance of any set of visible cells.

A view is a set of cells relative to the place, in any shape. With minimum distance d, up to
d - 1 symbols that are missing, or (d - 1)/2 that are wrong, never lead to another place;
e wrong and s missing ones together if 2 e + s < d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generator.array.fold import FoldedArray
from generator.array.product import ProductArray


@dataclass(frozen=True, slots=True)
class Strength:
    """Exact answers about one set of visible cells."""

    cells: int  #: symbols seen
    rank: int  #: names the place if it is `full_rank`
    full_rank: int
    distance: int  #: least number of cells in which two places differ; 0: look alike

    @property
    def identifies(self) -> bool:
        """Whether the cells together name their place."""
        return self.rank == self.full_rank

    @property
    def errors(self) -> int:
        """Wrong symbols that are always corrected."""
        return max(0, (self.distance - 1) // 2)

    @property
    def erasures(self) -> int:
        """Missing symbols that are always made up for."""
        return max(0, self.distance - 1)


def strength(array: FoldedArray | ProductArray, rows: ArrayLike, columns: ArrayLike) -> Strength:
    """Return what the cells (rows, columns), relative to the place, can do.

    Raises `ArrayError` if the minimum distance is out of reach: beyond 2^20 places and 2^16 dual
    words.

    >>> from generator.array import profile
    >>> strength(profile("thesis").array(), *np.indices((6, 6))).errors
    2
    """
    r, c = np.broadcast_arrays(rows, columns)
    rank = array.rank(r, c)
    distance = array.minimum_distance(r, c) if rank == array.full_rank else 0
    return Strength(r.size, rank, array.full_rank, distance)


def strength_of_window(array: FoldedArray | ProductArray, rows: int, columns: int) -> Strength:
    """Return what a window of rows x columns cells can do, all of them seen."""
    return strength(array, *np.indices((rows, columns)))
