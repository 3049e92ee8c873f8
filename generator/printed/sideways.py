"""Beads -> heights, seen along the bed: the surface of an upright face, with its steps.

In every layer some levels are looked at. At one level a bead is a strip with round ends as
wide as its section is there, and over each place along the face the outermost strip counts.
View frame: t along the face (level with the bed), z up, n out of the face; mm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.printed.beads import Beads
from generator.printed.runs import blocks, expand_runs

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

_BLOCK = 1 << 20  # places worked out at once: bounds the memory
_UPRIGHT = 1e-9  # a bead whose run along t is less stands across the face


def heights_sideways(
    beads: Beads, low_mm: Floats, shape: tuple[int, int], step_mm: float
) -> tuple[NDArray[np.float32], int]:
    """Return n of the outermost plastic over a grid, (nz, nt), and the places worked out.

    Parameters
    ----------
    beads
        All that may show; their places are (t, n).
    low_mm
        (2,) t and z of the first place.
    shape
        nz, nt.
    step_mm
        Between two places.
    """
    nz, nt = shape
    heights = np.full(shape, -np.inf, dtype=np.float32)
    row0 = np.ceil((beads.top_mm - beads.height_mm - low_mm[1]) / step_mm)
    row1 = np.floor((beads.top_mm - low_mm[1]) / step_mm) + 1
    row0, row1 = (row.clip(0, nz).astype(np.int64) for row in (row0, row1))
    owner, row = expand_runs(row0, row1 - row0)
    r = beads.height_mm[owner] / 2
    off = row * step_mm + low_mm[1] - (beads.top_mm[owner] - r)
    half = beads.width_mm[owner] / 2 - r + np.sqrt((r * r - off * off).clip(0))
    a, b = beads.start_mm[owner], beads.end_mm[owner]
    first = np.ceil((np.minimum(a[:, 0], b[:, 0]) - half - low_mm[0]) / step_mm)
    end = np.floor((np.maximum(a[:, 0], b[:, 0]) + half - low_mm[0]) / step_mm) + 1
    first, end = (column.clip(0, nt).astype(np.int64) for column in (first, end))
    count = (end - first).clip(0)
    for part in blocks(count, _BLOCK):
        strip, column = expand_runs(first[part], count[part])
        t = column * step_mm + low_mm[0]
        n = _highest_of_strips(a[part][strip], b[part][strip], half[part][strip], t)
        np.maximum.at(heights.reshape(-1), row[part][strip] * nt + column, n.astype(np.float32))
    return heights, int(count.sum())


def _highest_of_strips(a: Floats, b: Floats, half: Floats, t: Floats) -> Floats:
    """Return the highest n of strips at places t, -inf beside them."""
    ends = []
    for end in (a, b):
        under = half**2 - (t - end[:, 0]) ** 2
        ends.append(np.where(under >= 0, end[:, 1] + np.sqrt(under.clip(0)), -np.inf))
    way = b - a
    length = np.hypot(way[:, 0], way[:, 1])
    along = np.abs(way[:, 0]) > _UPRIGHT * np.maximum(length, _UPRIGHT)
    run = np.where(along, way[:, 0], 1.0)
    lean = way[:, 1] / run  # dn/dt
    # The long side that faces outwards: its foot on the middle line lies beside t.
    foot = t + half * lean / np.hypot(1.0, lean)
    beside = along & (foot >= np.minimum(a[:, 0], b[:, 0])) & (foot <= np.maximum(a[:, 0], b[:, 0]))
    side = a[:, 1] + (t - a[:, 0]) * lean + half * np.hypot(1.0, lean)
    return np.maximum(np.maximum(*ends), np.where(beside, side, -np.inf))
