"""Shares with their intervals, errors with their sizes, and how honest a covariance is.

Wilson's interval holds for shares near 0 and 1 too, where most of ours are. The squared
error over the covariance (chi2, three degrees of freedom: x, y, turn) lies under the chi2
distribution's quantile as often as that says, if the covariance is right.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

Array = NDArray[np.float64]

Z_95 = 1.959963984540054  #: two-sided 95 % of the normal distribution
FREEDOM = 3  #: degrees of freedom of a pose on a face
QUANTILES = (0.5, 0.9, 0.95, 0.99)
DIGITS = 6  #: significant ones of what is written


def wilson(hits: int, of: int, z: float = Z_95) -> tuple[float, float]:
    """Return the interval of a share; 0 ... 1 where nothing was counted.

    Examples
    --------
    >>> low, high = wilson(0, 100_000)
    >>> low, round(high, 7)
    (0.0, 3.84e-05)
    """
    if of == 0:
        return 0.0, 1.0
    share, spread = hits / of, z * z / of
    middle = (share + spread / 2) / (1 + spread)
    half = z * math.sqrt(share * (1 - share) / of + spread / (4 * of)) / (1 + spread)
    low = 0.0 if hits == 0 else middle - half
    high = 1.0 if hits == of else middle + half
    return max(0.0, low), min(1.0, high)


def share_of(hits: int, of: int) -> dict[str, Any]:
    """Return a share with its count and its 95 % interval."""
    low, high = wilson(hits, of)
    return {
        "count": hits,
        "of": of,
        "share": None if of == 0 else round_digits(hits / of),
        "low": round_digits(low),
        "high": round_digits(high),
    }


def rms(values: Array) -> float | None:
    """Return the root of the mean square; None where there is nothing."""
    return round_digits(math.sqrt(float(np.mean(values**2)))) if len(values) else None


def quantiles_of(values: Array, at: tuple[float, ...]) -> list[float | None]:
    """Return quantiles; None where there is nothing."""
    if len(values) == 0:
        return [None] * len(at)
    return [round_digits(float(value)) for value in np.quantile(values, at)]


def chi2_quantile(probability: float, freedom: int = FREEDOM) -> float:
    """Return below what chi2 lies with a probability.

    Examples
    --------
    >>> round(chi2_quantile(0.95), 3)
    7.815
    """
    return 2.0 * float(gammaincinv(freedom / 2, probability))


def calibration(chi2: Array) -> list[dict[str, Any]]:
    """Return how many errors lie inside the ellipsoids that should hold `QUANTILES` of them."""
    return [
        {"expected": p, **share_of(int((chi2 < chi2_quantile(p)).sum()), len(chi2))}
        for p in QUANTILES
    ]


def round_digits(value: float, digits: int = DIGITS) -> float:
    """Return a number with so many significant digits; -0 becomes 0."""
    if value == 0 or not math.isfinite(value):
        return 0.0 if value == 0 else value
    return float(f"{value:.{digits}g}")
