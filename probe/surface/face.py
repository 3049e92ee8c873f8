"""A flat face of an object, with symbols on a lattice, and the surface beyond its edges.

Outline + lattice + surroundings -> `FaceSurface` in the face frame. Inside the outline the face
is the plane z = 0 with symbols on it; outside, the neighbouring faces fall away (or rise,
at a reflex edge), given as a surface of their own. Thesis 5.5, 6.3.

A point (x, y) of the face frame lies in the array plane, from the upper left corner of the
anchor cell, at

    u = x cos(rotation) - y sin(rotation) + x_mm
    v = x sin(rotation) + y cos(rotation) + y_mm

and the cell in column c and row r, counted from the anchor, has its centre at
u = (c + 1/2) p, v = -(r + 1/2) p. Cost is per point, not per symbol: `HeightTemplate` cuts one
cell into fine square bins, each filled at its first use. A bin that no edge of the symbol crosses
lies under one planar piece, whose height is exact; the few that an edge crosses ask
`SymbolReliefs`. No interpolation anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import SurfaceError
from probe.surface.contract import HeightMap
from probe.surface.polygon import FaceRegion
from probe.surface.symbols import Relief, Strokes, SymbolReliefs, emboss

Array = NDArray[np.float64]
Index = NDArray[np.int64]

BINS = 192  #: of a template, along a side of a cell


@dataclass(frozen=True, slots=True)
class FaceSurface:
    """A flat face; blank without a lattice, endless without an outline."""

    lattice: LatticeSurface | None
    outline: FaceRegion | None = None
    around: HeightMap | None = None  #: neighbouring faces, face frame; None: nothing there

    @property
    def top_mm(self) -> float:
        """The tops of the symbols, or of higher neighbours."""
        own = self.lattice.top_mm if self.lattice else 0.0
        return max(own, self.around.top_mm) if self.around else own

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of the face, its symbols and its surroundings."""
        if self.outline is None:
            return self._own(points_mm)
        inside = self.outline.contains(points_mm)
        if inside.all():
            heights = self._own(points_mm)
        else:
            heights = np.full(len(points_mm), -np.inf)
            heights[inside] = self._own(points_mm[inside])
        if self.around is not None:
            # Only what leans over the face can be higher than it.
            some = slice(None) if self.around.top_mm > 0 else np.flatnonzero(~inside)
            heights[some] = np.maximum(heights[some], self.around.heights_mm(points_mm[some]))
        return heights

    def _own(self, points: Array) -> Array:
        return self.lattice.heights_mm(points) if self.lattice else np.zeros(len(points))


def endless_face(
    labels: ArrayLike,
    glyphs: Sequence[Strokes],
    *,
    pitch_mm: float = 7.0,
    unit_mm: float = 1.82,
    relief: Relief | None = None,
) -> FaceSurface:
    """Return an endless face that carries an array.

    Parameters
    ----------
    labels
        (rows, columns) labels, repeated without end. Cell (r, c) has its centre at
        ((c + 1/2) p, -(r + 1/2) p).
    glyphs
        Strokes of each label, between nodes in units of `unit_mm`.

    Raises
    ------
    SurfaceError
        When the symbols overlap or collapse.
    """
    symbols = emboss(tuple(glyphs), unit_mm, relief or Relief())
    return FaceSurface(LatticeSurface(template(symbols, pitch_mm), tile_lookup(labels)))


#: Rows (n,) and columns (n,), counted from the anchor -> labels (n,), -1 for no symbol.
LabelAt = Callable[[Index, Index], Index]


@dataclass(frozen=True, eq=False)
class LatticeSurface:
    """Symbols on a plane."""

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

    def cells_at(self, points_mm: Array) -> tuple[Index, Index]:
        """Return rows and columns (n,), counted from the anchor, of points (n, 2)."""
        turn, shift = self._to_cells
        columns, rows = np.floor(points_mm @ turn + shift).astype(np.int64).T
        return rows, columns

    @cached_property
    def _to_cells(self) -> tuple[Array, Array]:
        """Return matrix (2, 2) and shift (2,) from face points to columns and rows."""
        c, s, p = math.cos(self.rotation_rad), math.sin(self.rotation_rad), self.template.pitch_mm
        turn = np.array([[c, -s], [-s, -c]]) / p
        return turn, np.array([self.x_mm, -self.y_mm]) / p


_BELOW_ONE = np.nextafter(1.0, 0.0)


def list_lookup(rows: ArrayLike, columns: ArrayLike, labels: ArrayLike) -> LabelAt:
    """Return the look-up of symbols in cells (n,) counted from the anchor; others are empty.

    Raises `SurfaceError` when two symbols share a cell, or cells lie too far apart to belong to one
    face.
    """
    r, c, q = (np.asarray(values, dtype=np.int64) for values in (rows, columns, labels))
    if not len(r):
        return lambda rows, _columns: np.full(len(rows), -1, dtype=np.int64)
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


_CROSSED, _OPEN = -1, -2


