"""Which lattice squares of an embossing lie whole inside their facet, and their union's outline.

Lattice frame: the facet frame turned into the symbols' axes; mm. Corners are numbered by
their integer place, so neighbouring squares share them exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import foot_half_mm
from generator.plane.rings import boxes_inside
from generator.solid.emboss import turn
from generator.solid.part import Embossing
from generator.solid.settings import EMBOSS

Index = NDArray[np.int64]
Ring = NDArray[np.float64]


@dataclass(slots=True)
class Squares:
    """The full squares of one embossing."""

    full: NDArray[np.bool_]  #: (n,) which symbols have theirs
    corners: Index  #: (n, 4) numbers into `points`, counter-clockwise; -1 without a square
    points: Ring  #: (c, 2) lattice frame
    outline: list[Index]  #: loops of `points` around the union, the union to the right
    first: int = 0  #: mesh number of the first of `points`


def squares_of(embossing: Embossing, rings: Sequence[Ring]) -> Squares | None:
    """Return the full squares of an embossing, or None if it has none.

    Parameters
    ----------
    embossing
        Symbols of one facet.
    rings
        The facet's loops in the lattice frame.
    """
    pitch = embossing.pitch_mm
    if pitch <= 0 or not len(embossing.labels):
        return None
    centres = embossing.centres_mm @ turn(embossing.rotation_rad)
    cells = np.rint((centres - centres[0]) / pitch).astype(np.int64)
    on_lattice = (
        np.abs(centres - centres[0] - cells * pitch).max(axis=1) <= EMBOSS.on_lattice * pitch
    )
    halves = np.array([foot_half_mm(tiers) for tiers in embossing.tiers])
    full = on_lattice & (halves[embossing.labels] < pitch * (0.5 - EMBOSS.on_lattice))
    full &= boxes_inside(centres, pitch * (0.5 + EMBOSS.on_lattice), rings)
    cells -= cells.min(axis=0)
    stride = int(cells[:, 1].max()) + 2
    steps = np.array([0, stride, stride + 1, 1])  # lower left, lower right, upper right, upper left
    keys = (cells[:, 0] * stride + cells[:, 1])[:, None] + steps
    _, once = np.unique(keys[:, 0], return_index=True)
    full &= np.isin(np.arange(len(full)), once)
    _drop_pinches(full, keys)
    if not full.any():
        return None
    known, numbers = np.unique(keys[full], return_inverse=True)
    corners = np.full((len(full), 4), -1, dtype=np.int64)
    corners[full] = numbers.reshape(-1, 4)
    origin = centres[0] - pitch * np.rint((centres[0] - centres.min(axis=0)) / pitch)
    places = np.stack([known // stride, known % stride], axis=1)
    points = origin + (places - 0.5) * pitch
    return Squares(full, corners, points, _outline(corners[full], len(known)))


def _drop_pinches(full: NDArray[np.bool_], keys: Index) -> None:
    """Take squares away until no two of them touch in a corner alone."""
    while full.any():
        chosen = np.flatnonzero(full)
        known, numbers = np.unique(keys[chosen], return_inverse=True)
        # Sums of 1, 2, 4, 8: which quarters around a corner are covered, exact as floats.
        weights = np.tile([1.0, 2.0, 4.0, 8.0], len(chosen))
        quarters = np.bincount(numbers.ravel(), weights, len(known))
        pinched = (quarters == 5) | (quarters == 10)
        if not pinched.any():
            return
        # Of the two, the one that has the corner at its lower side goes.
        at = pinched[numbers.reshape(-1, 4)]
        full[chosen[at[:, 0] | at[:, 1]]] = False


def _outline(corners: Index, count: int) -> list[Index]:
    """Return the loops around a union of squares, with the squares to the right."""
    start = corners.ravel()
    end = np.roll(corners, -1, axis=1).ravel()
    border = ~np.isin(start * count + end, end * count + start)
    after = np.full(count, -1, dtype=np.int64)
    after[end[border]] = start[border]
    ahead = after.tolist()
    loops = []
    for first in np.flatnonzero(after >= 0).tolist():
        loop, at = [], first
        while ahead[at] >= 0:
            loop.append(at)
            ahead[at], at = -1, ahead[at]
        if loop:
            loops.append(np.array(loop, dtype=np.int64))
    return loops
