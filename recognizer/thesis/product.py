"""The thesis's correlation: magnified images, products summed over a zone. Thesis 4.3.

Each image is magnified to four times its resolution by putting zeros between the tactels and
convolving with H, twice. The zone is what both images have in common at the believed shift;
it stays the same zone of the first image while the second one is shifted under it. The
largest sum of products wins, to the cell. Kept as it stands, as the measure of what
`correlation` and `lucas_kanade` are worth: sums of products favour large readings.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.search import MAGNIFIED

Array = NDArray[np.float64]

H = np.outer([0.5, 1.0, 0.5], [0.5, 1.0, 0.5])


def magnify_samples(image: Array) -> Array:
    """Return an image of four times the rows and columns, by H."""
    from scipy.ndimage import convolve

    for _ in range(2):
        wide = np.zeros((2 * image.shape[0], 2 * image.shape[1]))
        wide[::2, ::2] = image
        image = convolve(wide, H, mode="constant")
    return image


def product_shift(a: Array, b: Array, believed: tuple[float, float], window: float) -> Array:
    """Return where the second image lies, as the thesis finds it.

    Parameters
    ----------
    a, b
        (rows, columns) readings of two touches.
    believed
        Shift of b from a along x and y, tactels.
    window
        How far from it the shift may be, tactels.

    Returns
    -------
    (2,) shift along x and y, tactels, in steps of a quarter.
    """
    first, second = magnify_samples(a), magnify_samples(b)
    rows, columns = first.shape
    right, down = round(believed[0] * MAGNIFIED), -round(believed[1] * MAGNIFIED)
    i0, i1 = max(0, down), min(rows, rows + down)
    j0, j1 = max(0, right), min(columns, columns + right)
    zone = first[i0:i1, j0:j1]
    reach = math.floor(window * MAGNIFIED + 1e-9)
    wide = np.pad(second, max(rows, columns) + reach)  # no reading beyond the matrix
    best, shift = -math.inf, (right, down)
    for k in range(-reach, reach + 1):
        for n in range(-reach, reach + 1):
            i, j = i0 - (down + k), j0 - (right + n)
            at = max(rows, columns) + reach
            under = wide[at + i : at + i + i1 - i0, at + j : at + j + j1 - j0]
            total = float((zone * under).sum())
            if total > best:
                best, shift = total, (right + n, down + k)
    return np.array([shift[0], -shift[1]]) / MAGNIFIED
