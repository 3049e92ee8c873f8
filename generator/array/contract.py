"""What every array offers, whatever its family: the contract of `generator.array`.

Array frame: cell (row, column), zero-based, toroidal. A symbol's x axis points
along columns, its y axis against rows: with pitch p (mm) cell (r, c) has its
centre at ((c + 1/2) p, -(r + 1/2) p). Thesis 5.2 to 5.5.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Labels = NDArray[np.int64]


class SymbolArray(Protocol):
    """A toroidal array of symbols in which every small window occurs once."""

    @property
    def rows(self) -> int:
        """Number of rows; a Python integer, up to 2^63."""
        ...

    @property
    def columns(self) -> int:
        """Number of columns."""
        ...

    @property
    def order(self) -> int:
        """Number of different symbols; labels are 0 ... order - 1."""
        ...

    @property
    def window(self) -> tuple[int, int]:
        """Rows and columns of the window that is known to be unique."""
        ...

    @property
    def first(self) -> tuple[int, int]:
        """Row and column at which the placing of objects begins."""
        ...

    def symbols(self, rows: ArrayLike, columns: ArrayLike) -> Labels:
        """Return the labels at cells (rows, columns), broadcast together, taken on the torus.

        Nothing is materialised beyond what the cells need; integers of any size
        are accepted (object arrays beyond 2^63).
        """
        ...

    def rank(self, rows: ArrayLike, columns: ArrayLike) -> int:
        """Return the rank of a set of visible cells; only their differences matter."""
        ...

    @property
    def full_rank(self) -> int:
        """Rank at which a set of visible cells names its place."""
        ...

    def identifies(self, rows: ArrayLike, columns: ArrayLike) -> bool:
        """Whether the cells together name their place: the rank test."""
        ...

    def minimum_distance(self, rows: ArrayLike, columns: ArrayLike) -> int:
        """Return in how many of these cells two places differ at least; 0 if some look alike."""
        ...

    def definition(self) -> dict[str, Any]:
        """Return the plain values (JSON) from which `array_from` makes this array again."""
        ...
