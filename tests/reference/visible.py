"""Which cells a sensor sees whole: distinct sets over all places and turns.

Pitch + half sizes of sensor and symbol (mm) -> sets of cells, each with its share of poses.
A symbol is seen whole where its centre lies at least the symbol's half size inside the
sensor's rectangle. Sets differ by more than a shift: a shift of one cell is another place of
the same array. Half a turn maps the rectangle onto itself, so half a circle of turns is all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Cells = NDArray[np.int64]  # (k, 2) row, column


@dataclass(frozen=True, slots=True)
class PoseGrid:
    """At how many poses sets of cells are counted: midpoints of equal steps."""

    places: int = 24
    """Along each side of one cell: 24 x 24 places, .3 mm apart at a pitch of 7 mm."""
    turns: int = 90
    """Over half a circle, 2 degrees apart. With 48 places and 180 turns no share of
    `docs/folds.md` moves by more than .003."""


POSES = PoseGrid()


@dataclass(frozen=True, slots=True, eq=False)
class VisibleSet:
    """Cells that are seen whole together at some poses."""

    cells: Cells  #: (k, 2) row, column; the least of each is 0
    share: float  #: of all poses


@lru_cache(maxsize=64)
def visible_sets(
    pitch_mm: float,
    sensor_half_mm: tuple[float, float],
    symbol_half_mm: float,
    poses: PoseGrid = POSES,
) -> tuple[VisibleSet, ...]:
    """Return the distinct sets of cells that a sensor sees whole inside a wide face.

    `sensor_half_mm` is half the width and the height of the sensor's rectangle, `symbol_half_mm`
    the way from a symbol's centre to the end of its strokes. The most frequent set comes first;
    shares add up to 1. An empty set stands for poses that show no symbol whole.
    """
    free = np.array(sensor_half_mm) - symbol_half_mm
    reach = math.ceil(float(np.hypot(*np.maximum(free, 0.0))) / pitch_mm) + 1
    steps = np.arange(-reach, reach + 1)
    row, column = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
    within = (np.arange(poses.places) + 0.5) / poses.places - 0.5
    x0, y0 = (grid.ravel() for grid in np.meshgrid(within, within))
    x, y = (column - x0[:, None]) * pitch_mm, (-row - y0[:, None]) * pitch_mm  # (places, cells)
    counted: dict[bytes, int] = {}
    for turn in (np.arange(poses.turns) + 0.5) * math.pi / poses.turns:
        c, s = math.cos(turn), math.sin(turn)
        seen = (np.abs(c * x + s * y) <= free[0]) & (np.abs(c * y - s * x) <= free[1])
        masks, times = np.unique(np.packbits(seen, axis=1), axis=0, return_counts=True)
        for mask, number in zip(masks, times.tolist(), strict=True):
            key = mask.tobytes()
            counted[key] = counted.get(key, 0) + number
    merged: dict[bytes, int] = {}  # sets up to a shift
    for key, number in counted.items():
        bits = np.unpackbits(np.frombuffer(key, np.uint8), count=row.size).astype(bool)
        cells = np.stack([row[bits], column[bits]], axis=1).astype(np.int64)
        if len(cells):
            cells -= cells.min(axis=0)
        shifted = cells.tobytes()
        merged[shifted] = merged.get(shifted, 0) + number
    total = poses.turns * poses.places**2
    found = []
    for key, number in sorted(merged.items(), key=lambda item: (-item[1], item[0])):
        cells = np.frombuffer(key, np.int64).reshape(-1, 2)
        found.append(VisibleSet(cells, number / total))
    return tuple(found)
