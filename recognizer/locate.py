"""Cells in view -> the places of the database that they can be. Thesis 6.3.

A `Fit` names cells (i, j) of a lattice; a place says which array cell (row, column) the cell
(0, 0) is, and which face holds the symbols: cell (i, j) is then (row - j, column + i) where
that face holds it, and shows no symbol where it does not. Its score is the sum of the
cells' log-likelihoods, none of them lower than a limit, so that a worn or wrong symbol costs
what it should and no more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.lab import Encoding
from recognizer.symbols.fit import Fit

Ints = NDArray[np.int64]
Array = NDArray[np.float64]

CAP = 8.0  #: nats that one cell can cost at most
WORN = 4.0  #: nats that a symbol costs that is registered but not felt at all
ANCHORS = 3  #: cells tried as the one that is surely registered


@dataclass(frozen=True, slots=True)
class Place:
    """One reading of a fit."""

    fit: int  #: which of the fits
    row: int  #: array row of lattice cell (0, 0), on the torus
    column: int
    face: int  #: number in `Encoding.faces`
    score: float  #: log-likelihood of the image, nats


def places(encoding: Encoding, fits: tuple[Fit, ...], keep: int) -> list[Place]:
    """Return the likeliest places over all fits, best first, at most `keep` of each fit."""
    found: list[Place] = []
    for number, fit in enumerate(fits):
        found += _places_of(encoding, fit, number, keep)
    return sorted(found, key=lambda place: -place.score)


def place_scores(encoding: Encoding, fit: Fit, place: Place) -> float:
    """Return the log-likelihood of the image if the fit lies at this place, nats."""
    scores = _worn(fit.scores)
    values = _values(
        encoding,
        fit,
        scores,
        np.array([place.row]),
        np.array([place.column]),
        np.array([place.face], np.int32),
    )
    return float(values[0]) + fit.value


def _worn(scores: Array) -> Array:
    """Return scores (m, q + 1) in which a registered symbol may be worn away, or read wrong."""
    symbols = np.maximum(scores[:, :-1], scores[:, -1:] - WORN)
    return np.asarray(np.maximum(np.concatenate([symbols, scores[:, -1:]], axis=1), -CAP))


def _places_of(encoding: Encoding, fit: Fit, number: int, keep: int) -> list[Place]:
    order = encoding.array.order
    scores = _worn(fit.scores)
    told = scores[:, :order].max(axis=1) - scores[:, order]  # a symbol rather than none
    anchors = np.argsort(-told, kind="stable")[:ANCHORS]
    best: dict[tuple[int, int, int], float] = {}
    for anchor in anchors[told[anchors] > 0]:
        rows, columns, owners = _candidates(encoding, fit, scores, int(anchor))
        values = _values(encoding, fit, scores, rows, columns, owners)
        for k in np.argsort(-values, kind="stable")[:keep]:
            key = (int(rows[k]), int(columns[k]), int(owners[k]))
            best[key] = float(values[k])
    ranked = sorted(best.items(), key=lambda item: (-item[1], item[0]))[:keep]
    return [Place(number, *key, value + fit.value) for key, value in ranked]


def _candidates(
    encoding: Encoding, fit: Fit, scores: Array, anchor: int
) -> tuple[Ints, Ints, NDArray[np.int32]]:
    """Return where (0, 0) can lie (rows, columns) if `anchor` is a registered cell, and whose."""
    array = encoding.array
    i, j = fit.cells[anchor].tolist()
    likely = scores[anchor, : array.order] > -CAP
    kept = np.flatnonzero(likely[encoding.labels[:-1]])
    rows, columns = np.divmod(encoding.keys[kept], np.uint64(array.columns))
    rows, columns = rows.astype(np.int64), columns.astype(np.int64)
    return (rows + j) % array.rows, (columns - i) % array.columns, encoding.owners[kept]


def _values(
    encoding: Encoding,
    fit: Fit,
    scores: Array,
    rows: Ints,
    columns: Ints,
    owners: NDArray[np.int32],
) -> Array:
    """Return the log-likelihood of each candidate, 0 if every cell is at its best."""
    array = encoding.array
    total = np.zeros(len(rows))
    for (i, j), cell in zip(fit.cells.tolist(), scores, strict=True):
        held_by, label = encoding.at((rows - j) % array.rows, (columns + i) % array.columns)
        total += cell[np.where(held_by == owners, label, array.order)]
    return total
