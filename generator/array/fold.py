"""PRBA and PRMVA: an m-sequence folded on the torus, A[t mod n1][t mod n2] = s[t].

Any coprime n1 n2 = q^n - 1 serves (the thesis takes n1 = q^k1 - 1, n = k1 k2, figure 5.5).
With e1 = 1 (mod n1), 0 (mod n2) and e2 the other way round, cell (r, c) has the index
t = r e1 + c e2 and the field element beta^r gamma^c, beta = x^e1, gamma = x^e2: rows and
columns are prepared apart, and a symbol is one inner product. Nothing is materialised.
A set of visible cells names its place if the functionals of its cells have rank n.
The most square folds with n1 = q^k - 1 are 15x17, 31x33, 63x65, ... over GF(2), 15x17, 63x65,
255x257, ... over GF(4). Thesis 5.2.

A key may permute which symbol shows which term. Of the q! permutations most give an array that
another polynomial or a shift gives as well: multiplying by an element of GF(q) shifts an
m-sequence, and A -> A^p gives that of the conjugate polynomial. What is left for q = 4 are the 4
translations x -> x + k.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import gcd, prod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.array.contract import Labels, on_torus
from generator.array.factor import (
    LARGEST_PERIOD,
    LARGEST_PRIME_FACTOR,
    is_decodable,
    period_factors,
)
from generator.array.field import Field, format_polynomial
from generator.array.residue import Powers, pack_words
from generator.array.sequence import Sequence, sequence_definition
from generator.array.window import minimum_distance
from generator.errors import ArrayError


def folds(order: int, degree: int) -> list[tuple[int, int]]:
    """Return every coprime (rows, columns), 1 < rows < columns, the most square first."""
    parts = [prime**exponent for prime, exponent in period_factors(order, degree).items()]
    period = prod(parts)
    divisors = {1}
    for part in parts:
        divisors |= {part * divisor for divisor in divisors}
    pairs = [(rows, period // rows) for rows in divisors if 1 < rows < period // rows]
    return sorted(pairs, key=lambda pair: pair[1])


def usual_fold(order: int, degree: int) -> tuple[int, int] | None:
    """Return the most square fold with rows = q^k - 1 (thesis 5.2), or the most square of all."""
    every = folds(order, degree)
    powers = {order**k - 1 for k in range(1, degree)}
    return next((pair for pair in every if pair[0] in powers), every[0] if every else None)


def nearest_sizes(order: int, degree: int) -> list[tuple[int, tuple[int, int]]]:
    """Return (degree, usual fold) of the nearest arrays, below and above, that fold and decode."""
    found = []
    for step in (-1, 1):
        n = degree + step
        while n > 1 and order**n - 1 <= LARGEST_PERIOD:
            fold = usual_fold(order, n) if is_decodable(order, n) else None
            if fold is not None:
                found.append((n, fold))
                break
            n += step
    return found


def require_foldable(order: int, degree: int) -> tuple[int, int]:
    """Return the usual fold of a degree that folds and decodes.

    Raises `ArrayError` with the nearest sizes if q^n - 1 has no coprime factors, or a prime factor
    beyond 2^40, which is too large for the discrete logarithm.
    """
    largest = max(period_factors(order, degree), default=1)
    fold = usual_fold(order, degree)
    near = nearest_sizes(order, degree)
    way_out = "take " + " or ".join(f"degree {n} ({a}x{b})" for n, (a, b) in near)
    terms = order**degree - 1
    if largest > LARGEST_PRIME_FACTOR:
        raise ArrayError(
            f"an array of {terms} cells (degree {degree} over GF({order})) cannot be decoded: "
            f"{terms} has the prime factor {largest}, and the logarithm is limited to 2^40",
            fix=way_out,
        )
    if fold is None:
        raise ArrayError(
            f"the {terms} terms of degree {degree} over GF({order}) do not fold: {terms} has no "
            "two coprime factors",
            fix=f"{way_out}, or family {'prbs' if order == 2 else 'prmvs'}",
        )
    return fold


def translation(field: Field, label: int) -> tuple[int, ...]:
    """Return the permutation x -> x + label of GF(q)."""
    return tuple(field.addition[:, label].tolist())


_CHUNK = 1 << 14  # cells at a time where digits are not packed


class FoldedArray:
    """A folded m-sequence; an unfolded one (PRBS, PRMVS) has one row.

    Rows and columns are coprime, their product the number of terms. The window must be unique; the
    smallest one by default. `permutation` (q,): the symbol that shows each label of the sequence.
    `first`: the cell at which the placing of objects begins; it changes no symbol.

    Raises `ArrayError` if the fold is not one, the window is not unique (it names one that is), the
    permutation is none, or `first` is no cell.
    """

    def __init__(
        self,
        sequence: Sequence,
        rows: int,
        columns: int,
        window: tuple[int, int] | None = None,
        *,
        permutation: Iterable[int] | None = None,
        first: tuple[int, int] = (0, 0),
    ) -> None:
        order, degree, period = sequence.field.order, sequence.degree, sequence.period
        if rows < 1 or rows * columns != period or gcd(rows, columns) != 1:
            names = ", ".join(f"{a}x{b}" for a, b in folds(order, degree)[:3])
            none = f"{period} has no coprime factors: take family prbs or prmvs, or another degree"
            raise ArrayError(
                f"{rows}x{columns} does not fold the {period} terms of degree {degree} over "
                f"GF({order}): rows and columns must be coprime with that product",
                fix=f"take {names}, or rows and columns exchanged" if names else none,
            )
        self.sequence = sequence
        self.rows, self.columns = rows, columns  #: n1, n2
        self.order = order  #: number of different symbols, q
        self.full_rank = degree  #: rank at which cells name their place, n
        self.row_step = columns * pow(columns, -1, rows) % period  #: e1: index of cell (1, 0)
        self.column_step = rows * pow(rows, -1, columns) % period  #: e2: index of cell (0, 1)
        ring = sequence.ring
        self._beta = Powers(ring, ring.power_of_x(self.row_step), rows)
        self._gamma = Powers(ring, ring.power_of_x(self.column_step), columns)
        self.window = self._smallest_window() if window is None else self._checked(window)
        shown = list(range(order)) if permutation is None else list(permutation)
        if sorted(shown) != list(range(order)):
            raise ArrayError(
                f"permutation {shown} does not show each of the {order} labels once",
                fix=f"give 0 to {order - 1} in any order, or leave permutation: out",
            )
        self.permutation: Labels = np.array(shown, dtype=np.int64)  #: (q,)
        self.permutation.setflags(write=False)
        self._label_of_symbol = np.append(np.argsort(self.permutation), -1)
        self.first = int(first[0]), int(first[1])  #: cell at which the placing of objects begins
        if not (0 <= self.first[0] < rows and 0 <= self.first[1] < columns):
            raise ArrayError(
                f"first: {list(self.first)} is no cell of an array of {rows}x{columns}",
                fix=f"give a row below {rows} and a column below {columns}, or leave first: out",
            )

    def __repr__(self) -> str:
        return f"FoldedArray({self.sequence!r}, {self.rows}x{self.columns})"

    @property
    def family(self) -> str:
        """One of prbs, prba, prmvs, prmva."""
        return ("prb" if self.order == 2 else "prmv") + ("s" if self.rows == 1 else "a")

    # --- cells -----------------------------------------------------------------------------

    def symbols(self, rows: ArrayLike, columns: ArrayLike) -> Labels:
        """Return the symbols at cells (rows, columns), broadcast together, on the torus."""
        return np.asarray(self.permutation[self._terms(rows, columns)])

    def terms_of(self, symbols: ArrayLike) -> Labels:
        """Return the sequence's labels that symbols (...) show; -1, not seen, stays."""
        return np.asarray(self._label_of_symbol[np.asarray(symbols)])

    def _terms(self, rows: ArrayLike, columns: ArrayLike) -> Labels:
        field = self.sequence.field
        r, in_row = _distinct_indices(rows, self.rows)
        c, in_column = _distinct_indices(columns, self.columns)
        maps = self.sequence.functionals(self._beta.at(r))  # (rows, m, D)
        elements = self._gamma.at(c)  # (columns, D)
        in_row, in_column = np.broadcast_arrays(in_row, in_column)
        if field.characteristic == 2:
            masks, words = pack_words(maps), pack_words(elements)[in_column]
            codes = np.zeros(in_row.shape, dtype=np.int64)
            for digit in range(field.degree):
                ones = np.bitwise_count(masks[in_row, digit] & words)
                codes |= (ones & np.uint8(1)).astype(np.int64) << digit
            return np.asarray(field.label_of_code[codes])
        row, column = in_row.ravel(), in_column.ravel()
        labels = np.empty(row.size, dtype=np.int64)
        for start in range(0, row.size, _CHUNK):
            part = slice(start, start + _CHUNK)
            sums = np.einsum("kmd,kd->km", maps[row[part]], elements[column[part]])
            labels[part] = field.labels(self.sequence.ring.reduced(sums))
        return labels.reshape(in_row.shape)

    def index(self, row: int, column: int) -> int:
        """Return the index t of a cell in the sequence."""
        return (int(row) * self.row_step + int(column) * self.column_step) % self.sequence.period

    def cell(self, index: int) -> tuple[int, int]:
        """Return the cell (row, column) of index t: (t mod n1, t mod n2)."""
        return int(index) % self.rows, int(index) % self.columns

    # --- what visible cells tell --------------------------------------------------------------

    def offsets(self, rows: ArrayLike, columns: ArrayLike) -> list[int]:
        """Return the index of each cell relative to cell (0, 0), flat, as Python integers."""
        r, c = np.broadcast_arrays(on_torus(rows, self.rows), on_torus(columns, self.columns))
        return [
            self.index(a, b) for a, b in zip(r.ravel().tolist(), c.ravel().tolist(), strict=True)
        ]

    def rank(self, rows: ArrayLike, columns: ArrayLike) -> int:
        """Return the rank over GF(q) of a set of visible cells."""
        offsets = self.offsets(rows, columns)
        return self.sequence.rank(offset - offsets[0] for offset in offsets)

    def identifies(self, rows: ArrayLike, columns: ArrayLike) -> bool:
        """Whether the cells together name their place: rank n."""
        return self.rank(rows, columns) == self.full_rank

    def minimum_distance(self, rows: ArrayLike, columns: ArrayLike) -> int:
        """Return the least number of these cells in which two places differ; 0: look alike."""
        distinct = list(dict.fromkeys(self.offsets(rows, columns)))
        return minimum_distance(self.sequence, distinct, [1] * len(distinct))

    # --- the window --------------------------------------------------------------------------

    def _window_rank(self, window: tuple[int, int]) -> int:
        return self.rank(np.arange(window[0])[:, None], np.arange(window[1]))

    def _smallest_window(self, at_least: tuple[int, int] = (1, 1)) -> tuple[int, int]:
        """Return the window of fewest cells, at most four times as long as wide: a compact patch.

        Of these the most square one, the higher one of two.
        """
        for cells in range(self.full_rank, 4 * self.full_rank**2 + 2):
            shapes = [(cells // b, b) for b in range(1, cells + 1) if cells % b == 0]
            for a, b in sorted(shapes, key=lambda s: (abs(s[0] - s[1]), s[1])):
                compact = max(a, b) <= 4 * min(a, b) or a == self.rows or b == self.columns
                fits = at_least[0] <= a <= self.rows and at_least[1] <= b <= self.columns
                if compact and fits and self._window_rank((a, b)) == self.full_rank:
                    return a, b
        return self.rows, self.columns

    def _checked(self, window: tuple[int, int]) -> tuple[int, int]:
        a, b = window
        if not (1 <= a <= self.rows and 1 <= b <= self.columns):
            raise ArrayError(
                f"a {a}x{b} window does not lie in an array of {self.rows}x{self.columns} cells",
                fix="take a window of at least 1x1 and at most the array",
            )
        rank = self._window_rank(window)
        if rank < self.full_rank:
            smallest, larger = self._smallest_window(), self._smallest_window(window)
            name = format_polynomial(self.sequence.field, self.sequence.polynomial)
            raise ArrayError(
                f"a {a}x{b} window of {name} on {self.rows}x{self.columns} has rank {rank} of "
                f"{self.full_rank}, so it occurs more than once",
                fix=f"take {smallest[0]}x{smallest[1]} or {larger[0]}x{larger[1]}",
            )
        return a, b

    def definition(self) -> dict[str, Any]:
        """Return the plain values (JSON) from which `array_from` makes this array again."""
        found: dict[str, Any] = {"family": self.family, **sequence_definition(self.sequence)}
        found |= {"rows": self.rows, "columns": self.columns, "window": list(self.window)}
        if (np.diff(self.permutation) != 1).any():
            found["permutation"] = self.permutation.tolist()
        if self.first != (0, 0):
            found["first"] = list(self.first)
        return found


def _distinct_indices(
    indices: ArrayLike, steps: int
) -> tuple[NDArray[np.uint64], NDArray[np.intp]]:
    on_cycle = on_torus(indices, steps)
    distinct, place = np.unique(on_cycle.ravel(), return_inverse=True)
    return distinct, place.reshape(on_cycle.shape)
