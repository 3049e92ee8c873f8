"""How sure the pose of a lattice is: the covariance of x, y (mm) and theta (rad).

The normal matrix of the last step gives the shape. Its size is the noise that the fit leaves,
and what that noise cannot tell: tactels of a pad err with their neighbours, and under tabs a
touch whose form lies far from what was known beforehand (`refine.PRIOR`) has more of the
template wrong than the fitted part of it. Both were measured against simulated touches of
other contact levels (`docs/recognizer.md`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.gain import Image
from recognizer.touch.symbols.refine import NOISE, POSE, PRIOR, Lattices

Array = NDArray[np.float64]

PAD = 1.18  #: times the variance, neighbours that err alike counted
TAB, STRANGE = 0.6, 0.025  #: times the variance; and with the fourth power of the form's distance
UNSEEN = 1e-8  #: least eigenvalue of a normal matrix of unit diagonal


def covariances(image: Image, lattices: Lattices, away: Array, noise: float) -> Array:
    """Return the covariances (b, 3, 3) of the poses of lattices.

    Parameters
    ----------
    away
        (b, n) what the likeliest labels leave of the readings, on a covered tactel's scale.
    noise
        Standard deviation of psi with which the lattices are scored.
    """
    if image.pressing.hardens:
        form = slice(3, POSE)
        strange = ((lattices.pose[:, form] / PRIOR[form]) ** 2).sum(axis=1)
        size = TAB + STRANGE * strange**2
    else:
        size = PAD * _alike(away, image.shape)
    shapes = np.array([_inverse(normal)[:3, :3] for normal in lattices.normal])
    return np.asarray((noise / NOISE) ** 2 * size[:, None, None] * shapes)


def _inverse(normal: Array) -> Array:
    """Return the inverse of a normal matrix; wide, not narrow, in what the image does not show."""
    unit = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-12))
    sizes, axes = np.linalg.eigh(normal * np.outer(unit, unit))
    return np.asarray((axes / np.maximum(sizes, UNSEEN)) @ axes.T * np.outer(unit, unit))


def _alike(away: Array, shape: tuple[int, int]) -> Array:
    """Return by how much (b,) neighbours that err alike widen a covariance, 1 or more.

    The sum of the autocorrelation of what is left over the eight neighbours.
    """
    left = np.clip(away, -4 * NOISE, 4 * NOISE).reshape(-1, *shape)
    left = left - left.mean(axis=(1, 2), keepdims=True)
    own = np.maximum((left * left).sum(axis=(1, 2)), 1e-12)
    side = (left[:, 1:] * left[:, :-1]).sum(axis=(1, 2))
    side += (left[:, :, 1:] * left[:, :, :-1]).sum(axis=(1, 2))
    across = (left[:, 1:, 1:] * left[:, :-1, :-1]).sum(axis=(1, 2))
    across += (left[:, 1:, :-1] * left[:, :-1, 1:]).sum(axis=(1, 2))
    return np.asarray(np.maximum(1.0, 1.0 + 2.0 * (side + across) / own))
