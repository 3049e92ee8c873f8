"""What the cells of a lattice say of many registered places at once.

Each function has a numpy form, the reference, and a compiled one (`places.c`): the same sums in the
same order. Cells (m, 2) are column and upward row of a lattice; a place is the array cell on which
its cell (0, 0) lies, and the face that holds the symbols. Thesis 6.3.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.compiled import addresses
from recognizer.touch.lab import EmbossedArray, cell_keys
from recognizer.touch.symbols.kernels import compiled_kernels

Ints = NDArray[np.int64]
Array = NDArray[np.float64]

Places = tuple[Ints, Ints, NDArray[np.int32]]  #: rows and columns (n,) of (0, 0), and faces


class _Held(ctypes.Structure):
    """`Held` of places.c."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("registered", "rows", "columns", "order")),
        *((name, ctypes.c_void_p) for name in ("keys", "owners", "labels", "dense")),
    ]


def add_scores(
    embossed: EmbossedArray, places: Places, cells: Ints, scores: Array, before: Array
) -> Array:
    """Return sums (n,) that are continued by the scores of what cells show at each place.

    Parameters
    ----------
    cells, scores
        (m, 2) and (m, order + 1), the last one where the face of the place holds no symbol.
    before
        (n,) to which they are added, one after the other.
    """
    library, total = compiled_kernels(), before.copy()
    rows, columns, owners = (np.ascontiguousarray(one) for one in places)
    cells, scores = np.ascontiguousarray(cells), np.ascontiguousarray(scores)
    if library is not None:
        held = _held_by(embossed)
        library.add_scores(
            ctypes.addressof(held), len(total), *addresses(rows, columns, owners),
            len(cells), *addresses(cells, scores, total),
        )  # fmt: skip
        return total
    array = embossed.array
    for (i, j), each in zip(cells.tolist(), scores, strict=True):
        held_by, label = embossed.at((rows - j) % array.rows, (columns + i) % array.columns)
        total += each[np.where(held_by == owners, label, array.order)]
    return total


def name_places(embossed: EmbossedArray, at: Ints, cells: Ints) -> Ints:
    """Return key of the place times (faces + 1), and its face, as one number (n,) for each.

    Cell (0, 0) lies at that place if cells (n, 2) are the registered ones `at` (n,). Of arrays
    so large that one number cannot name both `place_keys` tells the places.
    """
    library, faces = compiled_kernels(), len(embossed.faces) + 1
    if library is None:
        return place_keys(embossed, at, cells).astype(np.int64) * faces + embossed.owners[at]
    held, names = _held_by(embossed), np.empty(len(at), np.int64)
    at, cells = np.ascontiguousarray(at), np.ascontiguousarray(cells)
    library.name_places(
        ctypes.addressof(held), len(at), *addresses(at, cells), faces, *addresses(names)
    )  # fmt: skip
    return names


def place_keys(embossed: EmbossedArray, at: Ints, cells: Ints) -> NDArray[np.uint64]:
    """Return where cell (0, 0) lies (n,), `cell_keys`, if cells (n, 2) are the registered `at`."""
    array = embossed.array
    rows, columns = np.divmod(embossed.keys[at], np.uint64(array.columns))
    row = (rows.astype(np.int64) + cells[:, 1]) % array.rows
    column = (columns.astype(np.int64) - cells[:, 0]) % array.columns
    return cell_keys(array.columns, row, column)


def count_names(names: Ints) -> tuple[Ints, Ints]:
    """Return numbers (n,), none negative, each once and rising, and how often each was there."""
    library = compiled_kernels()
    if library is None:
        known, votes = np.unique(names, return_counts=True)
        return known, votes.astype(np.int64)
    known, spare, votes = names.copy(), np.empty_like(names), np.empty_like(names)
    count = library.count_names(len(names), *addresses(known, spare, votes))
    return known[:count], votes[:count]


def count_places(embossed: EmbossedArray, cells: Ints, prices: Array, slack: float) -> int:
    """Return how many registered cells can be the one that cells are counted from.

    Parameters
    ----------
    cells, prices
        (m, 2) that show no symbol, and (m,) nats that each costs where the place holds one.
    slack
        Nats that these may come to.
    """
    library = compiled_kernels()
    cells, prices = np.ascontiguousarray(cells), np.ascontiguousarray(prices)
    if library is not None:
        held = _held_by(embossed)
        at = ctypes.addressof(held)
        return int(library.count_places(at, len(cells), *addresses(cells, prices), slack))
    array, keys, owners = embossed.array, embossed.keys, embossed.owners[:-1]
    row, column = (part.astype(np.int64) for part in np.divmod(keys, np.uint64(array.columns)))
    left = np.full(len(keys), slack)
    for (i, j), price in zip(cells.tolist(), prices.tolist(), strict=True):
        held_by, _ = embossed.at((row - j) % array.rows, (column + i) % array.columns)
        left = left - price * (held_by == owners)
        kept = left >= 0
        row, column, owners, left = row[kept], column[kept], owners[kept], left[kept]
    return len(row)


@lru_cache(maxsize=8)
def _held_by(embossed: EmbossedArray) -> _Held:
    array = embossed.array
    return _Held(
        len(embossed.keys), array.rows, array.columns, array.order,
        *addresses(embossed.keys, embossed.owners, embossed.labels, embossed.dense),
    )  # fmt: skip
