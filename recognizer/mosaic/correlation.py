"""Zero-normalised cross-correlation of images that are known in parts. Thesis 4.3.

The thesis correlates products; they peak where the readings are large rather than where they
agree. Here mean and contrast of what overlaps are taken out at every shift, so that 1 is
reached by images that differ by gain and offset alone. Where nothing varies there is no
correlation: the value is NaN. All sums run over cells that both images know, by FFT. Images
are at four times the matrix's resolution; shifts are found between cells by a parabola.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.mosaic.patch import Patch, asked, covered, nearest
from recognizer.mosaic.planar import inverse, moved

Array = NDArray[np.float64]

MAGNIFIED = 4  #: cells to a tactel
_FLAT = 1e-10  # of the mean square: rounding


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Cells of a plane, row 0 on top: cell (i, j) has its centre at (x0 + j h, y0 - i h)."""

    x0_mm: float
    y0_mm: float
    cell_mm: float
    shape: tuple[int, int]

    def points_mm(self) -> Array:
        """Return the centres (rows, columns, 2)."""
        x = self.x0_mm + np.arange(self.shape[1]) * self.cell_mm
        y = self.y0_mm - np.arange(self.shape[0]) * self.cell_mm
        return np.stack(np.broadcast_arrays(x[None, :], y[:, None]), axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """An image on a grid, and which of its cells are known."""

    values: Array
    known: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Correlation:
    """What shifts of an image over a reference give; the middle one is no shift.

    Shift (k, m) moves the image by (m - columns) cells along x and (rows - k) along y.
    """

    rho: Array  #: (2 rows + 1, 2 columns + 1) -1 ... 1; NaN where undefined
    overlap: Array  #: the same shape, cells that both know


def footprint(patch: Patch, theta_rad: float, reach_mm: tuple[float, float]) -> Grid:
    """Return the grid about the origin that holds a turned matrix and shifts by `reach_mm`."""
    h = patch.sensor.pitch_mm / MAGNIFIED
    half_x, half_y = patch.sensor.half_mm
    c, s = abs(math.cos(theta_rad)), abs(math.sin(theta_rad))
    columns = 2 * math.ceil((c * half_x + s * half_y + reach_mm[0]) / h - 1e-9)
    rows = 2 * math.ceil((s * half_x + c * half_y + reach_mm[1]) / h - 1e-9)
    return Grid(-(columns - 1) / 2 * h, (rows - 1) / 2 * h, h, (rows, columns))


def view(patch: Patch, grid: Grid, T_grid_sensor: Array) -> View:
    """Return a patch as it lies on a grid. Cells next to bad tactels are not known."""
    points = moved(inverse(T_grid_sensor), grid.points_mm().reshape(-1, 2))
    known = covered(patch.sensor, points, beyond=0.5)
    inside = np.flatnonzero(known)
    known[inside] = patch.good.reshape(-1)[nearest(patch.sensor, points[inside])]
    inside = np.flatnonzero(known)
    values = np.zeros(len(points))
    values[inside] = asked(patch, points[inside])[0]
    return View(values.reshape(grid.shape), known.reshape(grid.shape))


def correlated(reference: View, image: View, shifts: tuple[int, int]) -> Correlation:
    """Correlate an image with a reference on the same grid, for shifts up to (rows, columns).

    The grid must be so wide that no known cell of the image leaves it (`footprint`).
    """
    from scipy.fft import irfft2, next_fast_len, rfft2

    shape = image.values.shape
    size = [next_fast_len(n + s, real=True) for n, s in zip(shape, shifts, strict=True)]
    a, b = _centred(reference), _centred(image)
    m, n = reference.known.astype(np.float64), image.known.astype(np.float64)
    of_a = [rfft2(part, size) for part in (m, a, a * a)]
    of_b = [np.conj(rfft2(part, size)) for part in (n, b, b * b)]

    def summed(left: NDArray[np.complex128], right: NDArray[np.complex128]) -> Array:
        whole = irfft2(left * right, size)
        rows = np.arange(-shifts[0], shifts[0] + 1) % size[0]
        columns = np.arange(-shifts[1], shifts[1] + 1) % size[1]
        return np.asarray(whole[np.ix_(rows, columns)])

    overlap = np.rint(summed(of_a[0], of_b[0]))
    count = np.maximum(overlap, 1.0)
    a_sum, b_sum = summed(of_a[1], of_b[0]), summed(of_a[0], of_b[1])
    a_squares, b_squares = summed(of_a[2], of_b[0]), summed(of_a[0], of_b[2])
    product = summed(of_a[1], of_b[1]) - a_sum * b_sum / count
    of_both = (a_squares - a_sum**2 / count), (b_squares - b_sum**2 / count)
    varies = np.minimum(
        of_both[0] - _FLAT * (a * a).sum(), of_both[1] - _FLAT * (b * b).sum()
    ) > 0  # fmt: skip
    varies &= overlap > 1
    with np.errstate(invalid="ignore", divide="ignore"):
        rho = np.where(varies, product / np.sqrt(of_both[0] * of_both[1]), np.nan)
    return Correlation(np.clip(rho, -1.0, 1.0), overlap)


def peaks(scores: Array, most: int) -> list[tuple[float, float, float]]:
    """Return local maxima as (row, column, score), best first, between cells by parabolas.

    Undefined scores are NaN or -inf and are no maxima; nor are cells on the rim, where the
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


def _centred(seen: View) -> Array:
    """Return values less their mean (sums of squares then lose no digits), 0 where not known."""
    mean = float(seen.values[seen.known].mean()) if seen.known.any() else 0.0
    return np.where(seen.known, seen.values - mean, 0.0)
