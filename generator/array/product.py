"""PRPA and PRMVPA: a symbol for each pair of terms of two m-sequences.

A[r][c] = law(SR[r], SC[c]), SR down the rows, SC along the columns. Every injective law
serves; a symbol then gives both factors, and the place is two indices found apart. The
default law q_c SR + SC is the one of both figures: 5.7 (SX + 2 SY, X along the columns)
and 5.11 (4 S(i) + label of S(j)). Thesis 5.3 and 5.5.

Where the thesis is wrong as printed: figure 5.11's corner header is swapped, S(i) runs down
the rows; figure 6.9 pairs two binary x^4+x+1 sequences with figure 5.7's law (both axes, no
GF(4) sequence, no field product); a window needs max(k1, k2) symbols, one in every row and
every column, not p + q - 1; and the law must be injective, commutative or not.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generator.array.contract import Labels, on_torus
from generator.array.sequence import Sequence, sequence_definition
from generator.array.window import minimum_distance
from generator.errors import ArrayError


class ProductArray:
    """A product array of two m-sequences: SR, one term for each row, and SC, one for each column.

    The window is at least the two degrees, its default. `law` (q_r, q_c): labels of the symbols,
    each of 0 ... q_r q_c - 1 once; law[a][b] = q_c a + b by default.
    """

    def __init__(
        self,
        row_sequence: Sequence,
        column_sequence: Sequence,
        window: tuple[int, int] | None = None,
        law: ArrayLike | None = None,
    ) -> None:
        self.row_sequence = row_sequence
        self.column_sequence = column_sequence
        self.rows, self.columns = row_sequence.period, column_sequence.period
        p, q = row_sequence.field.order, column_sequence.field.order
        self.order = p * q  #: number of different symbols
        self.full_rank = row_sequence.degree + column_sequence.degree  #: both factors determined
        self.first = (0, 0)  #: cell at which the placing of objects begins
        every = np.arange(self.order).reshape(p, q)
        given = every if law is None else np.asarray(law)
        if given.shape != (p, q) or not np.array_equal(np.sort(given, axis=None), every.ravel()):
            raise ArrayError(
                f"the product law must be a table of {p}x{q} labels with each of 0 to "
                f"{self.order - 1} once (injective)",
                fix="leave law: out for the thesis's, or correct the table",
            )
        self.law: Labels = given.astype(np.int64)
        places = np.argsort(self.law.ravel())
        #: (order, 2) labels of SR and SC for each symbol
        self.factors: Labels = np.stack([places // q, places % q], axis=1).astype(np.int64)
        least = (row_sequence.degree, column_sequence.degree)
        self.window = a, b = least if window is None else window
        if not (least[0] <= a <= self.rows and least[1] <= b <= self.columns):
            raise ArrayError(
                f"a {a}x{b} window of a {self.rows}x{self.columns} product array does not show "
                f"{least[0]} rows and {least[1]} columns, the degrees of its two sequences",
                fix=f"take {least[0]}x{least[1]} or larger, within the array",
            )

    def __repr__(self) -> str:
        return f"ProductArray({self.row_sequence!r}, {self.column_sequence!r})"

    @property
    def family(self) -> str:
        """Return prpa for two binary sequences, prmvpa otherwise."""
        binary = self.row_sequence.field.order == self.column_sequence.field.order == 2
        return "prpa" if binary else "prmvpa"

    def symbols(self, rows: ArrayLike, columns: ArrayLike) -> Labels:
        """Return the labels at cells (rows, columns), broadcast together, on the torus."""
        return np.asarray(
            self.law[self.row_sequence.symbols(rows), self.column_sequence.symbols(columns)]
        )

    def rank(self, rows: ArrayLike, columns: ArrayLike) -> int:
        """Return the rank of the visible rows over SR plus that of the visible columns over SC."""
        r, c = self._cells(rows, columns)
        if not r:
            return 0
        in_rows = self.row_sequence.rank(row - r[0] for row in r)
        return in_rows + self.column_sequence.rank(column - c[0] for column in c)

    def identifies(self, rows: ArrayLike, columns: ArrayLike) -> bool:
        """Whether the cells together name their place: both factors determined."""
        return self.rank(rows, columns) == self.full_rank

    def minimum_distance(self, rows: ArrayLike, columns: ArrayLike) -> int:
        """Return the least number of these cells in which two places differ; 0: look alike.

        A row of cells changes as a whole: d = min(b d_row, a d_column) for an a x b window.
        """
        pairs = sorted(set(zip(*self._cells(rows, columns), strict=True)))
        in_row = Counter(row for row, _ in pairs)
        in_column = Counter(sorted(column for _, column in pairs))
        return min(
            minimum_distance(self.row_sequence, list(in_row), list(in_row.values())),
            minimum_distance(self.column_sequence, list(in_column), list(in_column.values())),
        )

    def _cells(self, rows: ArrayLike, columns: ArrayLike) -> tuple[list[int], list[int]]:
        r, c = np.broadcast_arrays(on_torus(rows, self.rows), on_torus(columns, self.columns))
        return r.ravel().tolist(), c.ravel().tolist()

    def definition(self) -> dict[str, Any]:
        """Return the plain values (JSON) from which `array_from` makes this array again."""
        return {
            "family": self.family,
            "factors": {
                "rows": sequence_definition(self.row_sequence),
                "columns": sequence_definition(self.column_sequence),
            },
            "law": self.law.tolist(),
            "rows": self.rows,
            "columns": self.columns,
            "window": list(self.window),
        }
