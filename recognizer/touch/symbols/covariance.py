"""How sure the pose of a lattice is: the covariance of x, y (mm) and theta (rad).

The normal matrix of the last step gives the shape. Its size is the noise that the fit leaves,
and what that noise cannot tell: tactels of a pad err with their neighbours, and under tabs a
touch whose form lies far from what was known beforehand (`RefineSettings.prior`) has more of the
template wrong than the fitted part of it. Both were measured against simulated touches of
other contact levels (`docs/recognizer.md`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.gain import Image
from recognizer.touch.symbols.refine import POSE, Lattices

Array = NDArray[np.float64]


def covariances(image: Image, lattices: Lattices, away: Array, noise: float) -> Array:
    """Return the covariances (b, 3, 3) of the poses of lattices.

    Parameters
    ----------
    away
        (b, n) what the likeliest labels leave of the readings, on a covered tactel's scale.
    noise
        Standard deviation of psi with which the lattices are scored.
    """
    settings, first = image.settings.covariance, image.settings.noise.first
    if image.pressing.hardens:
        prior = np.array(image.settings.refine.prior[3:])
        strange = ((lattices.pose[:, 3:POSE] / prior) ** 2).sum(axis=1)
        size = settings.tab + settings.strange * strange**2
    else:
        size = settings.pad * _neighbours_alike(away, image.shape, image.settings.noise.far * first)
    shapes = invert_normal(lattices.normal, settings.unseen)[:, :3, :3]
    return np.asarray((noise / first) ** 2 * size[:, None, None] * shapes)


def invert_normal(normal: Array, unseen: float) -> Array:
    """Return the inverses of normal matrices (..., k, k).

    Wide, not narrow, in what the image does not show.
    """
    diagonal = np.diagonal(normal, axis1=-2, axis2=-1)
    unit = 1.0 / np.sqrt(np.maximum(diagonal, 1e-12))
    units = unit[..., :, None] * unit[..., None, :]
    sizes, axes = np.linalg.eigh(normal * units)
    shown = axes / np.maximum(sizes, unseen)[..., None, :]
    return np.asarray(shown @ axes.swapaxes(-2, -1) * units)


def _neighbours_alike(away: Array, shape: tuple[int, int], most: float) -> Array:
    """Return by how much (b,) neighbours that err alike widen a covariance, 1 or more.

    The sum of the autocorrelation of what is left over the eight neighbours.
    """
    left = np.clip(away, -most, most).reshape(-1, *shape)
    left = left - left.mean(axis=(1, 2), keepdims=True)
    own = np.maximum((left * left).sum(axis=(1, 2)), 1e-12)
    side = (left[:, 1:] * left[:, :-1]).sum(axis=(1, 2))
    side += (left[:, :, 1:] * left[:, :, :-1]).sum(axis=(1, 2))
    across = (left[:, 1:, 1:] * left[:, :-1, :-1]).sum(axis=(1, 2))
    across += (left[:, 1:, :-1] * left[:, :-1, 1:]).sum(axis=(1, 2))
    return np.asarray(np.maximum(1.0, 1.0 + 2.0 * (side + across) / own))
