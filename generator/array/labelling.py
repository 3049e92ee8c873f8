"""Which symbol shows which term of a sequence, and where objects begin: what a key may change.

Of the q! permutations of the symbols most give an array that another polynomial or a shift
gives as well: multiplying by an element of GF(q) shifts an m-sequence, and A -> A^p gives that
of the conjugate polynomial. What is left for q = 4 are the 4 translations x -> x + k.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from generator.array.contract import Labels
from generator.array.field import Field
from generator.errors import ArrayError


def translation(field: Field, label: int) -> tuple[int, ...]:
    """Return the permutation x -> x + label of GF(q).

    Examples
    --------
    >>> from generator.array.field import field_of_order
    >>> translation(field_of_order(4), 2)
    (2, 3, 0, 1)
    """
    return tuple(field.addition[:, label].tolist())


def checked_permutation(permutation: Iterable[int] | None, order: int) -> Labels:
    """Return (order,) labels, read-only, each once; the identity for None."""
    given = list(range(order)) if permutation is None else list(permutation)
    if sorted(given) != list(range(order)):
        raise ArrayError(
            f"permutation {given} does not show each of the {order} labels once",
            fix=f"give 0 to {order - 1} in any order, or leave permutation: out",
        )
    labels = np.array(given, dtype=np.int64)
    labels.setflags(write=False)
    return labels


def checked_cell(cell: Sequence[int], rows: int, columns: int) -> tuple[int, int]:
    """Return a cell of an array of rows x columns."""
    row, column = cell
    if not (0 <= row < rows and 0 <= column < columns):
        raise ArrayError(
            f"first: [{row}, {column}] is no cell of an array of {rows}x{columns}",
            fix=f"give a row below {rows} and a column below {columns}, or leave first: out",
        )
    return int(row), int(column)
