"""Windows of an array, cut out at places of the torus."""

import numpy as np


def windows_at(array, rows, columns, shape):
    """Return what is seen (n, *shape) from places, which may lie beyond 2^63."""
    down, right = (
        np.array([[(int(at) + k) % size for k in range(side)] for at in places], np.uint64)
        for places, size, side in zip(
            (rows, columns), (array.rows, array.columns), shape, strict=True
        )
    )
    return array.symbols(down[:, :, None], right[:, None, :])


def every_window(array, shape):
    """Return rows and columns of all places, and what is seen from each."""
    rows, columns = np.indices((array.rows, array.columns)).reshape(2, -1)
    a, b = np.indices(shape)
    return rows, columns, array.symbols(rows[:, None, None] + a, columns[:, None, None] + b)
