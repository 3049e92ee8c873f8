"""The force law of each tactel and its fit: conductance = gain (force - break)^exponent.

The break force is negative where the assembly presses a tactel by itself. All tactels are
fitted at once: for every break force of a ladder the other two follow in closed form from
logarithms; the best of them starts damped Gauss-Newton steps (Levenberg, Marquardt) on the
conductances. The covariance is that of the linearised fit, widened where the scatter of the
loads about the law is more than their errors. Thesis 4.2. N, S.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.calibration.settings import LAW_FIT

Array = NDArray[np.float64]


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
    """Fit the law of every tactel.

    Parameters
    ----------
    force_n, read_s, error_s
        (L, T) N, S, S: force, conductance and its standard deviation, of L loads.
    used
        (L, T) readings that take part.
    preloaded
        (T,) tactels whose break force may be negative.
    """
    weight = np.where(used, 1.0 / error_s, 0.0)
    firm = used & (read_s > LAW_FIT.firm * error_s) & (force_n > 0)
    least = np.where(firm, force_n, np.inf).min(axis=0)  # smallest force that is clearly felt
    least = np.where(np.isfinite(least), np.maximum(least, LAW_FIT.tiny_n), 1.0)
    theta = _best_start(force_n, read_s, weight, firm, least, preloaded)
    damping, cost = np.full(least.size, 1e-3), _cost(theta, force_n, read_s, weight, least)
    for _ in range(LAW_FIT.steps):
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
    up = np.linspace(0.0, 0.98, LAW_FIT.break_forces)
    down = -np.geomspace(1e-3, 10.0, LAW_FIT.break_forces)
    best, lowest = np.zeros((least.size, 3)), np.full(least.size, np.inf)
    share = np.where(firm, (read * weight) ** 2, 0.0)
    height = np.log(np.where(firm, read, 1.0))
    for step in np.concatenate([down, up]):
        broken = step * least if step >= 0 else np.full(least.size, step)
        over = np.log(np.maximum(force - broken, LAW_FIT.tiny_n))
        total = np.maximum(share.sum(axis=0), 1e-300)
        x, z = (share * over).sum(axis=0) / total, (share * height).sum(axis=0) / total
        width = (share * (over - x) ** 2).sum(axis=0) / total
        slope = (share * (over - x) * (height - z)).sum(axis=0) / total
        exponent = np.clip(np.where(width > 1e-12, slope / np.maximum(width, 1e-12), 1.0),
                           *LAW_FIT.exponents)  # fmt: skip
        theta = np.stack([z - exponent * x, exponent, broken], axis=1)
        cost = _cost(theta, force, read, weight, least)
        take = (cost < lowest) & (preloaded | (step >= 0))
        best[take], lowest[take] = theta[take], cost[take]
    return best


def _linearise(theta: Array, force: Array, read: Array, weight: Array, least: Array
                ) -> tuple[Array, Array]:  # fmt: skip
    """Return (L + 1, T, 3) slopes and (L + 1, T) residuals, in errors.

    The last row holds the break force where it is known to be: below the smallest force that
    is felt, which counts as an even prior.
    """
    gain, exponent, broken = np.exp(theta[:, 0]), theta[:, 1], theta[:, 2]
    over = np.maximum(force - broken, LAW_FIT.tiny_n)
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
    bounded[:, 1] = np.clip(theta[:, 1], *LAW_FIT.exponents)
    lowest = np.where(preloaded, -np.inf, 0.0)
    bounded[:, 2] = np.clip(theta[:, 2], lowest, 0.99 * least)
    return bounded


def _diagonal(normal: Array) -> Array:
    index = np.arange(3)
    diagonal = np.zeros_like(normal)
    diagonal[:, index, index] = np.maximum(normal[:, index, index], 1e-12)
    return diagonal
