"""Frames at rest and under known loads -> the calibration of a sensor. Thesis 4.2.

Bias, noise, condition of every tactel, then its law: conductance = gain (force - break)^exponent,
N, S. The break force is negative where the assembly presses a tactel by itself. Loads that do
not determine the laws are refused, with the load that is missing.

All tactels are fitted at once: for every break force of a ladder the other two follow in closed
form from logarithms; the best of them starts damped Gauss-Newton steps (Levenberg, Marquardt) on
the conductances. The covariance is that of the linearised fit, widened where the scatter of the
loads about the law is more than their errors.

The laws of the sound tactels scatter about a mean by more than the errors of their fits; that
excess is the spread of the sensor itself. Mean and spread serve as the prior of every tactel
(empirical Bayes): a law that its own loads determine well stays, one that they do not goes
towards the mean. Parameters are ln gain, exponent, break force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.calibration.condition import (
    CLEAR,
    LAW,
    LEVELS,
    RATIO,
    REPEAT,
    check_loads,
    common_bias,
    demand_loads,
    judge_tactels,
    raised_tactels,
    tactel_words,
)
from probe.calibration.file import Calibration, Condition, Image
from probe.calibration.load import Average, CalibrationLoad, average_frames
from probe.circuit import Electronics, invert_readings
from probe.errors import CalibrationError

Array = NDArray[np.float64]

EXPONENTS = (0.3, 3.0)  # least and largest that is believed
MOST_STEPS = 40  # of Gauss and Newton
BREAK_FORCES = 24  # tried
FIRM = 3.0  # sigmas from which a reading takes part in the start
TINY_N = 1e-9  # logarithms stay finite
POOLED_TACTELS = 24  # least number that gives a spread
POOL_FLOOR = (0.02, 0.005, 0.001)  # ln gain, exponent, N: no sensor is more even
OUTLYING = 4.0  # robust deviations; tactels farther out are not pooled
_UPPER = np.triu_indices(3)


def calibration_from(
    rest_counts: ArrayLike,
    loads: Sequence[CalibrationLoad],
    *,
    sensor: str,
    made: str = "",
    board: Electronics | None = None,
    full: int = 1023,
) -> Calibration:
    """Calibrate a sensor.

    Parameters
    ----------
    rest_counts
        (N, rows, columns) counts, frames with nothing on the sensor.
    loads
        Known loads; on every tactel 3 or more of different force, over a ratio of 3.
    sensor, made
        Its name (a file is used only with that sensor), and when, as text.
    board
        The electronics, whose equations take counts to conductances; None takes counts above
        the bias for conductances, which is right where tactels do not disturb each other.
    full
        Highest count, where no board says it.

    Raises
    ------
    CalibrationError
        If the loads do not determine the law of a live tactel.
    """
    rest = average_frames(rest_counts, "rest")
    for load in loads:
        if load.read.mean.shape != rest.mean.shape:
            raise CalibrationError(
                f"load {load.name} has frames of {load.read.mean.shape}, rest of {rest.mean.shape}",
                fix="calibrate one sensor at a time",
            )
    if not loads:
        raise CalibrationError(
            "no loads were given", fix=f"give {LEVELS} or more, over a ratio of {RATIO:g}"
        )
    top = board.full if board else full
    high = raised_tactels(rest, top)
    bias = np.where(high, common_bias(rest), rest.mean)
    reads = [rest, *(load.read for load in loads)]
    force = np.stack([np.zeros(rest.mean.shape), *(load.forces_n for load in loads)])
    saturated = np.stack([read.highest >= top for read in reads])
    read, sigma = _conductances(reads, bias, board)
    condition = judge_tactels(force, read, sigma, high, saturated)
    error = np.hypot(sigma, LAW * read)
    usable = np.isfinite(read) & np.isfinite(error) & ~saturated
    firm = usable & (read > CLEAR * error) & (force > 0)
    known = check_loads(force, firm)
    shorted = ((condition == Condition.STUCK) & saturated[0]).any(axis=0)
    able = np.isin(condition, (Condition.SOUND, Condition.PRELOADED))
    condition[able & shorted & (known.few | known.near)] = Condition.HIDDEN
    live = able & (condition != Condition.HIDDEN)
    demand_loads(known, force, saturated, live)
    usable[0] &= condition == Condition.PRELOADED
    law = fit_laws(
        force[:, live],
        np.where(usable, read, 0.0)[:, live],
        np.where(usable, error, 1.0)[:, live],
        usable[:, live],
        (condition == Condition.PRELOADED)[live],
    )
    law = shrink_laws(law, (condition == Condition.SOUND)[live])
    if not np.isfinite(law.covariance).all():
        unknown = np.zeros_like(live)
        unknown[live] = ~np.isfinite(law.covariance).all(axis=(1, 2))
        raise CalibrationError(
            f"the loads do not determine the law of {tactel_words(unknown)}",
            fix="add lighter and heavier loads on them",
        )

    def spread(values: Image, shape: tuple[int, ...] = ()) -> Image:
        image = np.full((*live.shape, *shape), np.nan)
        image[live] = values
        return image

    return Calibration(
        sensor=sensor, made=made, board=board, full=top,
        loads=tuple(load.name for load in loads), condition=condition,
        bias_counts=bias, rest_counts=rest.mean, noise_counts=rest.noise,
        gain_s=spread(law.gain_s),
        exponent=spread(law.exponent),
        break_n=spread(law.break_n),
        covariance=spread(law.covariance[:, _UPPER[0], _UPPER[1]], (6,)),
        most_n=np.where(live, known.highest_n, np.nan),
        scatter=float(np.sqrt((law.scatter**2).mean())), repeat=REPEAT
    )  # fmt: skip


def _conductances(
    reads: Sequence[Average], bias: Image, board: Electronics | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (L, rows, columns) conductances and their deviations."""
    mean = np.stack([read.mean for read in reads])
    sigma = np.stack([read.sigma for read in reads])
    if board is None:
        return mean - bias, sigma
    found = invert_readings(mean, board, bias_counts=bias, sigma_counts=sigma)
    return found.conductance_s, found.sigma_s


