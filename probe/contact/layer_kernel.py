"""How a bonded elastic layer answers a wave of pressure, at any wavelength and Poisson ratio.

Wave number q (1/mm), layer thickness h (mm), s = q h -> the surface sinks by

    u = 2 (1 - nu^2) / (E q) * T(s) * p          (T = 1: half-space, T -> 0: thin layer)

and a share B(s) of the pressure arrives at the bonded base, which is what the sensor feels.
With sh = sinh s, ch = cosh s and the common denominator
N(s) = 4 (1 - nu)^2 + s^2 + (3 - 4 nu) sh^2:

    T = [(3 - 4 nu) sh ch - s] / N,    B = 2 (1 - nu) [2 (1 - nu) ch + s sh] / N.

Frictionless top, bonded base, small strain. Both are written as sums of positive terms below
s = 1 (as printed T loses every digit at nu = 1/2, s = 1e-8) and in exp(-s) above (as printed
they overflow at s = 400); every value is within 1e-14 of the true one.

References: the layer's closed form is in K. L. Johnson, Contact Mechanics, 1985, section 5.8.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SERIES_BELOW = 1.0  # s; from here up (3 - 4 nu) sh ch - s loses less than half a digit
_TERMS = 13  # of (sinh 2s - 2s) / 2s: the last is below 1e-17 at s = 1

# A cell with a share c in touch is softer than the waves that the grid carries, by
# D (1/c - 1), D = kappa dx / E*, where c is taken with the bell of `layer_levels`. kappa was
# fitted to exact solutions of strips on layers (plane strain, pressures as Chebyshev series),
# 3.5 and 11.5 cells wide, dx/h = .05 ... 3.2, nu = 0 ... .4999: with it the strip's stiffness is
# the same at every place on the grid within 1e-3, and kappa does not depend on the width. The
# fit holds to 2 % up to dx = .2 h, to 8 % up to .8 h. Towards nu = 1/2 discs and washers on
# finite elements (round ones: a disc of 15 mm, washers of 15/7 and 20/7 mm, h = 2) ask for up to
# 4 % less, which the last two terms take off: their depth is then right within .2 % at dx = .2 h.
# A thin compressible layer has D = its compliance under even pressure, which fixes the limit.
_EDGE_FINE, _EDGE_FIRST, _EDGE_SECOND = 0.939, 0.446, 1.422
_EDGE_LESS, _EDGE_FROM, _EDGE_SQUEEZED = 0.06, 0.1, 0.1  # share; x; 1 - 2 nu


def layer_compliance(q: Array, *, height_mm: float, young_mpa: float, poisson: float) -> Array:
    """Return surface displacement per pressure, mm/MPa, of waves with wave number q.

    Parameters
    ----------
    q
        (...) wave numbers, 1/mm, >= 0. At 0 it is that of a layer pressed all over:
        h (1 + nu) (1 - 2 nu) / (E (1 - nu)), which is 0 at nu = 1/2.
    height_mm, young_mpa, poisson
        Of the layer; poisson in [0, 1/2].
    """
    scale = 2 * (1 - poisson**2) * height_mm / young_mpa
    return scale * compliance_over_s(np.asarray(q, np.float64) * height_mm, poisson)


def compliance_ratio(s: Array, poisson: float) -> Array:
    """Return T(s) (...): the layer's compliance over the half-space's; s = q h >= 0."""
    s = np.asarray(s, np.float64)
    return s * compliance_over_s(s, poisson)


def compliance_over_s(s: Array, poisson: float) -> Array:
    """Return T(s) / s (...), regular at s = 0: (1 - 2 nu) / (2 (1 - nu)^2) there."""
    s = np.asarray(s, np.float64)
    k, c = 3 - 4 * poisson, 4 * (1 - poisson) ** 2
    low = np.minimum(s, _SERIES_BELOW)
    square = np.square(low)
    below = (k * _sinh_excess(square) + 2 * (1 - 2 * poisson)) / (
        c + square + k * np.square(np.sinh(low))
    )
    high = np.maximum(s, _SERIES_BELOW)
    e2 = np.exp(-2 * high)
    e4 = np.square(e2)
    above = (k * (1 - e4) - 4 * high * e2) / (
        (4 * e2 * (c + np.square(high)) + k * np.square(1 - e2)) * high
    )
    return np.where(s < _SERIES_BELOW, below, above)


def base_ratio(s: Array, poisson: float) -> Array:
    """Return B(s) (...): stress at the bonded base over the pressure on top; B(0) = 1."""
    s = np.asarray(s, np.float64)
    a = 2 * (1 - poisson)
    e = np.exp(-s)
    e2 = np.square(e)
    sh, ch = -np.expm1(-2 * s), 1 + e2  # both times 2 exp(-s)
    return 2 * a * e * (a * ch + s * sh) / (4 * e2 * (a * a + s * s) + (3 - 4 * poisson) * sh * sh)


def edge_compliance(dx_mm: float, *, height_mm: float, young_mpa: float, poisson: float) -> float:
    """Return D = kappa dx / E*, mm/MPa: what edges inside a cell of side dx add, see above."""
    x, squeezed = dx_mm / height_mm, 1 - 2 * poisson
    bend = _EDGE_SECOND * squeezed / (_EDGE_FINE * (1 - poisson) ** 2 - _EDGE_FIRST * squeezed)
    kappa = _EDGE_FINE / (1 + _EDGE_FIRST * x + _EDGE_SECOND * x * x / (1 + bend * x))
    less = _EDGE_LESS * math.exp(-squeezed / _EDGE_SQUEEZED) * x / ((x + _EDGE_FROM) * (1 + x))
    return kappa * (1 - less) * dx_mm * (1 - poisson**2) / young_mpa


def _sinh_excess(square: Array) -> Array:
    """Return (sinh 2s - 2s) / 2s by its series, from s^2 <= 1."""
    total = np.zeros_like(square)
    for n in range(_TERMS, 0, -1):
        total = (total + 1) * square * (4 / ((2 * n) * (2 * n + 1)))
    return total
