"""Symbols -> the grid that they stand on, and the window of labels. Thesis 6.1, figure 6.8.

The place and axes of a symbol predict its four neighbours. A symbol within a threshold of a
predicted place, with about the same axes, joins the grid, the best if there are several, and its
neighbours are predicted in turn. Components of ink that are no symbols stay out. When nothing joins
any more, the lattice is fitted to all members, and symbols beyond a gap join if they lie at its
cells. The grid may begin at any symbol; the largest one counts.

Image frame and lattice frame: mm; cell (i, j) is the i-th column and the j-th row upwards, as
in `symbols.fit`; an image point s lies at R(theta) s + (x, y) of the lattice.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.thesis.symbols import Symbol

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Cell = tuple[int, int]

SIDES: tuple[Cell, ...] = ((1, 0), (0, 1), (-1, 0), (0, -1))

OFF = 0.25  #: pitches from the predicted place
TURN_RAD = math.radians(25)  #: of a symbol's axes against the grid's
GAP = 3.5  #: cells from the nearest member, beyond which the lattice predicts nothing
PLACE_MM = 0.2  #: least standard deviation of a symbol's place
AXES_RAD = math.radians(4)  #: standard deviation of its axes


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Symbols in their cells."""

    window: Ints  #: (rows, columns) labels, -1 for none; row 0 is the uppermost
    first: Cell  #: cell (i, j) of the window's upper left corner
    members: Ints  #: (m,) which of the symbols
    cells: Ints  #: (m, 2) i and j of each
    x_mm: float
    y_mm: float
    theta_rad: float
    off_mm: float  #: rms distance of the members from their cells' centres
    covariance: Array  #: (3, 3) of x, y and theta at the image's origin


def grid(found: Sequence[Symbol], pitch_mm: float) -> Grid | None:
    """Return the largest grid among symbols that are not rejected; None if there is none."""
    named = [k for k, symbol in enumerate(found) if symbol.label >= 0]
    best: dict[Cell, int] = {}
    left = set(named)
    for seed in sorted(named, key=lambda k: found[k].off_mm):
        if seed in left and len(left) > len(best):
            members = _grow_grid(found, seed, named, pitch_mm)
            left -= set(members.values())
            best = members if len(members) > len(best) else best
    return _grid_of(found, best, pitch_mm) if best else None


@dataclass(frozen=True, slots=True)
class _Lattice:
    """Cell centre c (complex, mm) lies at place (c - shift) / turn of the image."""

    turn: complex
    shift: complex
    spread: float  # sum of squared distances of the members from their middle, mm^2
    middle: complex  # of the members, image frame

    def place(self, cell: Cell, pitch_mm: float) -> complex:
        return (_centre(cell, pitch_mm) - self.shift) / self.turn


def _grow_grid(
    found: Sequence[Symbol], seed: int, named: list[int], pitch_mm: float
) -> dict[Cell, int]:
    members: dict[Cell, int] = {(0, 0): seed}
    free = {k for k in named if k != seed}
    waiting: list[Cell] = [(0, 0)]
    while waiting:
        i, j = waiting.pop(0)
        symbol = found[members[i, j]]
        # the axes of its neighbours in the grid are better known than a symbol's own
        around = {c: k for c, k in members.items() if max(abs(c[0] - i), abs(c[1] - j)) <= 2}
        turn = _lattice(found, around, pitch_mm).turn
        for di, dj in SIDES:
            cell = (i + di, j + dj)
            predicted = complex(symbol.x_mm, symbol.y_mm) + complex(di, dj) * pitch_mm / turn
            if cell not in members:
                accepted = _accept_symbol(found, free, predicted, turn, pitch_mm)
                if accepted is not None:
                    members[cell] = accepted
                    free.discard(accepted)
                    waiting.append(cell)
    return _join_beyond_gaps(found, members, free, pitch_mm)


