"""The torus as bits of one integer, so that every position of a piece is tried at once.

Taken cells + mask -> position. Shifting the integer moves the array under one cell of the
piece; or-ing the shifts of all its cells leaves zeros where it fits. Contacts (taken cells
beside the piece) are added up by full adders made of bits, position by position.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]

WHOLE = 1 << 17  #: an array with no more cells is looked at as a whole
CORNER = 192  #: first extent of the corner of a larger array, rows and columns
NEIGHBOURS = 512  #: of a piece with more cells around it only every second, third, ... counts


class Board:
    """The part of the torus that is looked at, as bits, with a margin around it.

    Bit (y + 1) stride + x + 1 is cell (y, x). Where the extent is the whole side of the array
    the margin repeats the other side; elsewhere it counts as taken.
    """

    def __init__(
        self,
        size: tuple[int, int],
        taken: tuple[NDArray[np.int64], NDArray[np.int64]],
        margin: int,
        needed: int,
    ) -> None:
        """Look at enough of an array of `size` to hold `needed` cells beside the taken ones."""
        self._whole, self._before = size, taken
        self._margin = margin
        self._new: list[tuple[NDArray[np.intp], NDArray[np.intp]]] = []
        rows, columns = size
        if rows * columns <= WHOLE:
            self._resize(rows, columns)
            return
        side = CORNER
        self._resize(min(rows, side), min(columns, side))
        while self._taken.size - np.count_nonzero(self._taken) < needed and self.grow():
            pass

    def grow(self) -> bool:
        """Double the smaller side that can still grow; False if the whole array is in sight."""
        rows, columns = self._taken.shape
        if rows == self._whole[0] and columns == self._whole[1]:
            return False
        taller = columns == self._whole[1] or (rows <= columns and rows < self._whole[0])
        if taller:
            rows = min(2 * rows, self._whole[0])
        else:
            columns = min(2 * columns, self._whole[1])
        self._resize(rows, columns)
        return True

    def best(self, forms: dict[int, Mask]) -> tuple[int, int, int] | None:
        """Return row, column and quarter turn of the free position with the most contact."""
        best: tuple[int, tuple[int, int, int]] | None = None
        for quarter, form in forms.items():
            free = self._free(form)
            if free == 0:
                continue
            contact, free = _most(free, self._neighbours(form))
            if best is None or contact > best[0]:
                at = (free & -free).bit_length() - 1
                best = contact, (at // self._stride, at % self._stride, quarter)
        return None if best is None else best[1]

    def take(self, form: Mask, row: int, column: int) -> None:
        """Take the cells of a form that has been turned already."""
        r, c = np.nonzero(form)
        rows, columns = self._taken.shape
        cells = (r + row) % rows, (c + column) % columns
        self._new.append(cells)
        self._taken[cells] = True
        self._draw()

    def _resize(self, rows: int, columns: int) -> None:
        self._taken = np.zeros((rows, columns), dtype=bool)
        r, c = self._before
        seen = (r < rows) & (c < columns)
        self._taken[r[seen], c[seen]] = True
        for cells in self._new:
            self._taken[cells] = True
        self._stride = columns + 1 + self._margin
        self._height = rows + 1 + self._margin
        self._y, self._x = np.arange(self._height) - 1, np.arange(self._stride) - 1
        self._outside_y = (self._y < 0) | (self._y >= rows)
        self._outside_x = (self._x < 0) | (self._x >= columns)
        if rows == self._whole[0]:
            self._outside_y[:] = False
        if columns == self._whole[1]:
            self._outside_x[:] = False
        origins = np.zeros((self._height, self._stride), dtype=bool)
        origins[:rows, :columns] = True
        self._origins = _bits(origins)
        self._draw()

    def _draw(self) -> None:
        rows, columns = self._taken.shape
        board = self._taken[np.ix_(self._y % rows, self._x % columns)]
        board[self._outside_y] = True
        board[:, self._outside_x] = True
        self._bits = _bits(board)
        self._runs = {1: self._bits}

    def _run(self, length: int) -> int:
        """Return the bits at which at least one of `length` cells in a row is taken."""
        if length not in self._runs:
            half = length // 2
            self._runs[length] = self._run(half) | self._run(length - half) >> half
        return self._runs[length]

    def _free(self, form: Mask) -> int:
        """Return the origins (bit y stride + x) at which every cell of a form is free."""
        if form.shape[0] > self._taken.shape[0] or form.shape[1] > self._taken.shape[1]:
            return 0
        taken = 0
        for y, x, length in _row_runs(form):
            taken |= self._run(length) >> ((y + 1) * self._stride + x + 1)
        return self._origins & ~taken

    def _neighbours(self, form: Mask) -> list[int]:
        """Return, for each cell beside a form, the origins at which that cell is taken."""
        ring = _ring(form)
        ring = ring[:: -(-len(ring) // NEIGHBOURS)]
        return [self._bits >> shift for shift in (ring @ (self._stride, 1)).tolist()]


def _most(free: int, neighbours: list[int]) -> tuple[int, int]:
    """Return the greatest number of neighbours over the free origins, and where it is reached."""
    planes = _counted(neighbours)
    most = 0
    for k in range(len(planes) - 1, -1, -1):
        reached = free & planes[k]
        if reached:
            most |= 1 << k
            free = reached
    return most, free


def _counted(bits: list[int]) -> list[int]:
    """Add up bits position by position: binary digits of the sums, by full and half adders."""
    planes = []
    column = bits
    while column:
        carries = []
        while len(column) > 1:
            a, b = column.pop(), column.pop()
            either = a ^ b
            if column:
                c = column.pop()
                column.append(either ^ c)
                carries.append(a & b | either & c)
            else:
                column.append(either)
                carries.append(a & b)
        planes.append(column[0])
        column = carries
    return planes


def _row_runs(form: Mask) -> list[tuple[int, int, int]]:
    """Return the runs of a mask: row, first column, length."""
    edge = np.diff(np.pad(form, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(edge == 1)
    _, past = np.nonzero(edge == -1)
    return list(zip(row.tolist(), first.tolist(), (past - first).tolist(), strict=True))


def _ring(form: Mask) -> NDArray[np.intp]:
    """Return the cells that share a side with a mask (n, 2), its corner being at (1, 1)."""
    inside = np.pad(form, 1)
    ring = np.zeros_like(inside)
    ring[1:] |= inside[:-1]
    ring[:-1] |= inside[1:]
    ring[:, 1:] |= inside[:, :-1]
    ring[:, :-1] |= inside[:, 1:]
    return np.argwhere(ring & ~inside)


def _bits(board: Mask) -> int:
    return int.from_bytes(np.packbits(board.ravel(), bitorder="little").tobytes(), "little")
