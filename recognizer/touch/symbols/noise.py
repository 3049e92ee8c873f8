"""How far readings lie from what a symbol would give, and the log-likelihood of that.

psi of a reading spreads in proportion to what is felt (gain, height and force law differ from
tactel to tactel), to the slope of the template (tactels are not quite where they should be),
and little where nothing is felt. Where a tilted sensor presses less, heights count for more.
Losses are bounded per tactel, so that a dead one or a spike costs a known amount.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.settings import NoiseSettings
from recognizer.touch.symbols.template import Floats, psi

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class NormalizedImage:
    """An image under gain planes: b planes, n tactels."""

    psi: Array  #: (b, n) of the forces over the gain
    press: Array  #: (b, n) 0 ... 1, how hard the plane presses; 1 where it does as in the middle
    bare: Array  #: (b, n) force over the bare face, as a share of that on a symbol
    contact: Array  #: (b, n) 1, falling to 0 where the sensor hangs in the air
    trust: Array  #: (n,)
    measure: Array  #: (b,) sum of log |d psi / d force|: makes planes of other gain comparable
    depth: Array  #: (b, n) of the plate below the tops of the symbols, heights of the overlay
    plain: Array  #: (b, n) F of `pressing` there
    lower: Array  #: (b, n) and over the bare face
    plateau: Array  #: (b, n) force on a plateau, no less than where the sensor hangs in the air
    settings: NoiseSettings


def psi_deviation(tables: Floats | Array, settings: NoiseSettings) -> Floats:
    """Return the spread (b, n, q) of psi around templates (b, n, q, 6), in units of the noise."""
    value, x, y = tables[..., 0], tables[..., 1], tables[..., 2]
    square = settings.quiet**2 + value * value + settings.displaced_mm**2 * (x * x + y * y)
    return np.asarray(np.sqrt(square), np.float32)


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
    symbols = _log_densities(felt, tables[..., 0], psi_deviation(tables, felt.settings), unit)
    floor = psi(felt.bare)
    bare = np.stack([np.zeros_like(floor), floor], axis=-1)  # beyond the edge of the face, or not
    nothing = _log_densities(felt, bare, np.hypot(felt.settings.quiet, bare), unit).max(
        axis=-1, keepdims=True
    )
    return np.concatenate([symbols, nothing], axis=-1)


def _log_densities(
    felt: NormalizedImage, values: Array | Floats, widths: Array | Floats, unit: Array
) -> Array:
    away = (felt.psi[..., None] - values) / (unit[..., None] * widths)
    each = -np.minimum(0.5 * away * away, felt.settings.most) - np.log(widths)
    return np.asarray(felt.trust[:, None] * each, np.float64)
