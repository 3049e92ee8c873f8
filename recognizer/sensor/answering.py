"""Which tactels answer: forces of many touches -> dead and hot tactels, and offsets.

No touch needs to be recognised for it. Over many touches of symbols every tactel is pressed about
as much as those around it, and is free now and then: one that never rises is dead, one that never
comes down is hot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.sensor.settings import LEARNING, LearningSettings

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Answering:
    """How tactels (rows, columns) answer."""

    dead: Flags
    hot: Flags
    offset: Array  #: reading with nothing on a tactel, over the background; 0 where it is as others


def answering_of(forces: Array, settings: LearningSettings = LEARNING) -> Answering:
    """Return how tactels answer, nothing being the matter with any if the touches are few.

    Parameters
    ----------
    forces
        (n, rows, columns) readings over the background, of n touches of different places.
    """
    shape = forces.shape[1:]
    none = np.zeros(shape)
    strong = np.percentile(forces.reshape(len(forces), -1), settings.strong, axis=1)
    if (strong > 0).sum() < settings.least:
        return Answering(none > 0, none > 0, none)
    scale = float(np.median(strong[strong > 0]))  # of all: what is stuck is so under any force
    seen = forces[strong > 0] / scale
    few = len(seen) // settings.least  # of many touches not the extreme one: a spike is one
    free = np.sort(seen, axis=0)[few - 1]
    high = free - np.median(free) > settings.hot
    rise = np.sort(seen - np.where(high, free, 0.0), axis=0)[-few]
    dead, least = high, np.where(high, settings.raised, settings.answers)
    for _ in range(2):  # once more among those that answer: where most around one are dead
        dead = rise < least * _around(np.where(dead, np.nan, rise), settings)
    return Answering(dead & ~high, high & dead, np.where(high & ~dead, scale * free, 0.0))


def _around(values: Array, settings: LearningSettings) -> Array:
    """Return what sound tactels around each one have; tactels that are no numbers do not count."""
    half = settings.around // 2
    padded = np.pad(values, half, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (settings.around,) * 2)
    flat = np.sort(windows.reshape(*values.shape, -1), axis=-1)  # no numbers come last
    count = np.isfinite(flat).sum(axis=-1)
    at = np.rint(settings.usual / 100 * np.maximum(count - 1, 0)).astype(np.int64)
    found = np.take_along_axis(flat, at[..., None], axis=-1)[..., 0]
    return np.where(count > 0, found, 0.0)
