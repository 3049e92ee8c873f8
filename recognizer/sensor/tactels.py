"""Gains and tip places: what recognised touches leave unexplained -> how tactels differ.

A recognised touch says what every tactel should read. What is left over is, of one sensor, the
same every time: a share of the reading (gain), and the image's slope times how far the tip stands
aside. Both are found for all tactels at once by least squares over all touches, each touch's own
pose, form and gain being left free; what is known beforehand holds where touches tell little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.evidence import VerifiedHypothesis
from recognizer.touch.sensor_state import PRIOR, SensorState
from recognizer.touch.symbols.kernels import FIRST_NOISE
from recognizer.touch.symbols.linearize import linearize_image

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class TactelEvidence:
    """What touches say of the unknowns (n, 3) of n tactels: logarithm of the gain, x and y (mm)."""

    normal: Array  #: (3 n, 3 n) inverse covariance
    right: Array  #: (3 n,) slope of the log-likelihood by them


def evidence_of(verified: VerifiedHypothesis) -> TactelEvidence:
    """Return what one recognised touch says of the tactels, under the state it was read with."""
    fit, image = verified.fit, verified.image
    at = linearize_image(image, fit.pose[None], fit.gain[None], verified.labels_at)
    own, left = at.jacobian[0], at.left[0]
    sure = at.sure[0] * (FIRST_NOISE / fit.noise) ** 2
    c, s = np.cos(fit.theta_rad), np.sin(fit.theta_rad)
    by_tactel = np.stack(
        [image.forces - left, c * own[:, 0] + s * own[:, 1], c * own[:, 1] - s * own[:, 0]], axis=1
    )
    count = len(left)
    normal = np.zeros((count, 3, count, 3))
    each = np.arange(count)
    normal[each, :, each, :] = by_tactel[:, :, None] * by_tactel[:, None, :] * sure[:, None, None]
    weighed = own * sure[:, None]
    inner = weighed.T @ own + np.diag(at.precision)
    cross = (by_tactel[:, :, None] * weighed[:, None, :]).reshape(3 * count, -1)
    solved = np.linalg.solve(inner, cross.T)
    right = (by_tactel * (sure * left)[:, None]).ravel()
    right -= solved.T @ (weighed.T @ left - at.known[0] * at.precision)
    return TactelEvidence(normal.reshape(3 * count, -1) - cross @ solved, right)


def with_tactels(
    state: SensorState, found: Sequence[TactelEvidence], before: SensorState
) -> SensorState:
    """Return a state with the gains and places that touches tell.

    Parameters
    ----------
    state
        Under which the touches were read.
    found
        Of each of them.
    before
        What was known before these touches.
    """
    if not found:
        return state
    unknowns = _unknowns(state)
    known, deviation = _unknowns(before), _deviations(before)
    precision = 1.0 / deviation**2
    normal = sum(one.normal for one in found) + np.diag(precision)
    right = sum(one.right for one in found) + precision * (known - unknowns)
    covariance = np.linalg.inv(normal)
    values = (unknowns + covariance @ right).reshape(-1, 3)
    left = np.sqrt(np.diagonal(covariance)).reshape(-1, 3)
    rows, columns = state.shape
    return replace(
        state,
        gain=np.exp(values[:, 0] - values[:, 0].mean()).reshape(rows, columns),
        gain_deviation=left[:, 0].reshape(rows, columns),
        aside_mm=values[:, 1:].reshape(rows, columns, 2),
        aside_deviation_mm=left[:, 1:].reshape(rows, columns, 2),
    )


def _unknowns(state: SensorState) -> Array:
    return np.concatenate([np.log(state.gain)[..., None], state.aside_mm], axis=-1).ravel()


def _deviations(state: SensorState) -> Array:
    """Return the deviations of what is known, never more than of a sensor nobody knows."""
    both = np.concatenate([state.gain_deviation[..., None], state.aside_deviation_mm], axis=-1)
    return np.asarray(np.clip(both, 1e-6, [PRIOR.gain, *[PRIOR.aside_mm] * 2]).ravel())