@dataclass(frozen=True, slots=True, eq=False)
class HeightTemplate:
    """All symbols of an alphabet on cells of one pitch. Label -1 is a cell without a symbol."""

    symbols: SymbolReliefs
    pitch_mm: float
    table: NDArray[np.int16]
    """[label, bin down, bin right] -> line of `planes`; -1: crossed, -2: not looked into yet."""
    planes: Array  #: (n, 3) z = a + b x + c y, symbol's axes
    first: Index  #: (labels,) by which a label's pieces stand later in `planes`

    def heights_mm(self, labels: Index, right: Array, down: Array) -> Array:
        """Return the height over the face at places (n,) in cells of labels (n,).

        `right` and `down` count from the cell's upper left corner, shares of the pitch in [0, 1).
        """
        cell = (down * BINS).astype(np.int64)
        cell += labels * BINS
        cell *= BINS
        cell += (right * BINS).astype(np.int64)
        piece = self.table.ravel().take(cell, mode="wrap")
        if (left := np.flatnonzero(piece == _OPEN)).size:
            piece[left] = self._look_into(cell[left])
        z: Array = self.planes[:, 0].take(piece, mode="clip")
        sloped = np.flatnonzero(piece > 1)
        b, c = self.planes[piece[sloped], 1:].T
        z[sloped] += b * self._x(right[sloped]) + c * self._y(down[sloped])
        some = np.flatnonzero(piece == _CROSSED)
        x, y = self._x(right[some]), self._y(down[some])
        z[some] = self.symbols.heights_mm(labels[some], x, y)
        return z

    def _look_into(self, cell: Index) -> NDArray[np.int16]:
        """Return the pieces over bins that no edge crosses, and keep them in the table."""
        label, within = np.divmod(cell, BINS**2)
        down, right = np.divmod(within, BINS)
        middle = _middles()
        piece, _ = self.symbols.pieces(
            label, self.pitch_mm * middle[right], self.pitch_mm * -middle[down]
        )
        found = np.where(piece > 1, piece + self.first[label], piece).astype(np.int16)
        self.table.ravel()[cell] = found
        return found

    def _x(self, right: Array) -> Array:
        return (right - 0.5) * self.pitch_mm

    def _y(self, down: Array) -> Array:
        return (0.5 - down) * self.pitch_mm


@lru_cache(maxsize=32)
def template(symbols: SymbolReliefs, pitch_mm: float) -> HeightTemplate:
    """Return the table of an alphabet's symbols.

    Raises `SurfaceError` when symbols reach beyond their cells.
    """
    if not symbols.foot_half_mm <= pitch_mm / 2:
        raise SurfaceError(
            f"symbols with a foot of {2 * symbols.foot_half_mm:.3g} mm overlap at a pitch of "
            f"{pitch_mm:g} mm",
            fix="take a larger pitch, or thinner strokes",
        )
    foot, count = symbols.foot_half_mm, len(symbols.rings)
    outside = np.abs(pitch_mm * _middles()) > foot + pitch_mm / BINS
    table = np.full((count + 1, BINS, BINS), _OPEN, dtype=np.int16)
    table[:, outside] = table[:, :, outside] = 0
    table[count] = 0  # of label -1
    planes, first = [symbols.planes(0)[:2]], np.zeros(count, dtype=np.int64)
    for label in range(count):
        table[label][_crossed_bins(symbols, label, pitch_mm)] = _CROSSED
        first[label] = sum(map(len, planes)) - 2
        planes.append(symbols.planes(label)[2:])
    return HeightTemplate(symbols, pitch_mm, table, np.concatenate(planes), first)


def _middles() -> Array:
    """Return the places (bins,) of the bins' middles from the cell's middle, over the pitch."""
    middles: Array = (np.arange(BINS) + 0.5) / BINS - 0.5
    return middles


def _crossed_bins(symbols: SymbolReliefs, label: int, pitch_mm: float) -> NDArray[np.bool_]:
    """Return which bins of a cell an edge between two pieces may cross."""
    away = symbols.relief.profile()[0]
    found = np.zeros((BINS, BINS), dtype=bool)
    half = pitch_mm / BINS / 2
    middle = _middles()
    for ring in symbols.rings[label]:
        levels = [ring.moved(float(d)) for d in away]
        lines = [(a, b) for tier in levels for a, b in zip(tier, np.roll(tier, -1, 0), strict=True)]
        lines += list(zip(levels[0], levels[-1], strict=True))
        for a, b in lines:
            low, high = np.minimum(a, b), np.maximum(a, b)
            columns, rows = (
                slice(
                    max(0, int((p / pitch_mm + 0.5) * BINS) - 1),
                    int((q / pitch_mm + 0.5) * BINS) + 2,
                )
                for p, q in ((low[0], high[0]), (-high[1], -low[1]))
            )
            normal = np.array([a[1] - b[1], b[0] - a[0]])
            dx = pitch_mm * middle[columns] - a[0]
            dy = -pitch_mm * middle[rows] - a[1]
            away_from = np.abs(normal[0] * dx + normal[1] * dy[:, None])
            found[rows, columns] |= away_from <= 1.001 * half * np.abs(normal).sum()
    return found
