"""Place pieces on the torus of the array, beside what is taken, without using a cell twice.

Occupancy + masks (each with its allowed quarter turns) -> corner of each piece. Greedy, big
pieces first: of all free positions the one with the most contact (taken cells next to the
piece) is taken, the first in reading order among equals, as read from the array's first cell on.
Of a large array only a corner there is looked at, which grows when nothing fits any more.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.layout.board import Board
from generator.layout.occupancy import Mask, Occupancy, on_torus

__all__ = ["Occupancy", "Spot", "cells_at", "place_pieces"]


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
        spots[k] = Spot(*at, quarter)
    return spots


def cells_at(mask: Mask, spot: Spot, rows: int, columns: int) -> tuple[NDArray[np.int64], ...]:
    """Return the array rows and columns of a mask (not yet turned) at a spot, on the torus."""
    r, c = np.nonzero(np.rot90(mask, spot.quarter))
    return on_torus(r + spot.row, rows), on_torus(c + spot.column, columns)


def _forms(mask: Mask, turns: Iterable[int]) -> dict[int, Mask]:
    """Return the different turned masks by their quarter turns."""
    forms: dict[int, Mask] = {}
    for quarter in turns:
        form = np.ascontiguousarray(np.rot90(mask, quarter))
        if not any(np.array_equal(form, known) for known in forms.values()):
            forms[quarter] = form
    return forms
