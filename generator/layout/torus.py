"""Place pieces on the torus of the array, next to taken cells, without using a cell twice.

Occupancy + masks (each with its allowed quarter turns) -> corner of each piece. Greedy, big
pieces first: of all free positions the one with the most contact (taken cells next to the
piece) is taken, the first in reading order among equals, as read from the array's first cell on.
Of a large array only a corner there is looked at, which grows when nothing fits any more.

The torus is one integer, a bit for each cell, so that every position of a piece is tried at once.
Shifting the integer moves the array under one cell of the piece; or-ing the shifts of all its
cells leaves zeros where it fits. A mask is a few blocks, and the shifts of a block are doubled
until it is covered. Contacts are counted only where a piece fits and touches taken cells.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.layout.occupancy import TILE, Mask, Occupancy

WHOLE_CELLS = 1 << 17  #: an array with no more cells is looked at as a whole
CORNER = 192  #: first extent of the corner of a larger array, rows and columns, cells
CORNER_GROWTH = 32  #: the corner's shorter side grows by this part of it, in whole tiles
NEIGHBOURS = 512  #: of a piece with more cells around it only every second, third, ... counts


@dataclass(frozen=True, slots=True)
class TorusPosition:
    """Where a piece lies: the array cell of its grid's upper left corner after turning."""

    row: int
    column: int
    quarter: int  #: quarter turns, counter-clockwise


def place_pieces(
    occupancy: Occupancy, pieces: Sequence[tuple[Mask, Sequence[int]]]
) -> list[TorusPosition | None]:
    """Return where pieces (mask, allowed quarter turns) are placed, big ones first, or None."""
    order = sorted(
        (k for k, (mask, _) in enumerate(pieces) if mask.any()),
        key=lambda k: (-max(pieces[k][0].shape), -int(pieces[k][0].sum()), k),
    )
    found_at: list[TorusPosition | None] = [None] * len(pieces)
    if not order:
        return found_at
    margin = max(max(mask.shape) for mask, _ in pieces) + 1
    board = Board(occupancy, margin)
    hopeless: set[bytes] = set()
    for k in order:
        mask, turns = pieces[k]
        forms = _forms(mask, turns)
        key = b"|".join(bytes(str(form.shape), "ascii") + form.tobytes() for form in forms.values())
        if key in hopeless:
            continue
        found = board.best(forms)
        while found is None and board.grow():
            found = board.best(forms)
        if found is None:
            hopeless.add(key)
            continue
        row, column, quarter = found
        board.take(forms[quarter], row, column)
        first = occupancy.first
        at = (row + first[0]) % occupancy.rows, (column + first[1]) % occupancy.columns
        found_at[k] = TorusPosition(*at, quarter)
    return found_at


def _forms(mask: Mask, turns: Iterable[int]) -> dict[int, Mask]:
    """Return the different turned masks by their quarter turns."""
    forms: dict[int, Mask] = {}
    for quarter in turns:
        form = np.ascontiguousarray(np.rot90(mask, quarter))
        if not any(np.array_equal(form, known) for known in forms.values()):
            forms[quarter] = form
    return forms


