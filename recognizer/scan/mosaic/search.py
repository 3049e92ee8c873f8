"""Where a touch may lie on a reference: the best few maxima of the correlation. Thesis 4.3.

Reference + patch + belief -> candidates. The window is what the belief leaves, three standard
deviations both ways, and as many turns as would move the matrix's rim by a tactel. Scores are
log-likelihoods,

    nats = -(n / 2) log(1 - rho^2) - d^T C^-1 d / 2,

n the independent readings in the overlap, d the way from the belief. Beyond a few symbols a
larger overlap counts no more: one pitch away, symbols of one alphabet on one lattice correlate
by .8, and a large overlap there would outweigh a smaller one where they are the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.correlation import cross_correlate, peaks
from recognizer.scan.mosaic.patch import TouchPatch
from recognizer.scan.mosaic.planar import compose_poses
from recognizer.scan.mosaic.raster import KnownRaster, laid_under, magnify_patch, pad_raster
from recognizer.scan.mosaic.settings import CANVAS, ImageSearchSettings

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PlaceCandidate:
    """A place that explains the images."""

    pose: Array  #: (3,) T_reference_patch
    score: float  #: nats, images and belief
    images: float  #: nats, images alone


@dataclass(frozen=True, slots=True, eq=False)
class SearchResult:
    """What the search found."""

    candidates: tuple[PlaceCandidate, ...]  #: best first
    tried: float  #: independent places in the window


def nats(rho: Array, tactels: Array, settings: ImageSearchSettings) -> Array:
    """Return how much likelier images are if they show the same, by their correlation."""
    known = np.clip(np.nan_to_num(rho), 0.0, settings.best)
    readings = settings.independent * np.minimum(tactels, settings.enough)
    return np.asarray(-readings / 2 * np.log1p(-(known**2)))


def window_mm(covariance: Array, settings: ImageSearchSettings) -> tuple[float, float]:
    """Return how far from a belief the search reaches along x and y, mm."""
    x, y = settings.sigmas * np.sqrt(np.diag(covariance)[:2])
    return float(x), float(y)


def search_reference(
    reference: KnownRaster,
    patch: TouchPatch,
    believed: Array,
    covariance: Array,
    settings: ImageSearchSettings,
) -> SearchResult:
    """Return where a patch may lie on a reference.

    Parameters
    ----------
    reference
        Cells of a quarter of a tactel.
    believed, covariance
        T_reference_patch (3,) and (3, 3).
    """
    image = magnify_patch(patch)
    h = image.cell_mm
    # the window along the patch's axes
    c, s = math.cos(believed[2]), math.sin(believed[2])
    turned = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    inside = turned @ covariance @ turned.T
    x_mm, y_mm = window_mm(inside, settings)
    columns, rows = math.ceil(x_mm / h) + 1, math.ceil(y_mm / h) + 1
    wide = pad_raster(image, rows, columns)
    prior = np.linalg.inv(inside)
    down, right = np.mgrid[-rows : rows + 1, -columns : columns + 1]
    found: list[PlaceCandidate] = []
    turns = _turns(math.sqrt(covariance[2, 2]), patch, settings)
    for turn in turns.tolist():
        stands = np.array([believed[0], believed[1], believed[2] + turn])
        # shifts are along the turned axes; for the prior that is the same to second order
        away = np.stack([right * h, -down * h, np.full(right.shape, turn)], axis=-1)
        seen = cross_correlate(laid_under(reference, wide, stands), image)
        tactels = seen.overlap / CANVAS.magnified**2
        images = nats(seen.rho, tactels, settings)
        score = images - 0.5 * np.einsum("kni,ij,knj->kn", away, prior, away)
        score[~(seen.rho > 0) | (tactels < settings.overlap * patch.good.size)] = -np.inf
        for i, j, value in peaks(score, settings.candidates):
            shift = np.array([(j - columns) * h, (rows - i) * h, 0.0])
            alone = float(images[round(i), round(j)])
            found.append(PlaceCandidate(compose_poses(stands, shift), value, alone))
    found.sort(key=lambda candidate: -candidate.score)
    tried = down.size * len(turns) / CANVAS.magnified**2
    return SearchResult(tuple(found[: settings.candidates]), tried)


def _turns(sigma_rad: float, patch: TouchPatch, settings: ImageSearchSettings) -> Array:
    """Return the turns to try about a belief: each moves the rim by a tactel more."""
    step = patch.sensor.pitch_mm / patch.sensor.reach_mm
    count = math.floor(min(settings.sigmas * sigma_rad, math.pi) / step + 0.5)
    return np.asarray(np.arange(-count, count + 1) * step, np.float64)
