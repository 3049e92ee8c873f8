"""Where a touch may lie on a reference image: the best maxima of the correlation. Thesis 4.3.

Reference + patch + belief -> candidates. The window is three standard deviations of the belief both
ways, with as many turns as move the matrix's rim by a tactel each. Scores are log-likelihoods,

    nats = -(n / 2) log(1 - rho^2) - d^T C^-1 d / 2,

n the independent readings in the overlap, d the distance from the belief. Beyond a few symbols a
larger overlap counts no more: one pitch away, symbols of one alphabet on one lattice correlate
by .8, and a large overlap there would outweigh a smaller one where they are the same.

rho is the zero-normalised cross-correlation of images that are known in parts. The thesis
correlates products, which peak where readings are large rather than where they agree. Here mean
and contrast of the overlap are removed at every shift: rho is 1 for images that differ by gain and
offset alone, and NaN where nothing varies. All sums run over cells that both images know, by FFT;
maxima are found between cells by parabolas (Padfield, "Masked object registration in the Fourier
domain", IEEE Trans. Image Processing 21 (2012)).

Images stand on cells of a plane: row 0 is on top, cell (i, j) has its centre at
(x0 + j h, y0 - i h). A patch magnified to four times its resolution is such an image in the sensor
frame, the global tactile image in the frame of the mosaic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.patch import RIM, TouchPatch, basis
from recognizer.scan.mosaic.planar import compose_poses, rotation, transform_points

Array = NDArray[np.float64]

MAGNIFIED = 4  #: cells to a tactel: the thesis's 64 by 64
FLAT = 1e-10  #: of the sum of squares, below which an image varies by rounding alone
SIGMAS = 3.0  #: half width of the window, standard deviations of the belief
LEAST_OVERLAP = 0.2  #: share of the matrix
HIGHEST_RHO = 0.94  #: correlation at true places; more is chance, not evidence
INDEPENDENT = 0.4  #: independent readings to a tactel: smoothing couples neighbours
ENOUGH_TACTELS = 96.0  #: of overlap, beyond which more do not count
CANDIDATES = 6  #: maxima that are looked at


@dataclass(frozen=True, slots=True, eq=False)
class KnownRaster:
    """Values on cells, and which of them are known."""

    values: Array  #: (rows, columns); 0 where not known
    known: NDArray[np.bool_]  #: (rows, columns)
    x0_mm: float  #: of the centre of cell (0, 0)
    y0_mm: float
    cell_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class PlaceCandidate:
    """A place that explains the images."""

    pose: Array  #: (3,) T_reference_patch
    score: float  #: nats, images and belief
    images: float  #: nats, images alone


def search_reference(
    reference: KnownRaster, patch: TouchPatch, believed: Array, covariance: Array
) -> tuple[list[PlaceCandidate], float]:
    """Return the poses at which a patch may lie on a reference of quarter tactels, best first.

    `believed` (3,) T_reference_patch has `covariance` (3, 3). The second value is the number of
    independent places in the window.
    """
    image = magnify_patch(patch)
    h = image.cell_mm
    # the window along the patch's axes
    turned = rotation(-float(believed[2]))
    inside = turned @ covariance @ turned.T
    x_mm, y_mm = window_mm(inside)
    columns, rows = math.ceil(x_mm / h) + 1, math.ceil(y_mm / h) + 1
    wide = pad_raster(image, rows, columns)
    prior = np.linalg.inv(inside)
    down, right = np.mgrid[-rows : rows + 1, -columns : columns + 1]
    found: list[PlaceCandidate] = []
    turns = _turns(math.sqrt(covariance[2, 2]), patch)
    for turn in turns.tolist():
        at = np.array([believed[0], believed[1], believed[2] + turn])
        # shifts are along the turned axes: equal for the prior to second order
        away = np.stack([right * h, -down * h, np.full(right.shape, turn)], axis=-1)
        rho, overlap = cross_correlate(resample(reference, wide, at), image)
        tactels = overlap / MAGNIFIED**2
        images = nats(rho, tactels)
        score = images - 0.5 * np.einsum("kni,ij,knj->kn", away, prior, away)
        score[~(rho > 0) | (tactels < LEAST_OVERLAP * patch.good.size)] = -np.inf
        for i, j, value in peaks(score, CANDIDATES):
            shift = np.array([(j - columns) * h, (rows - i) * h, 0.0])
            alone = float(images[round(i), round(j)])
            found.append(PlaceCandidate(compose_poses(at, shift), value, alone))
    found.sort(key=lambda candidate: -candidate.score)
    tried = down.size * len(turns) / MAGNIFIED**2
    return found[:CANDIDATES], tried


def nats(rho: Array, tactels: Array) -> Array:
    """Return the log-likelihood ratio of two images of one place, by their correlation."""
    known = np.clip(np.nan_to_num(rho), 0.0, HIGHEST_RHO)
    readings = INDEPENDENT * np.minimum(tactels, ENOUGH_TACTELS)
    return np.asarray(-readings / 2 * np.log1p(-(known**2)))


def window_mm(covariance: Array) -> tuple[float, float]:
    """Return the half width of the search window along x and y, mm."""
    x, y = SIGMAS * np.sqrt(np.diag(covariance)[:2])
    return float(x), float(y)


def cross_correlate(reference: KnownRaster, image: KnownRaster) -> tuple[Array, Array]:
    """Correlate an image (rows, columns) with a reference (rows + 2 k, columns + 2 m).

    Return rho -1 ... 1, NaN where undefined, and the number of cells that both know; element (i, j)
    belongs to the image shifted down by i - k and right by j - m cells.
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
    varies = (a_rest > FLAT * (a * a).sum()) & (b_rest > FLAT * (b * b).sum()) & (overlap > 1)
    scale = np.sqrt(np.where(varies, a_rest * b_rest, 1.0))
    rho = np.clip((product - a_sum * b_sum / cells) / scale, -1.0, 1.0)
    return np.where(varies, rho, np.nan), overlap


