"""How far readings scatter about a model, in two parts that one touch tells apart.

Residuals + what each part would do at each tactel -> variances. One part goes with what is felt
(gains, lengths of tips, noise), the other with the image's slope (tips that stand aside): a sensor
whose gains are even and whose tips are not would otherwise pass for a better one than it is. Errors
are Student's, so that a dead tactel or a spike weighs little. Restricted maximum likelihood by
expectation and maximisation: K. L. Lange, R. J. A. Little, J. M. G. Taylor, J. Am. Stat. Assoc. 84
(1989) 881; D. A. Harville, same journal, 72 (1977) 320.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.settings import SpreadSettings
from recognizer.touch.symbols.covariance import invert_normal

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class TactelScatter:
    """Standard deviations of psi on a covered tactel, and of the place of a tip."""

    felt: float
    aside_mm: float

    def variances(self, parts: Array) -> Array:
        """Return (n,) of forces; `parts` (2, n) are those of a spread of 1 and 1."""
        return np.asarray(self.felt**2 * parts[0] + self.aside_mm**2 * parts[1])

    def log_likelihood(self, left: Array, parts: Array, trust: Array, freedom: float) -> float:
        """Return that of residuals (n,), nats, up to a constant."""
        variance = self.variances(parts)
        loss = (freedom + 1) * np.log1p(left * left / (freedom * variance)) + np.log(variance)
        return -0.5 * float((trust * loss).sum())

    def weights(self, left: Array, parts: Array, trust: Array, freedom: float) -> Array:
        """Return one over the variance (n,), less for what lies far out."""
        variance = self.variances(parts)
        return np.asarray(trust * (freedom + 1) / (freedom * variance + left * left))


def usual_spread(settings: SpreadSettings) -> TactelScatter:
    """Return what a sensor is taken to be like before it is touched with."""
    return TactelScatter(settings.felt, settings.aside_mm)


def fit_spread(
    before: TactelScatter, left: Array, parts: Array, jacobian: Array, known: Array, trust: Array,
    settings: SpreadSettings,
) -> TactelScatter:  # fmt: skip
    """Return the spread under which residuals are likeliest, drawn towards the usual one.

    Parameters
    ----------
    before
        To begin with.
    left
        (n,) residuals.
    parts
        (2, n) variances of a spread of 1 and 1.
    jacobian, known
        (n, k) by which what was fitted took up a share of the residuals, and the precision (k, k)
        of what was known of it.
    trust
        (n,) of the tactels.
    """
    freedom = settings.freedom
    usual = np.square([settings.felt, settings.aside_mm])
    now = np.square([before.felt, before.aside_mm])
    for _ in range(settings.rounds):
        spread = TactelScatter(math.sqrt(now[0]), math.sqrt(now[1]))
        weights = spread.weights(left, parts, trust, freedom)
        normal = (jacobian * weights[:, None]).T @ jacobian + known
        inverse = invert_normal(normal, settings.unseen)
        taken = ((jacobian @ inverse) * jacobian).sum(axis=1) * weights
        share = trust * now[:, None] * parts / spread.variances(parts)
        asked = share @ (weights * left * left + taken) + settings.touches * usual / now
        now = now * np.sqrt(asked / (share.sum(axis=1) + settings.touches))
    return TactelScatter(math.sqrt(now[0]), math.sqrt(now[1]))
