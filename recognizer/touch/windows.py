"""Index of all small windows that a database holds: six or four labels -> where they stand.

Encoding -> Windows, once per database. A touch that sees six neighbouring symbols surely asks
for them, or for four; what it pays does not grow with the number of registered faces, but
with how often the same labels occur (array order to the sixth divides them). Works for every
kind of array, since only registered cells are listed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from recognizer.touch.lab import Encoding

Ints = NDArray[np.int64]

SHAPES = ((2, 3), (3, 2), (2, 2))  #: rows and columns of a window


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Registered cells, ordered by the labels of the windows of which they are the top left."""

    shape: tuple[int, int]
    codes: Ints  #: (n,) rising; labels of the window as digits, row by row
    cells: NDArray[np.uint32]  #: (n,) places in `Encoding.keys`

    def at(self, code: int) -> NDArray[np.uint32]:
        """Return where a window's labels stand, as places in `Encoding.keys`."""
        first, last = np.searchsorted(self.codes, [code, code + 1])
        return self.cells[first:last]


def windows_of(encoding: Encoding) -> tuple[Windows, ...]:
    """Return the index of an encoding, for all shapes."""
    array, order = encoding.array, encoding.array.order
    rows, columns = np.divmod(encoding.keys, np.uint64(array.columns))
    rows, columns = rows.astype(np.int64), columns.astype(np.int64)
    found = []
    for shape in SHAPES:
        code = np.zeros(len(rows), np.int64)
        whole = np.ones(len(rows), np.bool_)
        for down in range(shape[0]):
            for right in range(shape[1]):
                held_by, label = encoding.at(
                    (rows + down) % array.rows, (columns + right) % array.columns
                )
                whole &= held_by == encoding.owners[:-1]
                code = code * order + label
        places = np.flatnonzero(whole)
        by_code = places[np.argsort(code[places], kind="stable")]
        found.append(Windows(shape, code[by_code], by_code.astype(np.uint32)))
    return tuple(found)
