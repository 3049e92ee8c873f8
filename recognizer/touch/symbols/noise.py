"""How far readings lie from what a symbol would give, and the log-likelihood of that.

psi of a reading spreads in proportion to what is felt (gain, height and force law differ from
tactel to tactel), to the slope of the template (tactels are not quite where they should be),
and little where nothing is felt. Where a tilted sensor presses less, heights count for more.
Losses are bounded per tactel, so that a dead one or a spike costs a known amount.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.settings import NoiseSettings
from recognizer.touch.symbols.template import PSI, Floats, psi

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class NormalizedImage:
    """An image under gain planes: b planes, n tactels."""

    psi: Array  #: (b, n) of the forces over the gain
    press: Array  #: (b, n) 0 ... 1, how hard the plane presses; 1 where it does as in the middle
    bare: Array  #: (b, n) force over the bare face, as a share of that on a symbol
    contact: Array  #: (b, n) 1, falling to 0 where the sensor hangs in the air
    trust: Array  #: (n,)
    forces: Array  #: (n,) of the image
    depth: Array  #: (b, n) of the plate below the tops of the symbols, heights of the overlay
    plain: Array  #: (b, n) F of `pressing` there
    lower: Array  #: (b, n) and over the bare face
    plateau: Array  #: (b, n) force on a plateau, no less than where the sensor hangs in the air
    faint: Array  #: (b, n) noise of the readings as a share of that force
    settings: NoiseSettings

    @property
    def measure(self) -> Array:
        """Return (b,) sums of log |d psi / d force|: they make planes of other gain comparable."""
        return -np.asarray((self.trust * np.log(self.plateau + PSI * self.forces)).sum(axis=1))


def psi_deviation(felt: NormalizedImage, tables: Floats | Array, unit: Array) -> Floats:
    """Return the spread (b, n, q) of psi around templates (b, n, q, 6), in units of the noise.

    Parameters
    ----------
    unit
        (b, n) that unit: deviation of psi on a covered tactel.
    """
    settings = felt.settings
    value, x, y = tables[..., 0], tables[..., 1], tables[..., 2]
    square = settings.quiet**2 + value * value + settings.displaced_mm**2 * (x * x + y * y)
    return np.asarray(np.sqrt(square + _readings_share(felt, value, unit)), np.float32)


def _readings_share(felt: NormalizedImage, value: Array | Floats, unit: Array) -> Array | float:
    """Return what the noise of readings adds to the square (b, n, q) of a spread."""
    if felt.faint.max(initial=0.0) < felt.settings.loud:
        return 0.0
    return (reading_deviation(felt, value) / unit[..., None]) ** 2


def reading_deviation(felt: NormalizedImage, value: Array | Floats) -> Array:
    """Return the standard deviation of psi (b, n, q) that the noise of readings leaves at it."""
    by_response = PSI / math.log1p(PSI) * np.exp(-math.log1p(PSI) * value)
    return np.asarray(by_response * felt.faint[..., None])


def log_likelihoods(felt: NormalizedImage, tables: Floats, noise: Array) -> Array:
    """Return log-likelihoods (b, n, q + 1) of each symbol at each tactel; the last is no symbol.

    Parameters
    ----------
    tables
        (b, n, q, 6) templates under each tactel.
    noise
        (b,) standard deviation of psi on a covered tactel.
    """
    unit = noise[:, None] / np.maximum(felt.press, 1e-3)
    symbols = _log_densities(felt, tables[..., 0], psi_deviation(felt, tables, unit), unit)
    floor = psi(felt.bare)
    bare = np.stack([np.zeros_like(floor), floor], axis=-1)  # beyond the edge of the face, or not
    width = np.sqrt(felt.settings.quiet**2 + bare**2 + _readings_share(felt, bare, unit))
    nothing = _log_densities(felt, bare, width, unit).max(axis=-1, keepdims=True)
    return np.concatenate([symbols, nothing], axis=-1)


def _log_densities(
    felt: NormalizedImage, values: Array | Floats, widths: Array | Floats, unit: Array
) -> Array:
    away = (felt.psi[..., None] - values) / (unit[..., None] * widths)
    each = -np.minimum(0.5 * away * away, felt.settings.most) - np.log(widths)
    return np.asarray(felt.trust[:, None] * each, np.float64)