@dataclass(frozen=True, slots=True, eq=False)
class FittedLaw:
    """Laws of T tactels."""

    gain_s: Array  #: (T,) S at 1 N above the break force
    exponent: Array  #: (T,)
    break_n: Array  #: (T,) N
    covariance: Array  #: (T, 3, 3) of ln gain, exponent, break force
    scatter: Array  #: (T,) root mean square of (read - law) / error


def law_s(force_n: Array, gain_s: Array, exponent: Array, break_n: Array) -> Array:
    """Return the conductance (S) at a force (N)."""
    over = np.maximum(force_n - break_n, 0.0)
    conductance: Array = gain_s * over**exponent
    return conductance


def fit_laws(force_n: Array, read_s: Array, error_s: Array, used: NDArray[np.bool_],
           preloaded: NDArray[np.bool_]) -> FittedLaw:  # fmt: skip
    """Fit the laws of T tactels to L loads.

    Force (N), conductance (S), its standard deviation, and the readings that take part are (L, T);
    `preloaded` (T,) are tactels whose break force may be negative.
    """
    weight = np.where(used, 1.0 / error_s, 0.0)
    firm = used & (read_s > FIRM * error_s) & (force_n > 0)
    least = np.where(firm, force_n, np.inf).min(axis=0)  # smallest force that is clearly read
    least = np.where(np.isfinite(least), np.maximum(least, TINY_N), 1.0)
    theta = _best_start(force_n, read_s, weight, firm, least, preloaded)
    damping, cost = np.full(least.size, 1e-3), _cost(theta, force_n, read_s, weight, least)
    for _ in range(MOST_STEPS):
        slopes, residual = _linearise(theta, force_n, read_s, weight, least)
        normal = np.einsum("lti,ltj->tij", slopes, slopes)
        descent = np.einsum("lti,lt->ti", slopes, residual)
        damped = normal + damping[:, None, None] * _diagonal(normal)
        move = np.linalg.solve(damped, descent[..., None])[..., 0]
        ahead = _clip_to_bounds(theta + move, least, preloaded)
        there = _cost(ahead, force_n, read_s, weight, least)
        better = there < cost
        theta = np.where(better[:, None], ahead, theta)
        done = bool((cost - there <= 1e-10 * cost)[better].all()) and bool(better.any())
        cost = np.where(better, there, cost)
        damping = np.clip(np.where(better, damping / 5, damping * 5), 1e-12, 1e12)
        if done or bool((damping > 1e10).all()):
            break
    slopes, residual = _linearise(theta, force_n, read_s, weight, least)
    normal = np.einsum("lti,ltj->tij", slopes, slopes)
    freedom = np.maximum(used.sum(axis=0) - 3, 1)
    scatter = np.sqrt((residual[:-1] ** 2).sum(axis=0) / freedom)
    covariance = np.linalg.inv(normal) * np.maximum(scatter, 1.0)[:, None, None] ** 2
    return FittedLaw(np.exp(theta[:, 0]), theta[:, 1], theta[:, 2], covariance, scatter)


