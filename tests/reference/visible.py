"""Which cells a sensor sees whole: distinct sets over all places and turns.

A symbol is seen whole where its centre lies at least the symbol's half size inside the
sensor's rectangle. Sets differ by more than a shift: a shift of one cell is another place of
the same array. Half a turn maps the rectangle onto itself, so half a circle of turns is all.
"""

import math
from collections import Counter

import numpy as np


def visible_sets(pitch_mm, sensor_half_mm, symbol_half_mm, *, places=24, turns=90):
    """Return the distinct sets of cells (k, 2), from 0 on, each with its share of all poses.

    `sensor_half_mm` is half the width and the height of the sensor's rectangle, `symbol_half_mm`
    the way from a symbol's centre to the end of its strokes. Poses are midpoints of equal steps:
    along each side of one cell, .3 mm apart at a pitch of 7 mm, and over half a circle, 2 degrees
    apart. With 48 places and 180 turns no share of `docs/folds.md` moves by more than .003.
    """
    free = np.array(sensor_half_mm) - symbol_half_mm
    reach = math.ceil(float(np.hypot(*np.maximum(free, 0.0))) / pitch_mm) + 1
    row, column = (grid.ravel() - reach for grid in np.indices((2 * reach + 1, 2 * reach + 1)))
    within = (np.arange(places) + 0.5) / places - 0.5
    x0, y0 = (grid.ravel() for grid in np.meshgrid(within, within))
    x, y = (column - x0[:, None]) * pitch_mm, (-row - y0[:, None]) * pitch_mm  # (places, cells)
    masks, found = Counter(), Counter()
    for turn in (np.arange(turns) + 0.5) * math.pi / turns:
        c, s = math.cos(turn), math.sin(turn)
        seen = (np.abs(c * x + s * y) <= free[0]) & (np.abs(c * y - s * x) <= free[1])
        masks.update(mask.tobytes() for mask in seen)
    for mask, number in masks.items():
        cells = np.argwhere(np.frombuffer(mask, bool).reshape(2 * reach + 1, -1))
        found[(cells - cells.min(axis=0, initial=2 * reach)).tobytes()] += number
    shares = [(key, number / masks.total()) for key, number in found.items()]
    return [(np.frombuffer(key, np.int64).reshape(-1, 2), share) for key, share in shares]
