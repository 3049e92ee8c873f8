"""The pad as an elastic layer: two spectra, and the influence of a pressed cell on every other.

SensorType + cells per tactel -> Influence, made once for a sensor and kept. The matrix is cut into
square cells of side dx; pressure is band-limited on them, and the surface sinks by a cyclic
convolution, two Fourier transforms: the compliance between cells is never a matrix. A wave of
pressure p with wave number q (1/mm) on a layer of thickness h (mm), s = q h, sinks the surface by

    u = 2 (1 - nu^2) / (E q) * T(s) * p          (T = 1: half-space, T -> 0: thin layer)

and a share B(s) of the pressure arrives at the bonded base, which is what the sensor measures.
With sh = sinh s, ch = cosh s and the common denominator
N(s) = 4 (1 - nu)^2 + s^2 + (3 - 4 nu) sh^2:

    T = [(3 - 4 nu) sh ch - s] / N,    B = 2 (1 - nu) [2 (1 - nu) ch + s sh] / N.

Frictionless top, bonded base, small strain. Both are written as sums of positive terms below
s = 1 (as printed T loses every digit at nu = 1/2, s = 1e-8) and in exp(-s) above (as printed
they overflow at s = 400); every value is within 1e-14 of the true one.

The layer has no edges in wave numbers, so the domain is the matrix and a free rim about it,
`RIM` pad heights in total both ways: the images of the other cells then act by about 1e-5 of a
cell's own compliance. On the way to the base the bells by which cells meet the surface
(`layer_patch`) are taken off, and the stress is integrated over each cell: a factor 1/sinc^3 and a
factor sinc along either axis. Beyond its edge the real pad ends. There this model is an endless
layer: against elements with a free edge (nu = .4999) a ring 2.6 h from the edge is 2 % too stiff,
at 0.9 h 17 %. The share of the endless layer beyond the matrix is given to the outermost tactels,
where a free edge carries it; so the sum of all tactels is the force. Thesis 4.2.

References: the layer's closed form is in K. L. Johnson, Contact Mechanics, 1985, section 5.8.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.errors import ContactError

Array = NDArray[np.float64]

RIM = 12.0  # free rim of the domain, both sides together, pad heights
LARGEST_DOMAIN = 4096  # cells along one side


@dataclass(frozen=True, slots=True, eq=False)
class Influence:
    """A bonded pad on a grid of cells; row 0 is the top row, as on the sensor.

    One more ring of cells stands about the matrix: the bells of `layer_patch` reach there.
    """

    sensor: SensorType
    cells_per_tactel: int
    rows: int  #: of cells, ring and all
    columns: int
    dx_mm: float
    edge_mm_mpa: float  #: compliance of what a cell does not resolve, see `edge_compliance`
    domain: tuple[int, int]  #: cells of the periodic domain
    compliance: Array  #: (domain rows, domain columns // 2 + 1) of waves, mm/MPa
    base: Array  #: the same shape; what of the pressure arrives at the base
    own_mm_mpa: float  #: compliance of a cell under its own pressure

    def sunk_mm(self, pressure: Array) -> Array:
        """Return how far the surface sinks (rows, columns) under pressures of that shape, MPa."""
        sunk = self._filtered(pressure, self.compliance, self.rows)
        return sunk[:, : self.columns]

    def base_forces_n(self, pressure: Array) -> Array:
        """Return the force (N) that arrives at each tactel under pressures (rows, columns), MPa.

        The sum is the force on the pad. The slight pull of the base far away from the contact
        (below 1e-3 of the force) is read by no tactel.
        """
        stress = self._filtered(pressure, self.base, self.domain[0])
        n = self.cells_per_tactel
        rows = nearest_tactel(self.domain[0], self.rows, n)
        columns = nearest_tactel(self.domain[1], self.columns, n)
        forces = np.add.reduceat(stress[rows[0]], rows[1], axis=0)
        forces = np.maximum(np.add.reduceat(forces[:, columns[0]], columns[1], axis=1), 0.0)
        total = forces.sum()
        return forces * (pressure.sum() * self.dx_mm**2 / total) if total > 0 else forces

    def _filtered(self, pressure: Array, spectrum: Array, rows: int) -> Array:
        """Return the first rows of the cyclic convolution; zero rows are not transformed."""
        waves = scipy.fft.rfft(pressure, self.domain[1], axis=1)
        waves = scipy.fft.fft(waves, self.domain[0], axis=0)
        waves *= spectrum
        waves = scipy.fft.ifft(waves, axis=0, overwrite_x=True)[:rows]
        return np.asarray(scipy.fft.irfft(waves, self.domain[1], axis=1))


@lru_cache(maxsize=8)
def influence(sensor: SensorType, cells_per_tactel: int) -> Influence:
    """Return the pad of a sensor on a grid of `cells_per_tactel` along each side of a tactel.

    Raises `ContactError` when the overlay is no pad.
    """
    _check(sensor, cells_per_tactel)
    pad = sensor.overlay
    rows, columns = sensor.rows * cells_per_tactel + 2, sensor.columns * cells_per_tactel + 2
    dx = sensor.pitch_mm / cells_per_tactel
    domain = _domain(rows, pad.height_mm / dx), _domain(columns, pad.height_mm / dx)
    if max(domain) > LARGEST_DOMAIN:
        raise ContactError(
            f"a pad {pad.height_mm:g} mm high on cells of {dx:g} mm needs a grid of "
            f"{domain[0]} x {domain[1]}, allowed are {LARGEST_DOMAIN} a side",
            fix="take fewer cells per tactel, or a lower pad",
        )
    q = 2 * math.pi / dx * np.hypot(
        scipy.fft.fftfreq(domain[0])[:, None], scipy.fft.rfftfreq(domain[1])[None, :]
    )  # fmt: skip
    spectrum = layer_compliance(q, pad)
    own = float(scipy.fft.irfft2(spectrum, s=domain)[0, 0])
    along = [np.sinc(scipy.fft.fftfreq(domain[0])), np.sinc(scipy.fft.rfftfreq(domain[1]))]
    base = base_ratio(q * pad.height_mm, pad.poisson) / np.square(along[0][:, None] * along[1])
    spectrum.setflags(write=False)
    base.setflags(write=False)
    edge = edge_compliance(dx, pad)
    return Influence(sensor, cells_per_tactel, rows, columns, dx, edge, domain, spectrum, base, own)


def _domain(cells: int, heights: float) -> int:
    """Return the cells of the domain along one side; an even number that the FFT likes."""
    least = cells + math.ceil(RIM * heights)
    return 2 * int(scipy.fft.next_fast_len((least + 1) // 2, real=True))


def nearest_tactel(
    domain: int, cells: int, per_tactel: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return an order of the domain's cells and where each tactel's run in it starts.

    Half of the rim follows the last tactel, half (cyclic) stands before the first.
    """
    before = (domain - cells) // 2
    order = np.roll(np.arange(domain), before)
    starts = before + 1 + per_tactel * np.arange((cells - 2) // per_tactel)
    starts[0] = 0
    return order, starts


def _check(sensor: SensorType, cells_per_tactel: int) -> None:
    pad = sensor.overlay
    if pad.kind != "pad":
        raise ContactError(
            f"the overlay is of kind {pad.kind!r}, the layer is a one-piece pad",
            fix="give an overlay of kind 'pad', or take the level 'tabs'",
        )
    if not 1 <= cells_per_tactel <= 64:
        raise ContactError(
            f"{cells_per_tactel} cells per tactel, allowed are 1 ... 64",
            fix="take 4 for a touch, 16 for a reference",
        )


_SERIES_BELOW = 1.0  # s; from here up (3 - 4 nu) sh ch - s loses less than half a digit
_TERMS = 13  # of (sinh 2s - 2s) / 2s: the last is below 1e-17 at s = 1

# A cell with a share c in touch is softer than the waves that the grid carries, by
# D (1/c - 1), D = kappa dx / E*, where c is taken with the bell of `layer_patch`. kappa was
# fitted to exact solutions of strips on layers (plane strain, pressures as Chebyshev series),
# 3.5 and 11.5 cells wide, dx/h = .05 ... 3.2, nu = 0 ... .4999: with it the strip's stiffness is
# the same at every place on the grid within 1e-3, and kappa does not depend on the width. The
# fit holds to 2 % up to dx = .2 h, to 8 % up to .8 h. Towards nu = 1/2 discs and washers on
# finite elements (round ones: a disc of 15 mm, washers of 15/7 and 20/7 mm, h = 2) ask for up to
# 4 % less, which the last two terms take off: their depth is then right within .2 % at dx = .2 h.
# A thin compressible layer has D = its compliance under even pressure, which fixes the limit.
_EDGE_FINE, _EDGE_FIRST, _EDGE_SECOND = 0.939, 0.446, 1.422
_EDGE_LESS, _EDGE_FROM, _EDGE_SQUEEZED = 0.06, 0.1, 0.1  # share; x; 1 - 2 nu


def layer_compliance(q: Array, pad: Overlay) -> Array:
    """Return the surface's displacement per pressure, mm/MPa, of waves (...) of number q, 1/mm.

    At q = 0 it is that of a layer pressed all over: h (1 + nu) (1 - 2 nu) / (E (1 - nu)).
    """
    scale = 2 * (1 - pad.poisson**2) * pad.height_mm / pad.young_mpa
    return scale * compliance_over_s(np.asarray(q, np.float64) * pad.height_mm, pad.poisson)


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


def edge_compliance(dx_mm: float, pad: Overlay) -> float:
    """Return D = kappa dx / E*, mm/MPa: what edges inside a cell of side dx add, see above."""
    x, squeezed = dx_mm / pad.height_mm, 1 - 2 * pad.poisson
    bend = _EDGE_SECOND * squeezed / (_EDGE_FINE * (1 - pad.poisson) ** 2 - _EDGE_FIRST * squeezed)
    kappa = _EDGE_FINE / (1 + _EDGE_FIRST * x + _EDGE_SECOND * x * x / (1 + bend * x))
    less = _EDGE_LESS * math.exp(-squeezed / _EDGE_SQUEEZED) * x / ((x + _EDGE_FROM) * (1 + x))
    return kappa * (1 - less) * dx_mm * (1 - pad.poisson**2) / pad.young_mpa


def _sinh_excess(square: Array) -> Array:
    """Return (sinh 2s - 2s) / 2s by its series, from s^2 <= 1."""
    total = np.zeros_like(square)
    for n in range(_TERMS, 0, -1):
        total = (total + 1) * square * (4 / ((2 * n) * (2 * n + 1)))
    return total
