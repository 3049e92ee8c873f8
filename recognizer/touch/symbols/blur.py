"""Readings that run into each other along rows and along columns: what a board or a slide leaves.

Images (n, k), one a column, rows of the matrix from the top -> their second differences, tactel by
tactel. A reading that holds the share b of both its neighbours is the image plus b times that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def second_differences(images: Array, shape: tuple[int, int]) -> tuple[Array, Array]:
    """Return those across rows (n, k), and across columns; beyond the rim nothing is felt."""
    square = images.reshape(*shape, -1)
    rows, columns = -2.0 * square, -2.0 * square
    rows[1:] += square[:-1]
    rows[:-1] += square[1:]
    columns[:, 1:] += square[:, :-1]
    columns[:, :-1] += square[:, 1:]
    return rows.reshape(images.shape), columns.reshape(images.shape)