def peaks(scores: Array, most: int) -> list[tuple[float, float, float]]:
    """Return local maxima as (row, column, score), best first, between cells by parabolas.

    Scores that are NaN or -inf are no maxima; nor are those on the rim.
    """
    known = np.where(np.isfinite(scores), scores, -np.inf)
    middle = known[1:-1, 1:-1]
    rows, columns = known.shape
    highest = np.isfinite(middle)
    for k, m in ((0, 0), (0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1), (2, 2)):
        neighbour = known[k : rows - 2 + k, m : columns - 2 + m]
        # of equal neighbours the first one counts
        highest &= (middle > neighbour) if (k, m) < (1, 1) else (middle >= neighbour)
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


def magnify_patch(patch: TouchPatch) -> KnownRaster:
    """Return a patch at four times its resolution, sensor frame."""
    rows, columns = patch.values.shape
    h = patch.sensor.pitch_mm / MAGNIFIED
    values = _spline_matrix(rows) @ patch.coefficients @ _spline_matrix(columns).T
    known = patch.good.repeat(MAGNIFIED, axis=0).repeat(MAGNIFIED, axis=1)
    width, height = columns * MAGNIFIED, rows * MAGNIFIED
    return KnownRaster(
        np.where(known, values, 0.0), known, -(width - 1) / 2 * h, (height - 1) / 2 * h, h
    )


def pad_raster(raster: KnownRaster, rows: int, columns: int) -> KnownRaster:
    """Return a raster with rows and columns of unknown cells added on each side."""
    margin = ((rows, rows), (columns, columns))
    return KnownRaster(
        np.pad(raster.values, margin),
        np.pad(raster.known, margin),
        raster.x0_mm - columns * raster.cell_mm,
        raster.y0_mm + rows * raster.cell_mm,
        raster.cell_mm,
    )


def points_mm(raster: KnownRaster) -> Array:
    """Return the cells' centres (rows, columns, 2)."""
    rows, columns = raster.values.shape
    points = np.empty((rows, columns, 2))
    points[..., 0] = raster.x0_mm + np.arange(columns) * raster.cell_mm
    points[..., 1] = (raster.y0_mm - np.arange(rows) * raster.cell_mm)[:, None]
    return points


def resample(source: KnownRaster, like: KnownRaster, T_source_like: Array) -> KnownRaster:
    """Return a raster resampled on the cells of another one, bilinearly.

    A cell is known where all four are.
    """
    at = transform_points(T_source_like, points_mm(like))
    column = (at[..., 0] - source.x0_mm) / source.cell_mm
    row = (source.y0_mm - at[..., 1]) / source.cell_mm
    rows, columns = source.values.shape
    inside = (column >= 0) & (column <= columns - 1) & (row >= 0) & (row <= rows - 1)
    j = np.clip(column.astype(np.intp), 0, columns - 2)
    i = np.clip(row.astype(np.intp), 0, rows - 2)
    right, down = column - j, row - i
    first = i * columns + j
    values, known = source.values.reshape(-1), source.known.reshape(-1)
    total = np.zeros(at.shape[:2])
    for offset, share in (
        (0, (1 - right) * (1 - down)),
        (1, right * (1 - down)),
        (columns, (1 - right) * down),
        (columns + 1, right * down),
    ):
        total += values[first + offset] * share
        inside &= known[first + offset] | (share < 1e-9)
    return KnownRaster(np.where(inside, total, 0.0), inside, like.x0_mm, like.y0_mm, like.cell_mm)


def _turns(sigma_rad: float, patch: TouchPatch) -> Array:
    """Return the turns to try about a belief: each moves the rim by a tactel more."""
    step = patch.sensor.pitch_mm / patch.sensor.reach_mm
    count = math.floor(min(SIGMAS * sigma_rad, math.pi) / step + 0.5)
    return np.asarray(np.arange(-count, count + 1) * step, np.float64)


def _vertex(before: float, at: float, after: float) -> float:
    """Return where a parabola through three equidistant values is highest, -1/2 ... 1/2."""
    curvature = before - 2 * at + after
    if not math.isfinite(curvature) or curvature >= 0:
        return 0.0
    return min(0.5, max(-0.5, 0.5 * (before - after) / curvature))


def _centre_values(raster: KnownRaster) -> Array:
    """Return values less their mean (sums of squares then lose no digits), 0 where not known."""
    mean = float(raster.values[raster.known].mean()) if raster.known.any() else 0.0
    return np.where(raster.known, raster.values - mean, 0.0)


@lru_cache(maxsize=8)
def _spline_matrix(tactels: int) -> Array:
    """Return the matrix from spline coefficients to the cells of a row of tactels."""
    cells = (np.arange(tactels * MAGNIFIED) + 0.5) / MAGNIFIED - 0.5 + RIM
    first = np.floor(cells).astype(np.intp)
    table = np.zeros((len(cells), tactels + 2 * RIM))
    np.put_along_axis(table, first[:, None] + np.arange(-1, 3), basis(cells - first)[0], axis=1)
    table.setflags(write=False)
    return table