class Board:
    """The part of the torus that is looked at (`board_size`), as bits, with a margin around it.

    Bit (y + 1) stride + x + 1 is cell (y, x), counted from the first one of the occupancy. Where
    the extent is the whole side of the array the margin repeats the other side; elsewhere it
    counts as taken.
    """

    def __init__(self, occupancy: Occupancy, margin: int) -> None:
        """Look at the part of an array that is in use."""
        self._whole = occupancy.rows, occupancy.columns
        self._occupancy = occupancy
        self._margin = margin
        self._resize(*board_size(occupancy))

    def grow(self) -> bool:
        """Open more of the array; False if the whole of it is in sight."""
        extent = _next_extent(self._extent, self._whole)
        if extent == self._extent:
            return False
        self._resize(*extent)
        return True

    def best(self, forms: dict[int, Mask]) -> tuple[int, int, int] | None:
        """Return row, column and quarter turn of the free position with the most contact."""
        best: tuple[int, tuple[int, int, int]] | None = None
        for quarter, form in forms.items():
            free = self._free(form)
            if free == 0:
                continue
            at, contact = self._most(form, free)
            if best is None or contact > best[0]:
                best = contact, (at // self._stride, at % self._stride, quarter)
        return None if best is None else best[1]

    def take(self, form: Mask, row: int, column: int) -> None:
        """Take the cells of a form that has been turned already."""
        r, c = np.nonzero(form)
        rows, columns = self._extent
        cells = (r + row) % rows, (c + column) % columns
        first = self._occupancy.first
        self._occupancy = self._occupancy.with_cells(cells[0] + first[0], cells[1] + first[1])
        self._sheet[cells[0] + 1, cells[1] + 1] = True
        self._draw()

    def _resize(self, rows: int, columns: int) -> None:
        self._extent = rows, columns
        self._stride = columns + 1 + self._margin
        self._sheet = np.ones((rows + 1 + self._margin, self._stride), dtype=bool)
        self._sheet[1 : rows + 1, 1 : columns + 1] = False
        self._origins = _bits(~self._sheet) >> self._stride + 1
        self._sheet[1 : rows + 1, 1 : columns + 1] = self._occupancy.corner(rows, columns)
        self._draw()

    def _draw(self) -> None:
        """Repeat the other side in the margin, and make bits of the sheet."""
        rows, columns = self._extent
        if columns == self._whole[1]:
            x = np.r_[0, columns + 1 : self._sheet.shape[1]]
            self._sheet[:, x] = self._sheet[:, (x - 1) % columns + 1]
        if rows == self._whole[0]:
            y = np.r_[0, rows + 1 : self._sheet.shape[0]]
            self._sheet[y] = self._sheet[(y - 1) % rows + 1]
        self._blocks = {(1, 1): _bits(self._sheet)}

    def _free(self, form: Mask) -> int:
        """Return the origins (bit y stride + x) at which every cell of a form is free."""
        if form.shape[0] > self._extent[0] or form.shape[1] > self._extent[1]:
            return 0
        return self._origins & ~(self._taken(form) >> self._stride + 1)

    def _most(self, form: Mask, free: int) -> tuple[int, int]:
        """Return the first of the free origins with the most taken neighbours, and how many."""
        around = np.pad(form, 1)
        ring = around.copy()
        ring[1:] |= around[:-1]
        ring[:-1] |= around[1:]
        ring[:, 1:] |= around[:, :-1]
        ring[:, :-1] |= around[:, 1:]
        touching = free & self._taken(ring)
        if touching == 0:
            return (free & -free).bit_length() - 1, 0
        neighbours = np.argwhere(ring & ~around) @ (self._stride, 1)
        neighbours = neighbours[:: -(-len(neighbours) // NEIGHBOURS)]
        origins = _positions(touching)
        contact = np.zeros(len(origins), np.int64)
        sheet = self._sheet.ravel()
        for cell in neighbours.tolist():
            contact += sheet[origins + cell]
        k = int(contact.argmax())
        return int(origins[k]), int(contact[k])

    def _taken(self, form: Mask) -> int:
        """Return the bits at which some cell of a form, its corner being there, is taken."""
        taken = 0
        for y, x, height, width in _blocks_of(form):
            taken |= self._block(height, width) >> (y * self._stride + x)
        return taken

    def _block(self, height: int, width: int) -> int:
        """Return the bits at which some cell of a block of height x width is taken."""
        known = self._blocks.get((height, width))
        if known is None:
            if height > 1:
                half = height // 2
                low = self._block(height - half, width) >> half * self._stride
                known = self._block(half, width) | low
            else:
                half = width // 2
                known = self._block(1, half) | self._block(1, width - half) >> half
            self._blocks[height, width] = known
        return known


def board_size(occupancy: Occupancy) -> tuple[int, int]:
    """Return rows and columns of the part of an array in which objects lie.

    A small array is opened as a whole. Of a larger one it is a corner that grows by steps, and
    the first beyond which the next step to either side adds no taken cell: what another lab's
    objects hold far away opens nothing.
    """
    size = occupancy.rows, occupancy.columns
    if size[0] * size[1] <= WHOLE_CELLS:
        return size
    extent = min(size[0], CORNER), min(size[1], CORNER)
    corners = np.array(list(occupancy.tiles)).reshape(-1, 2) * TILE
    before = np.array(occupancy.first) - corners
    reaches = (before > 0) & (before < TILE)  # from before the first cell beyond it
    low = np.where(reaches, 0, -before % np.array(size, dtype=object))
    while extent != (following := _next_extent(extent, size)):
        inside = (low < _next_extent(following, size)).all(axis=1)  # a step for each side
        if not (inside & (low >= extent).any(axis=1)).any():
            break
        extent = following
    return extent


def _next_extent(extent: tuple[int, int], size: tuple[int, int]) -> tuple[int, int]:
    """Return the next extent of the corner of an array, or the whole array."""
    rows, columns = extent
    if columns == size[1] or (rows <= columns and rows < size[0]):
        return min(_step(rows), size[0]), columns
    return rows, min(_step(columns), size[1])


def _step(side: int) -> int:
    return side + TILE * -(-side // (CORNER_GROWTH * TILE))


def _blocks_of(form: Mask) -> list[tuple[int, int, int, int]]:
    """Return the blocks that make a mask up: first row, first column, height, width."""
    edge = np.diff(np.pad(form, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(edge == 1)
    _, past = np.nonzero(edge == -1)
    blocks: list[tuple[int, int, int, int]] = []
    open_ones: dict[tuple[int, int], int] = {}  # (first, past) -> number of a block so far
    for y, *run in zip(row.tolist(), first.tolist(), past.tolist(), strict=True):
        k = open_ones.get((run[0], run[1]))
        if k is not None and blocks[k][0] + blocks[k][2] == y:
            blocks[k] = (*blocks[k][:2], blocks[k][2] + 1, blocks[k][3])
        else:
            open_ones[run[0], run[1]] = len(blocks)
            blocks.append((y, run[0], 1, run[1] - run[0]))
    return blocks


def _positions(bits: int) -> NDArray[np.intp]:
    """Return the numbers of the bits that are set, rising."""
    plain = np.frombuffer(bits.to_bytes((bits.bit_length() + 7) // 8, "little"), np.uint8)
    some = np.flatnonzero(plain)
    k, bit = np.nonzero(np.unpackbits(plain[some, None], axis=1, bitorder="little"))
    return some[k] * 8 + bit


def _bits(board: Mask) -> int:
    return int.from_bytes(np.packbits(board.ravel(), bitorder="little").tobytes(), "little")
