"""Known loads: averaged frames, and the force on each tactel meanwhile.

An air cushion or a bag presses every tactel alike; a dead weight stands on a known footprint.
Single-frame spikes are left out; the noise of a contact is slow, so that n frames count as
fewer independent ones (by the correlation of one frame with the next).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.output import count_of
from probe.errors import CalibrationError

Image = NDArray[np.float64]

BIAS_FRAMES = 32  #: averaged for the bias of a live view
LEAST_FRAMES = 20  #: of a load
SPIKE = 8.0  # robust deviations from the median, beyond it a sample is a spike
SPIKE_COUNTS = 5.0  # and at least so many counts
SHARED = 0.98  # largest correlation of neighbouring frames that is believed
LOADED_COUNTS = 5.0  # above rest, from which a tactel counts as loaded in `describe_load`
STEADY = 0.05  # share by which a load may change while it is read


@dataclass(frozen=True, slots=True, eq=False)
class Average:
    """Means over frames."""

    mean: Image  #: (rows, columns) counts
    noise: Image  #: (rows, columns) counts, standard deviation of one frame
    sigma: Image  #: (rows, columns) counts, standard deviation of the mean
    highest: Image  #: (rows, columns) counts, median, for saturation
    frames: int


def average_frames(counts: ArrayLike, name: str = "frames") -> Average:
    """Average the frames (N, rows, columns) of a steady load, N >= 20, in the order of reading.

    `name` is that of the load, for messages. Raises CalibrationError: too few frames, or no images.
    """
    read = np.asarray(counts, dtype=np.float64)
    if read.ndim != 3 or not np.isfinite(read).all() or (read < 0).any():
        raise CalibrationError(
            f"{name}: shape {read.shape}, it must be (N, rows, columns) counts",
            fix="give the frames of a recording",
        )
    if len(read) < LEAST_FRAMES:
        raise CalibrationError(
            f"{name}: {count_of(len(read), 'frame')}, at least {LEAST_FRAMES} are averaged",
            fix="record the steady load for a second or more",
        )
    middle = np.median(read, axis=0)
    away = read - middle
    usual = 1.4826 * np.median(np.abs(away), axis=0)
    kept = np.abs(away) <= np.maximum(SPIKE * usual, SPIKE_COUNTS)
    number = np.maximum(kept.sum(axis=0), 1)
    mean = middle + np.where(kept, away, 0.0).sum(axis=0) / number
    rest = np.where(kept, read - mean, 0.0)
    variance = (rest**2).sum(axis=0) / np.maximum(number - 1, 1)
    shared = (rest[1:] * rest[:-1]).sum(axis=0) / np.maximum((rest**2).sum(axis=0), 1e-30)
    shared = np.clip(shared, 0.0, SHARED)
    least = 1.0 / (12.0 * len(read))  # rounding, of a reading that never moves
    sigma = np.sqrt(np.maximum(variance / number * (1.0 + shared) / (1.0 - shared), least))
    return Average(mean, np.sqrt(variance), sigma, middle, len(read))


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationLoad:
    """Frames under one steady load."""

    name: str
    read: Average
    forces_n: NDArray[np.float64]  #: (rows, columns) N on each tactel


def known_load(counts: ArrayLike, forces_n: ArrayLike, name: str = "") -> CalibrationLoad:
    """Return a load by its frames (N, rows, columns) and the force on each tactel, N.

    The name is for messages and for the calibration file. Raises CalibrationError: frames or forces
    are none, or do not fit together.
    """
    forces = np.asarray(forces_n, dtype=np.float64)
    label = name or f"{forces.sum():.4g} N"
    read = average_frames(counts, f"load {label}")
    if forces.shape != read.mean.shape or not np.isfinite(forces).all() or (forces < 0).any():
        raise CalibrationError(
            f"load {label}: forces of shape {forces.shape} for frames of {read.mean.shape}, or "
            "below 0, or no numbers",
            fix="give the force on every tactel, N",
        )
    return CalibrationLoad(label, read, forces)


def even_load(
    counts: ArrayLike, total_n: float, footprint: ArrayLike | None = None, name: str = ""
) -> CalibrationLoad:
    """Return a load of known total force, even over its footprint; see `known_load`.

    `total_n` is the force of the whole load: a dead weight, or a cushion's pressure times the area;
    `footprint` (rows, columns) the share of each tactel that is covered, all of every one by
    default.
    """
    shape = np.shape(counts)[-2:]
    cover = np.ones(shape) if footprint is None else np.asarray(footprint, dtype=np.float64)
    if cover.shape != shape or not (cover >= 0).all() or not cover.sum() > 0:
        raise CalibrationError(
            f"load {name or total_n}: a footprint of shape {cover.shape} for frames of {shape}, "
            "or an empty one",
            fix="give the share of every tactel that is covered, 0 ... 1",
        )
    return known_load(counts, total_n * cover / cover.sum(), name or f"{total_n:.4g} N")


def describe_load(counts: NDArray[np.uint16], rest: NDArray[np.uint16] | None) -> str:
    """Return in words how many tactels a load pressed, how much, and whether it was steady.

    `counts` (N, rows, columns) are frames of the load, `rest` those of the unloaded sensor; None:
    `counts` are these.
    """
    mean = counts.mean(axis=0)
    if rest is None:
        return f"{len(counts)} frames at rest, median {np.median(mean):.1f} counts"
    rise = mean - rest.mean(axis=0)
    loaded, half = int((rise > LOADED_COUNTS).sum()), len(counts) // 2
    change = float(np.median(counts[half:].mean(axis=0) - counts[: max(half, 1)].mean(axis=0)))
    words = (
        f"{len(counts)} frames, felt by {loaded} of {rise.size} tactels, "
        f"median {np.median(rise):.1f} counts above rest"
    )
    if abs(change) > max(1.0, STEADY * float(np.median(rise))):
        words += f"; not steady, it changed by {change:+.1f} counts"
    return words
