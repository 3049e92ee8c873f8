"""The filters before edges and symbols are looked for: bias, median, magnification, Sobel.

Readings -> `TactileImage`: samples on a square grid in an image frame (x right along columns,
y up against rows, mm). For one touch the image frame is the sensor frame; for a mosaic it is
the mosaic's. Undefined samples (bad tactels, places that no touch has reached) stay out of
every filter. Thesis 4.3.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.tactile_image import ImageError, TactileImage

Array = NDArray[np.float64]


def subtract_bias(image: TactileImage) -> TactileImage:
    """Return readings, 0 or more, over that of the lowest twentieth of the samples."""
    if not image.defined.any():
        return image
    level = np.quantile(image.values[image.defined], 0.05)
    values = np.where(image.defined, np.maximum(image.values - level, 0.0), 0.0)
    return _replace_values(image, values)


def median(image: TactileImage, thinnest_mm: float | None = None) -> TactileImage:
    """Return the median of the 3 x 3 neighbourhood of every sample; edges are repeated.

    It takes spikes away and keeps edges, but erases lines of one sample's width: `ImageError` if
    the thinnest line that must survive, `thinnest_mm`, is not two samples wide.
    """
    if thinnest_mm is not None and thinnest_mm < 2 * image.step_mm:
        raise ImageError(
            f"a 3 x 3 median erases lines of one sample: {thinnest_mm:g} mm are "
            f"{thinnest_mm / image.step_mm:.2g} samples of {image.step_mm:g} mm",
            fix="leave the median out, or take it of a finer mosaic",
        )
    known = np.where(image.defined, image.values, np.nan)
    padded = np.pad(known, 1, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 3)).reshape(*known.shape, 9)
    if image.defined.all():
        values = np.partition(windows, 4, axis=-1)[..., 4]
    else:  # of those neighbours that are defined
        count = np.isfinite(windows).sum(axis=-1)
        ranked = np.sort(windows, axis=-1)  # NaN last
        low = np.take_along_axis(ranked, (np.maximum(count - 1, 0) // 2)[..., None], axis=-1)
        high = np.take_along_axis(ranked, (np.minimum(count, 8) // 2)[..., None], axis=-1)
        middle = np.where(count % 2 == 1, low[..., 0], (low + high)[..., 0] / 2)
        values = np.where(image.defined, middle, 0.0)
    return _replace_values(image, values)


def magnify_image(image: TactileImage, doublings: int = 2) -> TactileImage:
    """Return an image sampled twice as finely for every doubling: 16 x 16 becomes 61 x 61.

    Zeros go between the samples, and the image is convolved with

        1/4 1/2 1/4
        1/2  1  1/2
        1/4 1/2 1/4

    which joins neighbours by straight lines. The three rows and columns that the thesis's 64 x 64
    images hold beyond the last tactel are left out. Undefined neighbours do not count.
    """
    values, weights = image.values, image.defined.astype(np.float64)
    values = values * weights
    for _ in range(doublings):
        values, weights = double_sampling(values), double_sampling(weights)
    defined = weights > 0.5
    filled = np.where(defined, values / np.where(defined, weights, 1.0), 0.0)
    return TactileImage(filled, defined, image.step_mm / 2**doublings, image.corner_mm)


def double_sampling(values: Array) -> Array:
    """Return samples (2 h - 1, 2 w - 1): between two the mean of both."""
    for axis in (0, 1):
        rows = np.moveaxis(values, axis, 0)
        finer = np.empty((2 * len(rows) - 1, *rows.shape[1:]))
        finer[::2] = rows
        finer[1::2] = (rows[1:] + rows[:-1]) / 2
        values = np.moveaxis(finer, 0, axis)
    return values


def sobel(image: TactileImage) -> tuple[Array, Array]:
    """Return the slopes (h, w) along x and y by Sobel's operators, per mm; edges are repeated.

    Undefined samples count as 0; the caller leaves out slopes next to them.
    """
    f = np.pad(image.values, 1, mode="edge")
    across = f[:, 2:] - f[:, :-2]
    down = f[2:, :] - f[:-2, :]
    x = across[:-2] + 2 * across[1:-1] + across[2:]
    y = -(down[:, :-2] + 2 * down[:, 1:-1] + down[:, 2:])
    return x / (8 * image.step_mm), y / (8 * image.step_mm)


def _replace_values(image: TactileImage, values: Array) -> TactileImage:
    values.setflags(write=False)
    return replace(image, values=values)
