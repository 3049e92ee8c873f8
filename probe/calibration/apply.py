"""Counts -> newtons by a calibration, and back; whether a calibration still holds.

Without a calibration counts are read as they are: any monotone, roughly proportional response.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.calibration.condition import tactel_words
from probe.calibration.file import Calibration, Condition, Image
from probe.calibration.fit import law_s
from probe.calibration.load import average_frames
from probe.circuit import ConductanceEstimate, invert_readings
from probe.circuit.reading import scan_shares, shares
from probe.errors import CalibrationError
from probe.frame import Frame

SIGMAS = 3.0  # of a conductance from which it is a force
LEAK_S = 1e-9  # joins the network of a board with floating rows
DRIFT_COUNTS = 2.0  # shift of the bias that warns
DRIFT_SIGMAS = 5.0  # of the bias: a shift is one from so many standard deviations


@dataclass(frozen=True, slots=True, eq=False)
class CalibratedImage:
    """An image in newtons, or in counts where there is no calibration."""

    values: Image  #: (..., rows, columns) N, 0 or more; 0 where bad
    sigma: Image  #: (..., rows, columns) N, standard deviation; inf where bad
    bad: NDArray[np.bool_]  #: (..., rows, columns) dead, stuck, hidden, or saturated in this image
    unit: Literal["N", "counts"]


def calibrate_image(
    image: Frame | ArrayLike, calibration: Calibration | None = None
) -> CalibratedImage:
    """Return the forces that a frame, or counts (..., rows, columns), show.

    Without a calibration counts are read as they are. sigma holds the noise of one frame, the
    uncertainty of the law, and the share that hysteresis and creep leave open; readings not above
    three sigma of the noise are 0 N.

    Raises CalibrationError, CircuitError: if the image has another shape than the calibration, or a
    count is beyond the board's range.

    Examples
    --------
    >>> read = calibrate_image(np.full((16, 16), 7))
    >>> read.unit, float(read.values[0, 0])
    ('counts', 7.0)
    """
    counts = np.asarray(image.counts if isinstance(image, Frame) else image, dtype=np.float64)
    if calibration is None:
        rounding = np.full(counts.shape, 1 / np.sqrt(12.0))
        return CalibratedImage(counts, rounding, np.zeros(counts.shape, np.bool_), "counts")
    c = calibration
    if counts.shape[-2:] != c.shape:
        raise CalibrationError(
            f"an image of {counts.shape}, the calibration of {c.sensor} is for {c.shape}",
            fix="use the calibration of the sensor that read it",
        )
    found = _conductances(counts, c)
    g, noise = found.conductance_s, found.sigma_s
    bad = c.bad | np.isnan(g) | (counts >= c.full)
    clear = ~bad & (g > SIGMAS * noise)
    safe = np.where(clear, g, np.where(c.bad, 1.0, np.maximum(SIGMAS * noise, np.nan_to_num(g))))
    with np.errstate(invalid="ignore", over="ignore"):
        over = (safe / c.gain_s) ** (1.0 / c.exponent)
        variance = (over * noise / (c.exponent * safe)) ** 2
        variance += _of_the_law(over, c) + (c.repeat * over) ** 2
        force = np.where(clear, np.maximum(c.break_n + over, 0.0), 0.0)
        silent = np.maximum(c.break_n, 0.0) + over / SIGMAS
        sigma = np.where(bad, np.inf, np.where(clear, np.sqrt(variance), silent))
    return CalibratedImage(force, sigma, bad, "N")


def expected_counts(forces_n: ArrayLike, calibration: Calibration) -> Image:
    """Return the readings of the calibrated sensor under forces: inverse of `calibrate_image`.

    Forces are (..., rows, columns) N, the counts not rounded; dead and stuck tactels conduct as at
    rest.
    """
    c = calibration
    forces = np.asarray(forces_n, dtype=np.float64)
    if forces.shape[-2:] != c.shape or not np.isfinite(forces).all() or (forces < 0).any():
        raise CalibrationError(
            f"forces of shape {forces.shape}, or below 0, for a sensor of {c.shape}",
            fix="give the force on every tactel, N",
        )
    rest = np.nan_to_num(_conductances(c.rest_counts, c).conductance_s)
    held = np.where(c.condition == Condition.STUCK, rest, 0.0)
    g = np.where(c.bad, held, law_s(forces, c.gain_s, c.exponent, c.break_n))
    if c.board is None:
        read = g + c.bias_counts
    else:
        if c.board.readout == "floating":
            g = g + LEAK_S
        read = scan_shares(shares(g, c.board), c.board) * c.full + c.bias_counts
    return np.clip(read, 0.0, float(c.full))


def _conductances(counts: Image, c: Calibration) -> ConductanceEstimate:
    """Return conductances by the board, or counts above the bias where there is none."""
    if c.board is not None:
        return invert_readings(counts, c.board, bias_counts=c.bias_counts)
    above = counts - c.bias_counts
    sigma = np.broadcast_to(np.sqrt(c.noise_counts**2 + 1.0 / 12.0), above.shape)
    lost = above < sigma
    return ConductanceEstimate(np.maximum(above, 0.0), sigma, lost)


def _of_the_law(over: Image, c: Calibration) -> Image:
    """Return the variance (N^2) that the law's own uncertainty gives a force."""
    by_gain = -over / c.exponent
    by_exponent = by_gain * np.log(np.maximum(over, 1e-12))
    v = np.moveaxis(c.covariance, -1, 0)
    variance: Image = (
        by_gain**2 * v[0] + by_exponent**2 * v[3] + v[5]
        + 2.0 * (by_gain * by_exponent * v[1] + by_gain * v[2] + by_exponent * v[4])
    )  # fmt: skip
    return np.maximum(variance, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """The change since the calibration."""

    bias_counts: Image  #: (rows, columns) reading at rest now, less then
    warning: str  #: empty while the calibration holds


def drift_of(calibration: Calibration, rest_counts: ArrayLike) -> Drift:
    """Compare a sensor with its calibration, by frames (N, rows, columns) at rest now.

    Raises CalibrationError: the frames are of another shape, or too few.
    """
    rest = average_frames(rest_counts, "rest")
    if rest.mean.shape != calibration.shape:
        raise CalibrationError(
            f"frames of {rest.mean.shape}, the calibration is for {calibration.shape}",
            fix="use the calibration of the sensor that read them",
        )
    shift = rest.mean - calibration.rest_counts
    moved = ~calibration.bad & (np.abs(shift) > np.maximum(DRIFT_COUNTS, DRIFT_SIGMAS * rest.sigma))
    if not moved.any():
        return Drift(shift, "")
    by = f"moved by up to {np.abs(shift[moved]).max():.3g} counts"
    return Drift(shift, f"the bias of {tactel_words(moved)} {by}; calibrate again")
