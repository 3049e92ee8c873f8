"""Symbols looked up by place: exact heights at the price of a table.

One cell of the lattice is cut into fine square bins. A bin that no edge of the symbol
crosses lies under one planar piece; the table names that piece, and the height is its
plane's, exact. The few bins that an edge crosses ask `SymbolReliefs`. No interpolation anywhere.
A bin is looked into when it is first asked: letters that are touched once need few of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from probe.errors import SurfaceError
from probe.surface.settings import SURFACE
from probe.surface.symbols import SymbolReliefs

Array = NDArray[np.float64]
Index = NDArray[np.int64]

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
        """Return the height over the face at a place each.

        Parameters
        ----------
        labels
            (n,) labels of the cells, -1 for none.
        right, down
            (n,) place in the cell from its upper left corner, shares of the pitch in [0, 1).
        """
        cell = (down * SURFACE.bins).astype(np.int64)
        cell += labels * SURFACE.bins
        cell *= SURFACE.bins
        cell += (right * SURFACE.bins).astype(np.int64)
        piece = self.table.ravel().take(cell, mode="wrap")
        if (left := np.flatnonzero(piece == _OPEN)).size:
            piece[left] = self._look_into(cell[left])
        z: Array = self.planes[:, 0].take(piece, mode="clip")
        sloped = np.flatnonzero(piece > 1)
        b, c = self.planes[piece[sloped], 1:].T
        z[sloped] += b * self._x(right[sloped]) + c * self._y(down[sloped])
        asked = np.flatnonzero(piece == _CROSSED)
        x, y = self._x(right[asked]), self._y(down[asked])
        z[asked] = self.symbols.heights_mm(labels[asked], x, y)
        return z

    def _look_into(self, cell: Index) -> NDArray[np.int16]:
        """Return the pieces over bins that no edge crosses, and keep them in the table."""
        label, within = np.divmod(cell, SURFACE.bins**2)
        down, right = np.divmod(within, SURFACE.bins)
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

    Raises
    ------
    SurfaceError
        When symbols reach beyond their cells.
    """
    if not symbols.foot_half_mm <= pitch_mm / 2:
        raise SurfaceError(
            f"symbols with a foot of {2 * symbols.foot_half_mm:.3g} mm overlap at a pitch of "
            f"{pitch_mm:g} mm",
            fix="take a larger pitch, or thinner strokes",
        )
    foot, count = symbols.foot_half_mm, len(symbols.rings)
    beside = np.abs(pitch_mm * _middles()) > foot + pitch_mm / SURFACE.bins
    table = np.full((count + 1, SURFACE.bins, SURFACE.bins), _OPEN, dtype=np.int16)
    table[:, beside] = table[:, :, beside] = 0
    table[count] = 0  # of label -1
    planes, first = [symbols.planes(0)[:2]], np.zeros(count, dtype=np.int64)
    for label in range(count):
        table[label][_crossed_bins(symbols, label, pitch_mm)] = _CROSSED
        first[label] = sum(map(len, planes)) - 2
        planes.append(symbols.planes(label)[2:])
    return HeightTemplate(symbols, pitch_mm, table, np.concatenate(planes), first)


def _middles() -> Array:
    """Return the places (bins,) of the bins' middles in a cell, from its middle, over the pitch."""
    middles: Array = (np.arange(SURFACE.bins) + 0.5) / SURFACE.bins - 0.5
    return middles


def _crossed_bins(symbols: SymbolReliefs, label: int, pitch_mm: float) -> NDArray[np.bool_]:
    """Return which bins of a cell an edge between two pieces may cross."""
    away = symbols.relief.profile()[0]
    found = np.zeros((SURFACE.bins, SURFACE.bins), dtype=bool)
    half = pitch_mm / SURFACE.bins / 2
    middle = _middles()
    for ring in symbols.rings[label]:
        levels = [ring.moved(float(d)) for d in away]
        lines = [(a, b) for tier in levels for a, b in zip(tier, np.roll(tier, -1, 0), strict=True)]
        lines += list(zip(levels[0], levels[-1], strict=True))
        for a, b in lines:
            low, high = np.minimum(a, b), np.maximum(a, b)
            columns, rows = (
                slice(
                    max(0, int((p / pitch_mm + 0.5) * SURFACE.bins) - 1),
                    int((q / pitch_mm + 0.5) * SURFACE.bins) + 2,
                )
                for p, q in ((low[0], high[0]), (-high[1], -low[1]))
            )
            normal = np.array([a[1] - b[1], b[0] - a[0]])
            dx = pitch_mm * middle[columns] - a[0]
            dy = -pitch_mm * middle[rows] - a[1]
            away_from = np.abs(normal[0] * dx + normal[1] * dy[:, None])
            found[rows, columns] |= away_from <= 1.001 * half * np.abs(normal).sum()
    return found
