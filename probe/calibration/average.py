"""Many frames of one load -> what each tactel reads, its noise, and how well it is known.

Single-frame spikes are left out; the noise of a contact is slow, so that n frames count as
fewer independent ones (by the correlation of one frame with the next).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.calibration.settings import AVERAGE
from probe.errors import CalibrationError

Image = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Average:
    """Means over frames."""

    mean: Image  #: (rows, columns) counts
    noise: Image  #: (rows, columns) counts, standard deviation of one frame
    sigma: Image  #: (rows, columns) counts, standard deviation of the mean
    highest: Image  #: (rows, columns) counts, median: what tells saturation
    frames: int


def average_frames(counts: ArrayLike, name: str = "frames") -> Average:
    """Average frames of a steady load.

    Parameters
    ----------
    counts
        (N, rows, columns) counts, N >= 20, in the order in which they were read.
    name
        Of the load, for messages.

    Raises
    ------
    CalibrationError
        If there are too few frames, or they are no images.
    """
    read = np.asarray(counts, dtype=np.float64)
    if (
        read.ndim != 3
        or len(read) < AVERAGE.frames
        or not np.isfinite(read).all()
        or (read < 0).any()
    ):
        raise CalibrationError(
            f"{name}: shape {read.shape}, it must be (N, rows, columns) counts with "
            f"N >= {AVERAGE.frames}",
            fix="record the steady load for a second or more",
        )
    middle = np.median(read, axis=0)
    away = read - middle
    usual = 1.4826 * np.median(np.abs(away), axis=0)
    kept = np.abs(away) <= np.maximum(AVERAGE.spike * usual, AVERAGE.spike_counts)
    number = np.maximum(kept.sum(axis=0), 1)
    mean = middle + np.where(kept, away, 0.0).sum(axis=0) / number
    rest = np.where(kept, read - mean, 0.0)
    variance = (rest**2).sum(axis=0) / np.maximum(number - 1, 1)
    shared = (rest[1:] * rest[:-1]).sum(axis=0) / np.maximum((rest**2).sum(axis=0), 1e-30)
    shared = np.clip(shared, 0.0, AVERAGE.shared)
    least = 1.0 / (12.0 * len(read))  # rounding, of a reading that never moves
    sigma = np.sqrt(np.maximum(variance / number * (1.0 + shared) / (1.0 - shared), least))
    return Average(mean, np.sqrt(variance), sigma, middle, len(read))