def _join_beyond_gaps(
    found: Sequence[Symbol], members: dict[Cell, int], free: set[int], pitch_mm: float
) -> dict[Cell, int]:
    """Return members with symbols beyond gaps that lie at cells of the whole lattice."""
    while len(members) > 1:
        lattice = _lattice(found, members, pitch_mm)
        predicted: set[Cell] = set()
        for k in free:
            at = lattice.turn * complex(found[k].x_mm, found[k].y_mm) + lattice.shift
            cell = (math.floor(at.real / pitch_mm), math.floor(at.imag / pitch_mm))
            near = min(math.dist(cell, member) for member in members)
            if cell not in members and near <= GAP:
                predicted.add(cell)
        more = {}
        for cell in sorted(predicted):
            place = lattice.place(cell, pitch_mm)
            accepted = _accept_symbol(found, free, place, lattice.turn, pitch_mm)
            if accepted is not None:
                more[cell] = accepted
                free.discard(accepted)
        if not more:
            return members
        members = members | more
    return members


def _accept_symbol(
    found: Sequence[Symbol], free: set[int], predicted: complex, turn: complex, pitch_mm: float
) -> int | None:
    """Return the symbol that fits an expectation best, if one does."""
    fits = [
        (abs(complex(found[k].x_mm, found[k].y_mm) - predicted), k)
        for k in free
        if abs(cmath.phase(cmath.exp(1j * found[k].theta_rad) * turn)) <= TURN_RAD
    ]
    off, best = min(fits, default=(math.inf, -1))
    return best if off <= OFF * pitch_mm else None


def _lattice(found: Sequence[Symbol], members: dict[Cell, int], pitch_mm: float) -> _Lattice:
    """Return the lattice through members by least squares, from their places and their axes.

    A symbol's centre follows from the middle of its ink by the common axes of all symbols, which
    are more precise than its own.
    """
    cells = np.array([_centre(cell, pitch_mm) for cell in members])
    axes = np.array([cmath.exp(-1j * found[k].theta_rad) for k in members.values()])
    ink = np.array([complex(*found[k].middle_mm) for k in members.values()])
    own = np.array([complex(found[k].x_mm, found[k].y_mm) for k in members.values()]) - ink
    turn = complex(axes.sum())
    for _ in range(2):
        at = ink + own * axes / turn * abs(turn)
        middle = complex(at.mean())
        by_place = complex(((at - middle).conj() * (cells - cells.mean())).sum())
        turn = by_place / PLACE_MM**2 + complex(axes.sum()) / AXES_RAD**2
    turn /= abs(turn)
    spread = float((abs(at - middle) ** 2).sum())
    return _Lattice(turn, complex(cells.mean()) - turn * middle, spread, middle)


def _grid_of(found: Sequence[Symbol], members: dict[Cell, int], pitch_mm: float) -> Grid:
    lattice = _lattice(found, members, pitch_mm)
    cells = np.array(list(members), np.int64)
    numbers = np.array(list(members.values()), np.int64)
    low, high = cells.min(axis=0), cells.max(axis=0)
    window = np.full((high[1] - low[1] + 1, high[0] - low[0] + 1), -1, np.int64)
    window[high[1] - cells[:, 1], cells[:, 0] - low[0]] = [found[k].label for k in numbers]
    away = [
        abs(lattice.place(cell, pitch_mm) - complex(found[k].x_mm, found[k].y_mm))
        for cell, k in members.items()
    ]
    off, number = math.sqrt(sum(a * a for a in away) / len(away)), len(away)
    variance = max(PLACE_MM, off / math.sqrt(2)) ** 2
    turning = 1 / (lattice.spread / variance + number / AXES_RAD**2)
    lever = -lattice.turn * lattice.middle  # the image's origin from the middle, lattice frame
    by_turn = np.array([-lever.imag, lever.real, 1.0])
    return Grid(
        window=window,
        first=(int(low[0]), int(high[1])),
        members=numbers,
        cells=cells,
        x_mm=lattice.shift.real,
        y_mm=lattice.shift.imag,
        theta_rad=cmath.phase(lattice.turn),
        off_mm=off,
        covariance=np.diag([variance / number, variance / number, 0.0])
        + turning * np.outer(by_turn, by_turn),
    )


def _centre(cell: Cell, pitch_mm: float) -> complex:
    return complex(cell[0] + 0.5, cell[1] + 0.5) * pitch_mm
