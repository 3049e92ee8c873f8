"""Cells of an array in which tiles, rows and columns reach their limits, to hold and give back."""

from __future__ import annotations

import numpy as np

#: name: rows and columns of cells
PLACES = {
    "corner": (np.array([0, 0, 63, 64, 127]), np.array([0, 64, 63, 64, 0])),
    "far": (np.array([0, 2**62, 2**63 - 2]), np.array([2**63 - 2, 5, 2**63 - 2])),
    "none": (np.empty(0, np.int64), np.empty(0, np.int64)),
    "many": tuple(np.unravel_index(np.random.default_rng(2).permutation(200 * 300)[:9000],
                                   (200, 300))),
}  # fmt: skip


def listed(cells: tuple[np.ndarray, np.ndarray]) -> list[tuple[int, int]]:
    """Return cells as pairs (row, column)."""
    return list(zip(*(part.tolist() for part in cells), strict=True))
