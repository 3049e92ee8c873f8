"""Rank the places of windows: one interface over the methods of maximum likelihood.

folded array, up to 2^18 places   `transform`, exact
folded array, more                `ordered`, near to it
product array                     `Joint`, exact: both factors together. Thesis 5.3, 5.5
with a prior                      `Places`, exact at any size
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from decoder.element import elements_of
from decoder.errors import MethodError, WindowError
from decoder.exact import conversion
from decoder.milestones import Table
from decoder.ordered import Ordered
from decoder.transform import LARGEST_TRANSFORM, Transform
from decoder.window import Scores, unrelated_score
from generator.array.contract import SymbolArray, on_torus
from generator.array.fold import FoldedArray
from generator.array.product import ProductArray
from generator.array.sequence import Sequence


@dataclass(frozen=True, slots=True)
class Ranked:
    """N windows, their K best places, best first."""

    rows: NDArray[np.uint64]  #: (N, K)
    columns: NDArray[np.uint64]  #: (N, K)
    values: NDArray[np.float64]  #: (N, K) log-likelihood, nats; -inf where there is none
    rest: NDArray[np.float64]  #: (N,) likelihood of all but the best, relative to it


def concatenate(parts: list[Ranked]) -> Ranked:
    """Return the windows of several batches as one."""
    fields = ("rows", "columns", "values", "rest")
    return Ranked(*(np.concatenate([getattr(part, f) for part in parts]) for f in fields))


def best_of(
    values: NDArray[np.float32], number: int
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """Return places, values (N, K) and rest (N,) of the K best of (N, P); spoils `values`."""
    lines = np.arange(len(values))
    if number <= 2:
        first = values.argmax(axis=1)
        high = values[lines, first].astype(np.float64)
        values[lines, first] = -np.inf
        second = values.argmax(axis=1)
        places = np.stack([first, second], axis=1)
        chosen = np.stack([high, values[lines, second].astype(np.float64)], axis=1)
        values -= high[:, None].astype(np.float32)
        np.exp(values, out=values)
        return places, chosen, values.sum(axis=1, dtype=np.float64)
    places = _highest(values, number)
    order = np.argsort(-np.take_along_axis(values, places, axis=1), axis=1, kind="stable")
    places = np.take_along_axis(places, order, axis=1)
    chosen = np.take_along_axis(values, places, axis=1).astype(np.float64)
    values[lines, places[:, 0]] = -np.inf
    values -= chosen[:, :1].astype(np.float32)
    np.exp(values, out=values)
    return places, chosen, values.sum(axis=1, dtype=np.float64)


def _highest(values: NDArray[np.float32], number: int) -> NDArray[np.intp]:
    """Return the places of the K highest of (N, P), K < P or all; unordered.

    They lie in the K blocks with the highest maxima.
    """
    windows, places = values.shape
    if number >= places:
        return np.tile(np.arange(places), (windows, 1))
    if places < 1 << 10:
        return np.argpartition(-values, number - 1, axis=1)[:, :number]
    size = 1 << (places.bit_length() // 2)
    starts = np.arange(0, places, size)
    high = np.maximum.reduceat(values, starts, axis=1)
    blocks = starts[_highest(high, number)]
    inside = (blocks[..., None] + np.arange(size)).reshape(windows, -1)
    found = np.take_along_axis(values, inside.clip(max=places - 1), axis=1)
    found[inside >= places] = -np.inf
    kept = np.argpartition(-found, number - 1, axis=1)[:, :number]
    return np.take_along_axis(inside, kept, axis=1)


def best_of_all(parts: list[Ranked], number: int) -> tuple[Ranked, NDArray[np.uint8]]:
    """Return the K best of several hypotheses (rotations), and which each came from, (N, K)."""
    rows = np.concatenate([part.rows for part in parts], axis=1)
    columns = np.concatenate([part.columns for part in parts], axis=1)
    values = np.concatenate([part.values for part in parts], axis=1)
    source = np.repeat(np.arange(len(parts)), [part.rows.shape[1] for part in parts])
    order = np.argsort(-values, axis=1, kind="stable")[:, :number]
    best = values.max(axis=1)
    with np.errstate(invalid="ignore"):
        rest = sum(np.exp(part.values[:, 0] - best) * (1 + part.rest) for part in parts) - 1
    best_places = Ranked(
        np.take_along_axis(rows, order, axis=1),
        np.take_along_axis(columns, order, axis=1),
        np.take_along_axis(values, order, axis=1),
        np.maximum(rest, 0.0),
    )
    return best_places, source[order].astype(np.uint8)


MOST_PLACES = 1 << 20
_CODEBOOK = 1 << 27  #: entries: cells times symbols times places, 0.5 GB


class Places:
    """Candidate places of windows of one shape; `prior` (P, 2) rows and columns, P >= 1."""

    def __init__(self, array: SymbolArray, shape: tuple[int, int], prior: ArrayLike) -> None:
        given = np.asarray(prior)
        if given.ndim != 2 or given.shape[1] != 2 or not 1 <= len(given) <= MOST_PLACES:
            raise WindowError(
                f"a prior is an array of (row, column) pairs, 1 to {MOST_PLACES} of them, not of "
                f"shape {given.shape}",
                fix="give np.stack([rows, columns], axis=1) of the registered cells",
            )
        if len(given) * shape[0] * shape[1] * array.order > _CODEBOOK:
            raise WindowError(
                f"{len(given)} candidates for a {shape[0]}x{shape[1]} window are too many",
                fix="leave the prior out, or give fewer places",
            )
        unique = np.unique(
            np.stack(
                [on_torus(given[:, 0], array.rows), on_torus(given[:, 1], array.columns)], axis=1
            ),
            axis=0,
        )
        self.rows, self.columns = unique[:, 0], unique[:, 1]
        self.size = self.work = len(unique)  #: candidates, and numbers held for each window
        a, b = np.indices(shape).reshape(2, -1).astype(np.uint64)
        labels = array.symbols(
            _shift_places(self.rows, a, array.rows), _shift_places(self.columns, b, array.columns)
        )
        every = labels[..., None] == np.arange(array.order)
        self._codebook = every.reshape(len(unique), -1).T.astype(np.float32)

    def rank(self, scores: Scores, number: int) -> Ranked:
        """Return the best places of scores (N, k, q)."""
        values = scores.reshape(len(scores), -1) @ self._codebook
        places, chosen, rest = best_of(values, number)
        return Ranked(self.rows[places], self.columns[places], chosen, rest)


def _shift_places(
    places: NDArray[np.uint64], steps: NDArray[np.uint64], cycle: int
) -> NDArray[np.uint64]:
    """Return (P, k) places + steps on a cycle of up to 2^64, without overflow."""
    steps = steps % np.uint64(cycle)
    room = np.uint64(cycle) - steps
    return np.where(places[:, None] >= room, places[:, None] - room, places[:, None] + steps)


NEGLIGIBLE = 30.0  #: nats below the best: no weight left in a sum (e^-30 = 1e-13)
LARGEST_FACTOR = 1 << 16  #: terms of one sequence
_PAIRS = 1 << 18  #: pairs that are looked at together


class Joint:
    """All places of a product array, for windows of one shape.

    S(i, j) = sum over cells (a, b) of L_ab(law(SR[i + a], SC[j + b])): summed over a for every i
    first, then over b for every j. Where all pairs are too many, rows are taken in falling order
    of an upper bound of their best pair, until no other row can be listed or weigh: still exact.
    """

    def __init__(self, array: ProductArray, shape: tuple[int, int]) -> None:
        if max(array.rows, array.columns) > LARGEST_FACTOR:
            raise MethodError(
                f"maximum likelihood on {array.rows}x{array.columns} places of a product array "
                f"is limited to {LARGEST_FACTOR} rows and columns",
                fix="give a prior, the cells that are registered, or take method logarithm",
            )
        self.size = array.rows * array.columns
        self.work = min(self.size, _PAIRS)
        self._law = array.law
        self._columns = array.columns
        self._shape = shape
        self._in_rows = _terms(array.row_sequence, shape[0])  # (a qr, rows)
        self._in_columns = _terms(array.column_sequence, shape[1])  # (b qc, columns)

    def rank(self, scores: Scores, number: int) -> Ranked:
        """Return the best places of scores (N, k, q)."""
        if self.size > _PAIRS:
            return concatenate([self._searched(window, number) for window in scores])
        by_row = self._by_row(scores)
        values = np.matmul(by_row, self._in_columns).reshape(len(scores), -1)
        return self._ranked(*best_of(values, number))

    def _by_row(self, scores: Scores) -> NDArray[np.float32]:
        """Return (N, rows, b qc): scores of each column's term, if the window is in row i."""
        (a, b), (qr, qc) = self._shape, self._law.shape
        parts = scores.reshape(-1, a, b, qr * qc)[..., self._law]  # (N, a, b, qr, qc)
        columns = parts.transpose(0, 2, 4, 1, 3).reshape(-1, b * qc, a * qr)
        return np.asarray(np.matmul(columns, self._in_rows).transpose(0, 2, 1))

    def _searched(self, window: Scores, number: int) -> Ranked:
        by_row = self._by_row(window[None])[0]
        bounds = by_row.reshape(len(by_row), self._shape[1], -1).max(axis=2).sum(axis=1)
        order = np.argsort(-bounds, kind="stable")
        block = max(1, _PAIRS // self._columns)
        best: Ranked | None = None
        for start in range(0, len(order), block):
            rows = order[start : start + block]
            if best is not None and best.values.shape[1] >= number:
                negligible = best.values[0, 0] - NEGLIGIBLE
                if bounds[rows[0]] < min(best.values[0, -1], negligible):
                    break
            values = (by_row[rows] @ self._in_columns).reshape(1, -1)
            places, chosen, rest = best_of(values, number)
            places = rows[places // self._columns] * self._columns + places % self._columns
            found = self._ranked(places, chosen, rest)
            best = found if best is None else best_of_all([best, found], number)[0]
        assert best is not None
        return best

    def _ranked(
        self, places: NDArray[np.intp], chosen: NDArray[np.float64], rest: NDArray[np.float64]
    ) -> Ranked:
        rows, columns = np.divmod(places.astype(np.uint64), np.uint64(self._columns))
        return Ranked(rows, columns, chosen, rest)


def _terms(sequence: Sequence, length: int) -> NDArray[np.float32]:
    """Return (length q, N): whether the term after k steps from place i is y."""
    terms = sequence.symbols(np.arange(sequence.period + length))
    windows = np.lib.stride_tricks.sliding_window_view(terms, length)[: sequence.period]
    every = windows[..., None] == np.arange(sequence.field.order)
    return np.asarray(every.reshape(sequence.period, -1).T, dtype=np.float32)


class AllPlaces:
    """Folded arrays: the transform, or ordered statistics where it is too large."""

    def __init__(self, array: FoldedArray, shape: tuple[int, int]) -> None:
        offsets = array.offsets(*np.indices(shape))
        self.size = array.sequence.period
        self._array = array
        small = self.size < LARGEST_TRANSFORM
        self.work = self.size if small else len(offsets) << 6
        self._method = (Transform if small else Ordered)(array.sequence, offsets)

    def rank(self, scores: Scores, number: int) -> Ranked:
        """Return the best places of scores (N, k, q)."""
        method = self._method
        scores = np.take(scores, self._array.permutation, axis=2)  # of terms, no more of symbols
        if isinstance(method, Transform):
            places, values, rest = best_of(method.values(scores), number)
            table = conversion(self._array.sequence, "table")
            assert isinstance(table, Table)
            t = table.index[places].astype(np.uint64)
        else:
            keys, values, rest = method.rank_keys(scores, number)
            elements = elements_of(self._array.sequence.ring)
            logarithm = conversion(self._array.sequence, "logarithm")
            found = np.flatnonzero(np.isfinite(values.ravel()))
            unseen = np.log(self.size) + unrelated_score(scores) - values[:, 0]
            rest += np.exp(unseen.clip(max=100.0))  # the places that were not tried
            t = np.zeros(values.shape, dtype=np.uint64)
            t.ravel()[found] = logarithm.convert(elements.of_keys(keys.ravel()[found]))
        return Ranked(
            t % np.uint64(self._array.rows), t % np.uint64(self._array.columns), values, rest
        )


Ranking = Places | Joint | AllPlaces


@lru_cache(maxsize=32)
def ranking_of(array: FoldedArray | ProductArray, shape: tuple[int, int]) -> Ranking:
    """Return what weighs all places of an array, the same object for the same arguments."""
    if isinstance(array, ProductArray):
        return Joint(array, shape)
    return AllPlaces(array, shape)
