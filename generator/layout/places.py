"""Places that can be identified: windows that fit into the cells of a face, or the rank test.

Cells (integers) -> number of places. A place is a position at which the array's window fits
into the cells of one face; where none fits, all cells of the face together may still pass the
rank test and count as one place. Thesis 5.2 to 5.5.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from generator.array.contract import SymbolArray

Cells = NDArray[np.int64]
Identifies = Callable[[Cells, Cells], bool]  #: rank test on array (rows, columns)


def rank_test(array: SymbolArray) -> Identifies:
    """Return the array's rank test; sets too small to pass, or seen before, cost nothing."""
    least = -(-array.full_rank // array.rank([0], [0]))  # the rank of a set is at most the sum
    known: dict[bytes, bool] = {}

    def identifies(rows: Cells, columns: Cells) -> bool:
        if len(rows) < least:
            return False
        key = np.stack([rows - rows.min(), columns - columns.min()]).tobytes()
        if key not in known:
            known[key] = array.identifies(rows, columns)
        return known[key]

    return identifies


def count_places(
    rows: Cells, columns: Cells, window: tuple[int, int], identifies: Identifies | None
) -> int:
    """Return how many places of one face can be identified.

    Cells (n,) in array orientation, of which differences matter; `identifies` is the rank test for
    cells into which the window does not fit, None leaves it out.
    """
    if len(rows) == 0:
        return 0
    mask = np.zeros((np.ptp(rows) + 1, np.ptp(columns) + 1), dtype=bool)
    mask[rows - rows.min(), columns - columns.min()] = True
    fitting = int(windows_in(mask[:, None, :, None], *window).sum())
    if fitting or identifies is None:
        return fitting
    return int(identifies(rows - rows.min(), columns - columns.min()))


def windows_in(free: NDArray[np.bool_], rows: int, columns: int) -> NDArray[np.bool_]:
    """Return where windows fit into many masks at once, bool like `free` but smaller.

    Axes 0 and 2 are lattice rows and columns; 1 and 3 number the masks.
    """
    height, width = free.shape[0] - rows + 1, free.shape[2] - columns + 1
    if height <= 0 or width <= 0:
        return free[:0]
    fit = free[:height].copy()
    for k in range(1, rows):
        fit &= free[k : k + height]
    both = fit[:, :, :width].copy()
    for k in range(1, columns):
        both &= fit[:, :, k : k + width]
    return both


def array_cells(cells: Cells, quarter: int) -> tuple[Cells, Cells]:
    """Return rows and columns of cells (n, 2: j, i) turned by quarter turns, unshifted."""
    i, j = cells[:, 1], cells[:, 0]
    for _ in range(quarter % 4):
        i, j = -j, i
    return -j, i
