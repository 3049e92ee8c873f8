"""What a load did to the sensor, in words for whoever puts it on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from probe.calibration.settings import FELT_LOAD


def describe_load(counts: NDArray[np.uint16], rest: NDArray[np.uint16] | None) -> str:
    """Return how many tactels felt a load, how much, and whether it stood still.

    Parameters
    ----------
    counts
        (N, rows, columns) frames of the load.
    rest
        (M, rows, columns) frames of the unloaded sensor; None: these are they.
    """
    mean = counts.mean(axis=0)
    if rest is None:
        return f"{len(counts)} frames at rest, median {np.median(mean):.1f} counts"
    rise = mean - rest.mean(axis=0)
    felt, half = int((rise > FELT_LOAD.counts).sum()), len(counts) // 2
    change = float(np.median(counts[half:].mean(axis=0) - counts[: max(half, 1)].mean(axis=0)))
    words = (
        f"{len(counts)} frames, felt by {felt} of {rise.size} tactels, "
        f"median {np.median(rise):.1f} counts above rest"
    )
    if abs(change) > max(1.0, FELT_LOAD.steady * float(np.median(rise))):
        words += f"; not steady, it changed by {change:+.1f} counts"
    return words
