"""Index of all small windows that a database holds: six or four labels -> where they stand.

Registered cells -> Windows, once per database. A touch that sees six neighbouring symbols
surely asks for them, or for four; what it pays does not grow with the number of registered
faces, but with how often the same labels occur (array order to the sixth divides them). Works
for every kind of array, since only registered cells are listed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

SHAPES = ((2, 3), (3, 2), (2, 2))  #: rows and columns of a window


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Registered cells, ordered by the labels of the windows of which they are the top left."""

    shape: tuple[int, int]
    codes: Ints  #: (n,) rising; labels of the window as digits, row by row
    cells: NDArray[np.uint32]  #: (n,) places in the keys

    def at(self, code: int) -> NDArray[np.uint32]:
        """Return where a window's labels stand, as places in the keys."""
        first, last = np.searchsorted(self.codes, [code, code + 1])
        return self.cells[first:last]


def index_windows(
    keys: NDArray[np.uint64],
    owners: NDArray[np.int32],
    rows: int,
    columns: int,
    order: int,
    at: Callable[[Ints, Ints], tuple[NDArray[np.int32], NDArray[np.int8]]],
) -> tuple[Windows, ...]:
    """Return the index of registered cells, for all shapes.

    Parameters
    ----------
    keys, owners
        (n,) of the cells, row * columns + column, rising; and the faces that hold them.
    rows, columns, order
        Of the array.
    at
        Rows and columns on the torus -> which face holds each cell, and the cell's label.
    """
    row, column = (part.astype(np.int64) for part in np.divmod(keys, np.uint64(columns)))
    found = []
    for shape in SHAPES:
        code = np.zeros(len(keys), np.int64)
        whole = np.ones(len(keys), np.bool_)
        for down in range(shape[0]):
            for right in range(shape[1]):
                held_by, label = at((row + down) % rows, (column + right) % columns)
                whole &= held_by == owners
                code = code * order + label
        places = np.flatnonzero(whole)
        by_code = places[np.argsort(code[places], kind="stable")]
        found.append(Windows(shape, code[by_code], by_code.astype(np.uint32)))
    return tuple(found)
