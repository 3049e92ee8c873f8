"""What every array offers, whatever its family, and how many touches name a place on it.

Array frame: cell (row, column), zero-based, toroidal. A symbol's x axis points along columns, its
y axis against rows: with pitch p (mm) cell (r, c) has its centre at ((c + 1/2) p, -(r + 1/2) p).
Thesis 5.2 to 5.5.

An answer needs ln N nats to name one of N cells, and `CERTAINTY` more by which no other place
may come near. A cell that is seen says up to ln(q + 1) nats: one of q symbols, or none. A scan
of n touches in a line sees (w + (n - 1) s) w of the surface, w the sensor's width, s its step.
Thesis 4.3, 6.3.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.errors import ArrayError

Labels = NDArray[np.int64]


class SymbolArray(Protocol):
    """A toroidal array of symbols in which every small window occurs once."""

    rows: int  #: up to 2^64, a Python integer
    columns: int
    order: int  #: number of different symbols; labels are 0 ... order - 1
    window: tuple[int, int]  #: rows and columns of a window that is known to be unique
    first: tuple[int, int]  #: row and column at which the placing of objects begins
    full_rank: int  #: rank at which a set of visible cells names its place

    def symbols(self, rows: ArrayLike, columns: ArrayLike) -> Labels:
        """Return the labels at cells (rows, columns), broadcast together, taken on the torus.

        Integers of any size are accepted (object arrays beyond 2^63); nothing else is materialised.
        """

    def rank(self, rows: ArrayLike, columns: ArrayLike) -> int:
        """Return the rank of a set of visible cells; only their differences matter."""

    def identifies(self, rows: ArrayLike, columns: ArrayLike) -> bool:
        """Whether the cells together name their place: the rank test."""

    def minimum_distance(self, rows: ArrayLike, columns: ArrayLike) -> int:
        """Return in how many of these cells two places differ at least; 0 if some look alike."""

    def definition(self) -> dict[str, Any]:
        """Return the plain values (JSON) from which `array_from` makes this array again."""


def on_torus(indices: ArrayLike, steps: int) -> NDArray[np.uint64]:
    """Return integers of any size and shape modulo `steps` (1 to 2^64).

    Raises `ArrayError` if an index is not an integer.
    """
    given: NDArray[Any] = np.asarray(indices)
    if given.size == 0:
        return np.zeros(given.shape, dtype=np.uint64)
    if given.dtype.kind == "f" and not isinstance(indices, np.ndarray):
        given = np.asarray(indices, dtype=object)  # mixed sizes of Python integers
    if given.dtype.kind == "i" and steps <= 2**63 - 1:
        return np.mod(given.astype(np.int64), steps).astype(np.uint64)
    if given.dtype.kind == "u" and steps <= 2**64 - 1:
        return np.mod(given.astype(np.uint64), np.uint64(steps))
    whole = given.ravel().tolist()
    if given.dtype.kind not in "iuO" or not all(
        isinstance(index, int | np.integer) and not isinstance(index, bool) for index in whole
    ):
        raise ArrayError(
            f"a place on the array is a pair of integers, not of {given.dtype}",
            fix="round rows and columns to integers",
        )
    exact = [int(index) % steps for index in whole]
    return np.array(exact, dtype=np.uint64).reshape(given.shape)


SENSOR_MM = 25.4  #: width of 16 tactels of 1.5875 mm
STEP_SHARE = 0.2656  #: of the width, from touch to touch: 4.25 of 16 tactels, as scans are laid
CERTAINTY = 13.0  #: nats: the reader's margin and its surprise
#: Of what cells could say, that scans need to have seen: symbols cut by a face's or a sensor's
#: edge say less, but neighbouring cells of a window exclude each other. Simulated scans answered
#: first after 3-6 touches as a median and 3-12 at 95 % (`thesis`, 8 by this), 2 and 4
#: (`product` at 15 mm, 5 by this).
SEEN = 0.65
FELT_MM = 0.6  #: by which a symbol's centre lies inside the sensor to say what it is, about
REGISTERED = 1 << 16  #: cells that a lab's objects hold at most; arrays may be far larger


def touches_needed(order: int, cells: int, pitch_mm: float, *, sensor_mm: float = SENSOR_MM) -> int:
    """Return about how many overlapping touches an answer needs; 1: no scan.

    >>> touches_needed(2, 63 * 65, 12.0), touches_needed(4, 63 * 65, 7.0)
    (8, 1)
    """
    nats = math.log(max(min(cells, REGISTERED), 2)) + CERTAINTY
    seen = SEEN * nats / math.log(order + 1)
    length_mm = seen * pitch_mm**2 / sensor_mm
    return 1 + max(0, math.ceil((length_mm / sensor_mm - 1) / STEP_SHARE - 0.25))


def symbols_seen(pitch_mm: float) -> float:
    """Return how many symbols have their centre under the sensor, a mean over a face's places."""
    return float(((SENSOR_MM - 2 * FELT_MM) / pitch_mm) ** 2)
