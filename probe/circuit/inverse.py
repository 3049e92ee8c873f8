"""Counts -> conductances, with their uncertainty, and the tactels that are lost.

    grounded, virtual   closed form, g = y / (1 - column_ohm sum of y) down the column; with
                        a row resistance, Newton on the network
    floating            the convex problem of `network.solve_floating`

Noise goes through the derivative of the same equations. A tactel whose conductance comes out
below its own standard deviation is `lost`: the reading only bounds it (by a few sigma). A
saturated reading is a lower bound only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.circuit.electronics import Electronics
from probe.circuit.fsr import Image
from probe.circuit.network import FloatingSolution, solve_floating, transconductances, transfers
from probe.circuit.reading import unscan_shares
from probe.errors import CircuitError

MOST_STEPS = 30  # of Newton's method with a row resistance
TOLERANCE = 1e-12  # relative, of a resistance
FINEST = 1e-6  # least relative error of a resistance
EDGE = 1e-9  # of 1: a column whose currents add up to all that the supply can give


@dataclass(frozen=True, slots=True, eq=False)
class ConductanceEstimate:
    """Conductances that were read."""

    conductance_s: Image  #: (..., rows, columns) S; nan where the readings contradict each other
    sigma_s: Image  #: (..., rows, columns) S, standard deviation; inf where saturated
    lost: NDArray[np.bool_]  #: (..., rows, columns) below its noise, saturated or contradictory


def invert_readings(
    counts: ArrayLike,
    electronics: Electronics,
    *,
    bias_counts: ArrayLike | None = None,
    sigma_counts: ArrayLike | None = None,
) -> ConductanceEstimate:
    """Return the conductances behind counts (..., rows, columns), or means of counts.

    Parameters
    ----------
    counts, electronics
        The readings, and the board that made them.
    bias_counts
        Reading at 0 V, per tactel or one for all; the board's by default.
    sigma_counts
        Standard deviation of `counts`; by default that of one sample: rounding, idle noise
        and the noise of the contact.

    Raises
    ------
    CircuitError
        If the counts are no numbers or outside the ADC's range.

    Examples
    --------
    >>> from probe.circuit import Electronics, invert_readings
    >>> counts = np.full((16, 16), 4.0)
    >>> counts[3, 4] = 300
    >>> found = invert_readings(counts, Electronics())
    >>> int((~found.lost).sum()), bool(found.lost[3, 4])
    (1, False)
    """
    e = electronics
    read = np.asarray(counts, dtype=np.float64)
    if read.ndim < 2 or not np.isfinite(read).all() or (read < 0).any() or (read > e.full).any():
        raise CircuitError(
            f"counts of shape {read.shape}, or outside 0 ... {e.full}",
            fix="give (..., rows, columns) counts of this board, before any bias is taken off",
        )
    bias = e.bias_lsb * e.lsb if bias_counts is None else np.asarray(bias_counts, float)
    saturated = read >= e.full
    sigma = _sample_sigma(read - bias, e) if sigma_counts is None else np.asarray(sigma_counts)
    beyond = max(e.volts_ratio - 1.0, 1.0) / np.sqrt(12.0)
    spread = np.where(saturated, beyond, np.maximum(sigma, 1e-12) / e.full)
    share = unscan_shares((read - bias) / e.full, e)
    found = (_invert_floating if e.readout == "floating" else _invert_driven)(share, spread, e)
    found.sigma_s[saturated] = np.inf
    found.lost[saturated] = True
    return found


def _sample_sigma(signal: Image, e: Electronics) -> Image:
    noise, lsb = e.noise, e.lsb
    contact = noise.contact_lsb * lsb * np.maximum(signal, 0.0)
    return np.sqrt((noise.idle_lsb * lsb) ** 2 + 1.0 / 12.0 + contact)


def _invert_driven(share: Image, spread: Image, e: Electronics) -> ConductanceEstimate:
    scale = e.volts_ratio * (e.load_ohm if e.readout == "grounded" else e.feedback_ohm)
    column = e.load_ohm if e.readout == "grounded" else e.column_ohm
    current, noise = share / scale, spread / scale
    room = 1.0 - column * current.sum(axis=-2, keepdims=True)
    possible = np.broadcast_to(room > EDGE, current.shape)
    room = np.where(room > EDGE, room, np.nan)
    g = current / room
    variance = (noise / room) ** 2 * np.maximum(1.0 + 2.0 * column * g, 1.0) + (
        column * np.maximum(g, 0.0) / room
    ) ** 2 * (noise**2).sum(axis=-2, keepdims=True)
    sigma = np.sqrt(variance)
    if e.row_ohm > 0:
        g, sigma = _undo_row_resistance(g, sigma, current, noise, e.row_ohm, column)
    lost = ~possible | ~(g >= sigma)
    return ConductanceEstimate(np.maximum(g, 0.0), np.where(possible, sigma, np.inf), lost)


def _undo_row_resistance(
    start: Image, first: Image, current: Image, noise: Image, row: float, column: float
) -> tuple[Image, Image]:
    shape = current.shape
    found, sigma = np.empty(shape), np.empty(shape)
    for index in np.ndindex(shape[:-2]):
        if np.isfinite(start[index]).all():
            found[index], sigma[index] = _newton(start[index], current[index], noise[index],
                                                 row, column)  # fmt: skip
        else:
            found[index], sigma[index] = np.nan, first[index]
    return found, sigma


def _newton(
    start: Image, current: Image, noise: Image, row: float, column: float
) -> tuple[Image, Image]:
    g = np.maximum(start, 0.0)
    floor = TOLERANCE * float(np.abs(current).max()) + np.finfo(float).tiny
    error = current - transconductances(g, row, column)
    for _ in range(MOST_STEPS):
        slopes = transfers(g, row, column)
        if np.abs(error).max() <= floor:
            break
        move = np.linalg.solve(slopes, error.ravel()).reshape(g.shape)
        length = 1.0
        while length > 1e-6:
            there = np.maximum(g + length * move, 0.0)
            ahead = current - transconductances(there, row, column)
            if np.abs(ahead).sum() < np.abs(error).sum():
                break
            length /= 2
        else:
            break
        g, error = there, ahead
    if np.abs(error).max() > 5.0 * float(noise.max()) + floor:
        return np.full_like(g, np.nan), np.full_like(g, np.inf)
    back = np.linalg.inv(slopes)
    return g, np.sqrt(np.square(back) @ np.square(noise).ravel()).reshape(g.shape)


def _invert_floating(share: Image, spread: Image, e: Electronics) -> ConductanceEstimate:
    shape = share.shape
    g, sigma, lost = np.empty(shape), np.empty(shape), np.empty(shape, np.bool_)
    series = e.load_ohm + e.row_ohm + e.column_ohm
    most = e.volts_ratio * e.load_ohm / series  # of share: a short between row and column
    for index in np.ndindex(shape[:-2]):
        offered = np.clip(share[index], spread[index], most * (1.0 - 1e-6))
        resistance = e.volts_ratio * e.load_ohm / offered - series
        ratio = e.volts_ratio * e.load_ohm / (offered**2 * resistance)
        relative = np.minimum(spread[index] * ratio, 1.0).ravel()
        found = solve_floating(resistance)
        deviation = _deviation(found, relative)
        g[index] = found.conductance_s
        sigma[index] = (deviation / resistance.ravel()).reshape(shape[-2:])
        lost[index] = (found.own.ravel() <= deviation).reshape(shape[-2:])
    return ConductanceEstimate(g, sigma, lost)


def _deviation(found: FloatingSolution, relative: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the deviation of y = gR.

    Readings with relative errors `relative` and the bounds 0 <= y <= 1 (as an even prior, whose
    variance is 1/12) together; the bounds keep a tactel that its neighbours hide from blurring
    those that are seen.
    """
    weighted = found.hessian / np.maximum(relative, FINEST)[:, None]
    information = weighted.T @ weighted
    information[np.diag_indices_from(information)] += 12.0
    deviation: NDArray[np.float64] = np.sqrt(np.diagonal(np.linalg.inv(information)))
    return deviation
