"""Rivals of what a sensor sees: places of an array that differ in 0, 1 or 2 visible cells.

Array + sets of visible cells -> share of poses that have a rival, and rivals a pose.

What k cells show at all places is a linear code over GF(q), and what two places show differs by
what the difference of their states shows. So a place has as many rivals at distance d as there
are states, not 0, that show d symbols which are not 0 (but for the one state whose sum with the
place is 0, which is no place). Words of weight 1 and 2 are read off the reduced echelon form of
the code's generator: rows of weight 1 and 2, and pairs of rows that are proportional outside
their pivots. No place is listed, so arrays may have any size.

F. J. MacWilliams, N. J. A. Sloane, The Theory of Error-Correcting Codes, chapter 1. Thesis 5.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.array.field import Field, Labels
from generator.array.fold import FoldedArray
from reference.visible import VisibleSet


@dataclass(frozen=True, slots=True)
class RivalShares:
    """What a sensor meets on a full array, over the poses of some sets of visible cells."""

    cells: float  #: seen whole, mean
    short: float  #: share of poses whose cells have a lower rank than that many cells could
    poses: tuple[float, float, float]  #: share with a rival at distance 0, at most 1, at most 2
    rivals: tuple[float, float, float]  #: how many of them, mean


def rival_shares(array: FoldedArray, sets: Sequence[VisibleSet]) -> RivalShares:
    """Return how often what is seen whole has a rival elsewhere on a full array."""
    extent = 1 + np.max([one.cells.max(axis=0, initial=0) for one in sets], axis=0)
    offsets = array.offsets(np.arange(extent[0])[:, None], np.arange(extent[1]))
    cells = array.sequence.coefficients(offsets).reshape(*extent, -1)  # what each shows of a state
    gf = array.sequence.field
    degree = cells.shape[2]
    share = np.array([one.share for one in sets])
    number = np.array([len(one.cells) for one in sets])
    matrices = np.zeros((len(sets), degree, max(1, *number)), dtype=np.int64)
    for matrix, one in zip(matrices, sets, strict=True):
        matrix[:, : len(one.cells)] = cells[one.cells[:, 0], one.cells[:, 1]].T
    rank, words = _light_words(gf, matrices)
    unseen = float(gf.order) ** (degree - rank)  # states that show nothing
    rivals = np.cumsum(words, axis=1) * unseen[:, None] - 1
    poses, mean = share @ (rivals > 0), share @ rivals
    return RivalShares(
        float(share @ number),
        float(share @ (rank < np.minimum(number, degree))),
        (float(poses[0]), float(poses[1]), float(poses[2])),
        (float(mean[0]), float(mean[1]), float(mean[2])),
    )


def _reduced_rows(gf: Field, matrices: Labels) -> tuple[Labels, NDArray[np.bool_]]:
    """Return reduced row echelon forms (B, n, k) over GF(q), and which rows (B, n) have a pivot.

    Rows are unsorted; every pivot is 1 and alone in its column, rows without one are 0.
    """
    rows = matrices.astype(np.int64)
    used = np.zeros(rows.shape[:2], dtype=bool)
    every = np.arange(len(rows))
    for column in range(rows.shape[2]):
        pivots = (rows[:, :, column] != 0) & ~used
        at = every[pivots.any(axis=1)]
        if not at.size:
            continue
        row = pivots[at].argmax(axis=1)
        top = rows[at, row]
        top = gf.multiplication[top, gf.inverse[top[:, column]][:, None]]
        factors = gf.negative[rows[at, :, column]]
        rows[at] = gf.addition[rows[at], gf.multiplication[factors[:, :, None], top[:, None]]]
        rows[at, row] = top
        used[at, row] = True
    return rows, used


def _light_words(gf: Field, matrices: Labels) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rank (B,) of generators (B, n, k), and how many words (B, 3) weigh 0, 1 and 2."""
    rows, used = _reduced_rows(gf, matrices)
    weight = (rows != 0).sum(axis=2) - 1  # outside the pivot
    alone = ((weight == 0) & used).sum(axis=1)
    lead = np.take_along_axis(rows, _second(rows)[:, :, None], axis=2)
    scaled = gf.multiplication[rows, gf.inverse[lead]]
    first = (rows != 0).argmax(axis=2)
    np.put_along_axis(scaled, first[:, :, None], 0, axis=2)  # the pivot
    many = used & (weight > 0)
    pairs = np.zeros(len(rows), dtype=np.int64)
    for k in range(1, rows.shape[1]):
        alike = (scaled[:, k:] == scaled[:, :-k]).all(axis=2)
        pairs += (alike & many[:, k:] & many[:, :-k]).sum(axis=1)
    units = gf.order - 1
    two = units * (((weight == 1) & used).sum(axis=1) + pairs)
    two += units**2 * alone * (alone - 1) // 2
    words = np.stack([np.ones_like(two), units * alone, two], axis=1)
    return used.sum(axis=1), words


def _second(rows: Labels) -> NDArray[np.intp]:
    """Return the column of the second label that is not 0, or 0: the first is the pivot."""
    return np.asarray(((rows != 0).cumsum(axis=2) == 2).argmax(axis=2))
