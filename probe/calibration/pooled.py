"""What the tactels of one sensor have in common helps where few loads tell of one.

The laws of its sound tactels scatter about a mean by more than the errors of their fits; that
excess is the spread of the sensor itself. Mean and spread serve as the prior of every tactel
(empirical Bayes): a law that its own loads determine well stays, one that they do not goes
towards the mean. Parameters are ln gain, exponent, break force.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from probe.calibration.law import FittedLaw
from probe.calibration.settings import LAW_FIT, POOL


def shrink_laws(law: FittedLaw, alike: NDArray[np.bool_]) -> FittedLaw:
    """Draw laws together as far as their own loads leave open.

    Parameters
    ----------
    law
        Of T tactels.
    alike
        (T,) those that may be taken together: not the preloaded ones.
    """
    theta = np.stack([np.log(law.gain_s), law.exponent, law.break_n], axis=1)
    middle = np.median(theta[alike], axis=0) if alike.any() else np.zeros(3)
    width = 1.4826 * np.median(np.abs(theta[alike] - middle), axis=0) if alike.any() else POOL.floor
    usual = alike & (np.abs(theta - middle) <= POOL.outlying * np.maximum(width, POOL.floor)).all(
        axis=1
    )
    if usual.sum() < POOL.tactels:
        return law
    mean = theta[usual].mean(axis=0)
    excess = np.cov(theta[usual].T) - np.median(law.covariance[usual], axis=0)
    values, axes = np.linalg.eigh(excess / np.outer(POOL.floor, POOL.floor))
    spread = (axes * np.maximum(values, 1.0)) @ axes.T * np.outer(POOL.floor, POOL.floor)
    gain = law.covariance @ np.linalg.inv(law.covariance + spread)
    drawn = theta + np.einsum("tij,tj->ti", gain, mean - theta)
    narrowed = law.covariance - gain @ law.covariance
    drawn[:, 1] = np.clip(drawn[:, 1], *LAW_FIT.exponents)
    drawn[:, 2] = np.maximum(drawn[:, 2], 0.0)
    kept = np.where(usual[:, None], drawn, theta)
    symmetric = (narrowed + np.swapaxes(narrowed, 1, 2)) / 2
    return replace(
        law,
        gain_s=np.exp(kept[:, 0]),
        exponent=kept[:, 1],
        break_n=kept[:, 2],
        covariance=np.where(usual[:, None, None], symmetric, law.covariance),
    )