def _best_start(force: Array, read: Array, weight: Array, firm: NDArray[np.bool_], least: Array,
             preloaded: NDArray[np.bool_]) -> Array:  # fmt: skip
    """Return the best of a ladder of break forces, (T, 3) ln gain, exponent, break force."""
    up = np.linspace(0.0, 0.98, BREAK_FORCES)
    down = -np.geomspace(1e-3, 10.0, BREAK_FORCES)
    best, lowest = np.zeros((least.size, 3)), np.full(least.size, np.inf)
    share = np.where(firm, (read * weight) ** 2, 0.0)
    height = np.log(np.where(firm, read, 1.0))
    for step in np.concatenate([down, up]):
        broken = step * least if step >= 0 else np.full(least.size, step)
        over = np.log(np.maximum(force - broken, TINY_N))
        total = np.maximum(share.sum(axis=0), 1e-300)
        x, z = (share * over).sum(axis=0) / total, (share * height).sum(axis=0) / total
        width = (share * (over - x) ** 2).sum(axis=0) / total
        slope = (share * (over - x) * (height - z)).sum(axis=0) / total
        exponent = np.clip(np.where(width > 1e-12, slope / np.maximum(width, 1e-12), 1.0),
                           *EXPONENTS)  # fmt: skip
        theta = np.stack([z - exponent * x, exponent, broken], axis=1)
        cost = _cost(theta, force, read, weight, least)
        take = (cost < lowest) & (preloaded | (step >= 0))
        best[take], lowest[take] = theta[take], cost[take]
    return best


def _linearise(theta: Array, force: Array, read: Array, weight: Array, least: Array
                ) -> tuple[Array, Array]:  # fmt: skip
    """Return (L + 1, T, 3) slopes and (L + 1, T) residuals, in errors.

    The last row holds the break force where it is known to be: below the smallest force that
    is read, which counts as an even prior.
    """
    gain, exponent, broken = np.exp(theta[:, 0]), theta[:, 1], theta[:, 2]
    over = np.maximum(force - broken, TINY_N)
    model = np.where(force > broken, gain * over**exponent, 0.0)
    slopes = np.zeros((len(force) + 1, theta.shape[0], 3))
    slopes[:-1, :, 0] = weight * model
    slopes[:-1, :, 1] = weight * model * np.log(over)
    slopes[:-1, :, 2] = -weight * model * exponent / over
    slopes[-1, :, 2] = np.sqrt(12.0) / np.maximum(least, np.abs(broken))
    residual = np.vstack([weight * (read - model), np.zeros(theta.shape[0])])
    return slopes, residual


def _cost(theta: Array, force: Array, read: Array, weight: Array, least: Array) -> Array:
    _, residual = _linearise(theta, force, read, weight, least)
    cost: Array = (residual**2).sum(axis=0)
    return cost


def _clip_to_bounds(theta: Array, least: Array, preloaded: NDArray[np.bool_]) -> Array:
    bounded = theta.copy()
    bounded[:, 0] = np.clip(theta[:, 0], -700.0, 700.0)
    bounded[:, 1] = np.clip(theta[:, 1], *EXPONENTS)
    lowest = np.where(preloaded, -np.inf, 0.0)
    bounded[:, 2] = np.clip(theta[:, 2], lowest, 0.99 * least)
    return bounded


def _diagonal(normal: Array) -> Array:
    index = np.arange(3)
    diagonal = np.zeros_like(normal)
    diagonal[:, index, index] = np.maximum(normal[:, index, index], 1e-12)
    return diagonal


def shrink_laws(law: FittedLaw, alike: NDArray[np.bool_]) -> FittedLaw:
    """Draw the laws of T tactels together as far as their own loads leave open.

    `alike` (T,) are those that may be taken together: not the preloaded ones.
    """
    theta = np.stack([np.log(law.gain_s), law.exponent, law.break_n], axis=1)
    middle = np.median(theta[alike], axis=0) if alike.any() else np.zeros(3)
    width = 1.4826 * np.median(np.abs(theta[alike] - middle), axis=0) if alike.any() else POOL_FLOOR
    usual = alike & (np.abs(theta - middle) <= OUTLYING * np.maximum(width, POOL_FLOOR)).all(axis=1)
    if usual.sum() < POOLED_TACTELS:
        return law
    mean = theta[usual].mean(axis=0)
    excess = np.cov(theta[usual].T) - np.median(law.covariance[usual], axis=0)
    values, axes = np.linalg.eigh(excess / np.outer(POOL_FLOOR, POOL_FLOOR))
    spread = (axes * np.maximum(values, 1.0)) @ axes.T * np.outer(POOL_FLOOR, POOL_FLOOR)
    gain = law.covariance @ np.linalg.inv(law.covariance + spread)
    drawn = theta + np.einsum("tij,tj->ti", gain, mean - theta)
    narrowed = law.covariance - gain @ law.covariance
    drawn[:, 1] = np.clip(drawn[:, 1], *EXPONENTS)
    drawn[:, 2] = np.maximum(drawn[:, 2], 0.0)
    kept = np.where(usual[:, None], drawn, theta)
    symmetric = (narrowed + np.swapaxes(narrowed, 1, 2)) / 2
    covariance = np.where(usual[:, None, None], symmetric, law.covariance)
    return FittedLaw(np.exp(kept[:, 0]), kept[:, 1], kept[:, 2], covariance, law.scatter)
