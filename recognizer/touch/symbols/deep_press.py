"""The gain of a plate that is pressed down on symbols and on the bare face between them.

Image -> gain (4,), to begin with. A plate over the edge of a face lies on little and tips, so that
it stands two or three times deeper than one amid a face and comes down on the bare face beside
most symbols. Around each tactel that is loaded the highest readings are symbols then and the lowest
ones the bare face, deeper by the height of the symbols: one plane goes through both. `first_gain`,
which takes the bare face as not touched, ends in another basin. Sensor frame, mm.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.gain import Image, bounded_gain

Array = NDArray[np.float64]


def deep_gain(image: Image) -> Array | None:
    """Return the gain (4,) of an image in which symbols and the bare face are pressed.

    None where all of the sensor lies on something, where nothing presses, and where the plane
    would hang over the centre.
    """
    settings, pressing = image.settings.gain, image.pressing
    known = image.loaded & (image.trust > 0)
    if image.loaded.mean() > settings.whole or known.sum() < settings.few:
        return None
    shares = (settings.low_percent, settings.high_percent)
    low, high = _percentiles_among(image, known, shares)
    strong = float(np.percentile(high[known], settings.strong_percent))
    if not strong > 0:
        return None
    scale = pressing.scale
    if not image.newtons:
        scale = strong / float(pressing.force(np.array(settings.deep)))
    bare = known & (low > settings.bare * high)
    tops, below = pressing.depth(high[known] / scale), pressing.depth(low[bare] / scale)
    basis = np.concatenate([image.plane[known], image.plane[bare]])
    depth = np.concatenate([tops, below + pressing.symbol])
    plane = np.linalg.lstsq(basis, depth, rcond=None)[0]
    if not plane[0] > 0:
        return None
    return np.asarray(bounded_gain(np.array([[math.log(scale), *plane]]), settings.steepest)[0])


def _percentiles_among(
    image: Image, known: NDArray[np.bool_], shares: tuple[float, ...]
) -> list[Array]:
    """Return percentiles (n,) of the forces of those tactels about each one that are known.

    Of the `around` x `around` ones about it; 0 where none of them is.
    """
    around = image.settings.gain.around
    before = around // 2
    forces = np.where(known, image.forces, np.inf).reshape(image.shape)
    wide = np.pad(forces, (before, around - 1 - before), constant_values=np.inf)
    each = np.lib.stride_tricks.sliding_window_view(wide, (around, around))
    ordered = np.sort(each.reshape(known.size, around**2), axis=1)
    count = np.isfinite(ordered).sum(axis=1)
    rows = np.arange(known.size)
    return [
        np.where(count > 0, ordered[rows, (count * share / 100.0).astype(np.int64)], 0.0)
        for share in shares
    ]
