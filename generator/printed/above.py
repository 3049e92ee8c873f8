"""Beads -> heights, seen from above: the surface of what was printed facing up.

Layer after layer from the top down, each bead is cut into the rows of the grid, and only
those places of a row are worked out that no higher plastic covers: what lies hidden costs
next to nothing. mm, part frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.printed.beads import Beads
from generator.printed.runs import blocks, expand_runs

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

_BLOCK = 1 << 20  # places worked out at once: bounds the memory
_FLAT = 1e-9  # a bead whose rise is less of its length lies along the rows


def heights_from_above(
    beads: Beads, low_mm: Floats, shape: tuple[int, int], step_mm: float
) -> tuple[NDArray[np.float32], int]:
    """Return z of the highest plastic over a grid, (ny, nx), and the places worked out.

    Parameters
    ----------
    beads
        All that may show.
    low_mm
        (2,) x and y of the first place.
    shape
        ny, nx.
    step_mm
        Between two places.
    """
    heights = np.full(shape, -np.inf, dtype=np.float32)
    order = np.argsort(-beads.top_mm, kind="stable")
    tops = beads.top_mm[order]
    worked = 0
    # Beads of one layer differ by rounding alone; a blob or a string makes a layer of its own.
    layers = np.flatnonzero(np.diff(np.round(tops / 0.01), prepend=np.inf))
    for begin, end in zip(layers, np.append(layers, len(tops))[1:], strict=True):
        layer = beads.chosen(order[begin:end])
        worked += _lay(heights, layer, low_mm, step_mm)
    return heights, worked


def _lay(heights: NDArray[np.float32], beads: Beads, low: Floats, step: float) -> int:
    """Raise the heights where beads of one layer are higher; return the places worked out."""
    ny, nx = heights.shape
    a, b = beads.start_mm - low, beads.end_mm - low
    half = beads.width_mm / 2
    row0 = np.ceil((np.minimum(a[:, 1], b[:, 1]) - half) / step).clip(0, ny).astype(np.int64)
    row1 = np.floor((np.maximum(a[:, 1], b[:, 1]) + half) / step).clip(-1, ny - 1) + 1
    owner, row = expand_runs(row0, row1.astype(np.int64) - row0)
    if not len(owner):
        return 0
    first, end = _columns(a, b, half, owner, row.astype(np.float64) * step)
    first = np.ceil(first / step).clip(0, nx).astype(np.int64)
    end = (np.floor(end / step).clip(-1, nx - 1) + 1).astype(np.int64)
    # Only places that are still lower than this layer's tops.
    free = np.zeros((ny, nx + 1), np.int32)
    np.cumsum(heights < beads.top_mm.max(), axis=1, out=free[:, 1:])
    shows = (end > first) & (free[row, end.clip(0, nx)] > free[row, first.clip(0, nx)])
    owner, row, first, count = owner[shows], row[shows], first[shows], (end - first)[shows]
    worked = 0
    for part in blocks(count, _BLOCK):
        span, column = expand_runs(first[part], count[part])
        rows, owners = row[part][span], owner[part][span]
        place = rows * nx + column
        lower = heights.ravel()[place] < beads.top_mm[owners]
        place, owners = place[lower], owners[lower]
        points = np.stack([column[lower] * step, rows[lower] * step], axis=1)
        z = _profile(beads, a, b, owners, points)
        np.maximum.at(heights.reshape(-1), place, z.astype(np.float32))
        worked += len(place)
    return worked


def _columns(a: Floats, b: Floats, half: Floats, owner: Index, y: Floats) -> tuple[Floats, Floats]:
    """Return between which x each bead may lie in a row: its box, cut by its two long sides."""
    way = b - a
    length = np.hypot(way[:, 0], way[:, 1])
    slanted = np.abs(way[:, 1]) > _FLAT * np.maximum(length, _FLAT)
    rise = np.where(slanted, way[:, 1], 1.0)
    across = np.where(slanted, half * length / np.abs(rise), np.inf)
    middle = a[owner, 0] + (y - a[owner, 1]) * (way[:, 0] / rise)[owner]
    low = (np.minimum(a[:, 0], b[:, 0]) - half)[owner]
    high = (np.maximum(a[:, 0], b[:, 0]) + half)[owner]
    reach = across[owner]
    return np.maximum(low, middle - reach), np.minimum(high, middle + reach)


def _profile(beads: Beads, a: Floats, b: Floats, owner: Index, points: Floats) -> Floats:
    """Return z of beads at points, -inf beside them."""
    way = (b - a)[owner]
    to = points - a[owner]
    squared = (way * way).sum(axis=1)
    t = ((to * way).sum(axis=1) / np.where(squared > 0, squared, 1.0)).clip(0, 1)
    to -= t[:, None] * way
    off = np.hypot(to[:, 0], to[:, 1])
    r = beads.height_mm[owner] / 2
    off -= beads.width_mm[owner] / 2 - r
    np.maximum(off, 0.0, out=off)
    under = r * r - off * off
    z = beads.top_mm[owner] - r + np.sqrt(under.clip(0))
    return np.where(under >= 0, z, -np.inf)
