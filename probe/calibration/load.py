"""Known loads: what was read, and the force on each tactel while it was.

An air cushion or a bag presses every tactel alike; a dead weight stands on a known footprint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.calibration.average import Average, average_frames
from probe.errors import CalibrationError


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationLoad:
    """Frames under one steady load."""

    name: str
    read: Average
    forces_n: NDArray[np.float64]  #: (rows, columns) N on each tactel


def known_load(counts: ArrayLike, forces_n: ArrayLike, name: str = "") -> CalibrationLoad:
    """Return a load whose force on each tactel is known.

    Parameters
    ----------
    counts
        (N, rows, columns) counts, frames of the steady load.
    forces_n
        (rows, columns) N on each tactel.
    name
        For messages and for the calibration file.

    Raises
    ------
    CalibrationError
        If frames or forces are none, or do not fit together.
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
    """Return a load of known total force, even over its footprint.

    Parameters
    ----------
    counts
        (N, rows, columns) counts.
    total_n
        Force of the whole load, N: a dead weight, or a cushion's pressure times the area.
    footprint
        (rows, columns) share of each tactel that is covered; all of every one by default.
    name
        For messages and for the calibration file.

    Raises
    ------
    CalibrationError
        As `known_load`; or if the footprint is empty.
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
