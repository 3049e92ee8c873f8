"""Symbols on a lattice: which cell lies under a point, and which label stands in it.

A point (x, y) of the face frame lies in the array plane, from the upper left corner of the
anchor cell, at

    u = x cos(rotation) - y sin(rotation) + x_mm
    v = x sin(rotation) + y cos(rotation) + y_mm

and the cell in column c and row r, counted from the anchor, has its centre at
u = (c + 1/2) p, v = -(r + 1/2) p. Cost is per point, not per symbol. Thesis 5.5, 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import SurfaceError
from probe.surface.template import HeightTemplate

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Rows (n,) and columns (n,), counted from the anchor -> labels (n,), -1 for no symbol.
LabelAt = Callable[[Index, Index], Index]


@dataclass(frozen=True, eq=False)
class LatticeSurface:
    """Where symbols stand on a plane."""

    template: HeightTemplate
    label_at: LabelAt
    rotation_rad: float = 0.0  #: turns the face's x into the array's (columns)
    x_mm: float = 0.0
    y_mm: float = 0.0

    @property
    def top_mm(self) -> float:
        """Height of the symbols."""
        return self.template.symbols.relief.height_mm

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height over the face at points (n, 2), face frame; 0 between symbols."""
        turn, shift = self._to_cells
        at = points_mm @ turn
        at += shift
        cells = np.floor(at)
        at -= cells
        # Just below a whole number the rest may round up to 1.
        np.minimum(at, _BELOW_ONE, out=at)
        columns, rows = cells.astype(np.int64).T
        return self.template.heights_mm(self.label_at(rows, columns), at[:, 0], at[:, 1])

    @cached_property
    def _to_cells(self) -> tuple[Array, Array]:
        """Return what takes face points to columns and rows: matrix (2, 2) and shift (2,)."""
        c, s, p = math.cos(self.rotation_rad), math.sin(self.rotation_rad), self.template.pitch_mm
        turn = np.array([[c, -s], [-s, -c]]) / p
        return turn, np.array([self.x_mm, -self.y_mm]) / p


_BELOW_ONE = np.nextafter(1.0, 0.0)


def list_lookup(rows: ArrayLike, columns: ArrayLike, labels: ArrayLike) -> LabelAt:
    """Return the look-up of a finite list of symbols; every other cell is empty.

    Parameters
    ----------
    rows, columns
        (n,) cells, counted from the anchor, not wrapped.
    labels
        (n,) labels.

    Raises
    ------
    SurfaceError
        When two symbols share a cell, or cells lie too far apart to belong to one face.
    """
    r, c, q = (np.asarray(values, dtype=np.int64) for values in (rows, columns, labels))
    if not len(r):
        return _empty
    first = np.array([r.min(), c.min()])
    size = np.array([r.max(), c.max()]) - first + 1
    if size.prod() > 1 << 26:
        raise SurfaceError(
            f"symbols spread over {size[0]} x {size[1]} cells", fix="give the cells of one face"
        )
    # A border of empty cells answers for everything beyond.
    grid = np.full(size + 2, -1, dtype=np.int64)
    grid[r - first[0] + 1, c - first[1] + 1] = q
    if np.count_nonzero(grid >= 0) != len(r):
        raise SurfaceError("two symbols share a cell", fix="give every cell once, labels from 0")
    (last_row, last_column), width = size + 1, int(size[1]) + 2

    def label_at(rows: Index, columns: Index) -> Index:
        i = np.clip(rows - (first[0] - 1), 0, last_row)
        j = np.clip(columns - (first[1] - 1), 0, last_column)
        i *= width
        i += j
        found: Index = grid.ravel().take(i)
        return found

    return label_at


def tile_lookup(labels: ArrayLike) -> LabelAt:
    """Return the look-up of an array (rows, columns) that repeats in both directions."""
    grid = np.array(labels, dtype=np.int64)
    height, width = grid.shape

    def label_at(rows: Index, columns: Index) -> Index:
        found: Index = grid.ravel().take((rows % height) * width + columns % width)
        return found

    return label_at


def call_lookup(label: Callable[[Index, Index], ArrayLike]) -> LabelAt:
    """Return the look-up of an array that is a function; it is asked once for each cell in view.

    Parameters
    ----------
    label
        Rows (n,) and columns (n,) -> labels (n,).
    """

    def label_at(rows: Index, columns: Index) -> Index:
        if not len(rows):
            return np.zeros(0, dtype=np.int64)
        r, c = int(rows.min()), int(columns.min())
        height, width = int(rows.max()) - r + 1, int(columns.max()) - c + 1
        if height * width > len(rows):  # far apart: fewer points than cells between them
            return np.asarray(label(rows, columns), dtype=np.int64)
        i, j = np.divmod(np.arange(height * width), width)
        grid = np.asarray(label(i + r, j + c), dtype=np.int64)
        found: Index = grid.take((rows - r) * width + (columns - c))
        return found

    return label_at


def _empty(rows: Index, _columns: Index) -> Index:
    return np.full(len(rows), -1, dtype=np.int64)
