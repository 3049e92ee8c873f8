"""Zero-normalised cross-correlation of images that are known in parts. Thesis 4.3.

The thesis correlates products; they peak where readings are large rather than where they
agree. Here mean and contrast of what overlaps are taken out at every shift, so that 1 is
reached by images that differ by gain and offset alone. Where nothing varies there is no
correlation: the value is NaN. All sums run over cells that both images know, by FFT. Maxima
are found between cells by parabolas.

Padfield, "Masked object registration in the Fourier domain", IEEE Trans. Image Processing 21
(2012).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.raster import KnownRaster
from recognizer.scan.mosaic.settings import CORRELATION

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Correlation:
    """What the shifts of an image over a reference give; no shift is in the middle."""

    rho: Array  #: (2 rows + 1, 2 columns + 1) -1 ... 1, NaN where undefined
    overlap: Array  #: the same shape, cells that both know


def cross_correlate(reference: KnownRaster, image: KnownRaster) -> Correlation:
    """Correlate an image with a reference that reaches further on all sides.

    Parameters
    ----------
    reference
        (rows + 2 k, columns + 2 m) cells.
    image
        (rows, columns) cells.

    Returns
    -------
    Correlation
        Element (i, j) belongs to the image shifted down by i - k and right by j - m cells.
    """
    from scipy.fft import irfft2, next_fast_len, rfft2

    size = [next_fast_len(n, real=True) for n in reference.values.shape]
    down, right = (
        n - m + 1 for n, m in zip(reference.values.shape, image.values.shape, strict=True)
    )
    a, b = _centre_values(reference), _centre_values(image)
    of_a = rfft2(np.stack([reference.known, a, a * a]), size)
    of_b = np.conj(rfft2(np.stack([image.known, b, b * b]), size))
    pairs = np.stack(
        [
            of_a[0] * of_b[0], of_a[1] * of_b[0], of_a[0] * of_b[1],
            of_a[2] * of_b[0], of_a[0] * of_b[2], of_a[1] * of_b[1],
        ]
    )  # fmt: skip
    count, a_sum, b_sum, a_squares, b_squares, product = irfft2(pairs, size)[:, :down, :right]
    overlap = np.rint(count)
    cells = np.maximum(overlap, 1.0)
    a_rest, b_rest = a_squares - a_sum**2 / cells, b_squares - b_sum**2 / cells
    flat = CORRELATION.flat
    varies = (a_rest > flat * (a * a).sum()) & (b_rest > flat * (b * b).sum()) & (overlap > 1)
    scale = np.sqrt(np.where(varies, a_rest * b_rest, 1.0))
    rho = np.clip((product - a_sum * b_sum / cells) / scale, -1.0, 1.0)
    return Correlation(np.where(varies, rho, np.nan), overlap)


def peaks(scores: Array, most: int) -> list[tuple[float, float, float]]:
    """Return local maxima as (row, column, score), best first, between cells by parabolas.

    Undefined scores are NaN or -inf and are no maxima; nor are those on the rim, where the
    maximum lies outside.
    """
    known = np.where(np.isfinite(scores), scores, -np.inf)
    middle = known[1:-1, 1:-1]
    rows, columns = known.shape
    highest = np.isfinite(middle)
    for k, m in ((0, 0), (0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1), (2, 2)):
        beside = known[k : rows - 2 + k, m : columns - 2 + m]
        # of equal neighbours the first one counts
        highest &= (middle > beside) if (k, m) < (1, 1) else (middle >= beside)
    found = np.argwhere(highest) + 1
    order = np.argsort(-middle[highest], kind="stable")[:most]
    return [
        (
            i + _vertex(known[i - 1, j], known[i, j], known[i + 1, j]),
            j + _vertex(known[i, j - 1], known[i, j], known[i, j + 1]),
            float(known[i, j]),
        )
        for i, j in found[order].tolist()
    ]


def _vertex(before: float, at: float, after: float) -> float:
    """Return where a parabola through three equidistant values is highest, -1/2 ... 1/2."""
    bend = before - 2 * at + after
    if not math.isfinite(bend) or bend >= 0:
        return 0.0
    return min(0.5, max(-0.5, 0.5 * (before - after) / bend))


def _centre_values(raster: KnownRaster) -> Array:
    """Return values less their mean (sums of squares then lose no digits), 0 where not known."""
    mean = float(raster.values[raster.known].mean()) if raster.known.any() else 0.0
    return np.where(raster.known, raster.values - mean, 0.0)
