"""Place pieces on the torus of the array, beside what is taken, without using a cell twice.

Occupancy + masks (each with its allowed quarter turns) -> corner of each piece. Greedy, big
pieces first: of all free positions the one with the most contact (taken cells next to the
piece) is taken, the first in reading order among equals. Of a large array only a corner is
looked at, which grows when nothing fits any more.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.array.contract import SymbolArray
from generator.layout.board import Board, Mask


@dataclass(frozen=True, slots=True)
class Occupancy:
    """Which cells of a torus are taken."""

    rows: int
    columns: int
    taken_rows: NDArray[np.int64]  #: (n,) each cell once
    taken_columns: NDArray[np.int64]  #: (n,)

    @classmethod
    def from_cells(cls, rows: ArrayLike, columns: ArrayLike, array: SymbolArray) -> Occupancy:
        """Return the occupancy of an array by cells (n,), taken on the torus."""
        return _occupancy(array.rows, array.columns, np.asarray(rows), np.asarray(columns))

    def with_cells(self, rows: ArrayLike, columns: ArrayLike) -> Occupancy:
        """Return the occupancy with more cells taken."""
        return _occupancy(
            self.rows,
            self.columns,
            np.concatenate([self.taken_rows, np.asarray(rows)]),
            np.concatenate([self.taken_columns, np.asarray(columns)]),
        )

    @property
    def used(self) -> int:
        """Number of taken cells."""
        return len(self.taken_rows)

    @property
    def free(self) -> int:
        """Number of free cells."""
        return self.rows * self.columns - self.used

    @property
    def density(self) -> float:
        """Share of the array that is used."""
        return self.used / (self.rows * self.columns)


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a piece lies: the array cell of its grid's upper left corner after turning."""

    row: int
    column: int
    quarter: int  #: quarter turns, counter-clockwise


def place_pieces(
    occupancy: Occupancy, pieces: Sequence[tuple[Mask, Sequence[int]]]
) -> list[Spot | None]:
    """Place pieces on the free cells, big ones first.

    Parameters
    ----------
    occupancy
        What is taken already; it is not changed.
    pieces
        For each piece its mask (rows, columns) and its allowed quarter turns.

    Returns
    -------
    One spot per piece, None where no free place was found.
    """
    order = sorted(
        (k for k, (mask, _) in enumerate(pieces) if mask.any()),
        key=lambda k: (-max(pieces[k][0].shape), -int(pieces[k][0].sum()), k),
    )
    spots: list[Spot | None] = [None] * len(pieces)
    if not order:
        return spots
    margin = max(max(mask.shape) for mask, _ in pieces) + 1
    needed = sum(int(pieces[k][0].sum()) for k in order)
    board = Board(
        (occupancy.rows, occupancy.columns),
        (occupancy.taken_rows, occupancy.taken_columns),
        margin,
        needed,
    )
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
        spots[k] = Spot(row, column, quarter)
    return spots


def cells_at(mask: Mask, spot: Spot, rows: int, columns: int) -> tuple[NDArray[np.int64], ...]:
    """Return the array rows and columns of a mask (not yet turned) at a spot, on the torus."""
    r, c = np.nonzero(np.rot90(mask, spot.quarter))
    return _on_torus(r + spot.row, rows), _on_torus(c + spot.column, columns)


def _forms(mask: Mask, turns: Iterable[int]) -> dict[int, Mask]:
    """Return the different turned masks by their quarter turns."""
    forms: dict[int, Mask] = {}
    for quarter in turns:
        form = np.ascontiguousarray(np.rot90(mask, quarter))
        if not any(np.array_equal(form, known) for known in forms.values()):
            forms[quarter] = form
    return forms


def _occupancy(
    rows: int, columns: int, taken_rows: NDArray[np.int64], taken_columns: NDArray[np.int64]
) -> Occupancy:
    r, c = _on_torus(taken_rows, rows), _on_torus(taken_columns, columns)
    if _rising(r, c):  # as a database gives them
        return Occupancy(rows, columns, r, c)
    order = np.lexsort((c, r))
    r, c = r[order], c[order]
    new = np.ones(len(r), dtype=bool)
    new[1:] = (np.diff(r) != 0) | (np.diff(c) != 0)
    return Occupancy(rows, columns, r[new], c[new])


def _rising(r: NDArray[np.int64], c: NDArray[np.int64]) -> bool:
    """Return whether cells come row by row, each once."""
    down, right = np.diff(r), np.diff(c)
    return bool(((down > 0) | ((down == 0) & (right > 0))).all())


def _on_torus(values: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """Return values modulo a size, which may be too large for the array's own arithmetic."""
    if size > np.iinfo(np.int64).max:
        values = values.astype(object)
    return np.mod(values, size).astype(np.int64).ravel()
