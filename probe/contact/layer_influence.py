"""Influence of a pressed cell on every other: the pad as two spectra.

SensorType + cells per tactel -> Influence, made once for a sensor and kept. The matrix is cut into
square cells of side dx; pressure is band-limited on them, and the surface sinks by a cyclic
convolution, two Fourier transforms: the compliance between cells is never a matrix.

The layer has no edges in wave numbers, so the domain is the matrix and a free rim about it,
`LAYER_INFLUENCE.rim` pad heights in total both ways: what a cell feels of the images of the
others has then fallen to about 1e-5 of its own compliance. On the way to the base the bells by
which cells meet the surface (`layer_levels`) are taken off, and the stress is integrated over each
cell: a factor 1/sinc^3 and a factor sinc along either axis. Beyond its edge the real pad ends.
There this model is an endless layer: against elements with a free edge (nu = .4999) a ring 2.6 h
from the edge is 2 % too stiff, at 0.9 h 17 %. What the endless layer would carry beyond the matrix
is given to the outermost tactels, where a free edge carries it; so the sum of all tactels is the
force.
Thesis 4.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.layer_kernel import base_ratio, edge_compliance, layer_compliance
from probe.contact.settings import LAYER_INFLUENCE
from probe.errors import ContactError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Influence:
    """A bonded pad on a grid of cells; row 0 is the top row, as on the sensor.

    One more ring of cells stands about the matrix: the bells of `layer_levels` reach there.
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
        (below 1e-3 of the force) is felt by no tactel.
        """
        stress = self._filtered(pressure, self.base, self.domain[0])
        n = self.cells_per_tactel
        rows = nearest_tactel(self.domain[0], self.rows, n)
        columns = nearest_tactel(self.domain[1], self.columns, n)
        felt = np.add.reduceat(stress[rows[0]], rows[1], axis=0)
        felt = np.maximum(np.add.reduceat(felt[:, columns[0]], columns[1], axis=1), 0.0)
        total = felt.sum()
        return felt * (pressure.sum() * self.dx_mm**2 / total) if total > 0 else felt

    def _filtered(self, pressure: Array, spectrum: Array, rows: int) -> Array:
        """Return the first rows of the cyclic convolution; zero rows are not transformed."""
        waves = scipy.fft.rfft(pressure, self.domain[1], axis=1)
        waves = scipy.fft.fft(waves, self.domain[0], axis=0)
        waves *= spectrum
        waves = scipy.fft.ifft(waves, axis=0, overwrite_x=True)[:rows]
        return np.asarray(scipy.fft.irfft(waves, self.domain[1], axis=1))


@lru_cache(maxsize=8)
def influence(sensor: SensorType, cells_per_tactel: int) -> Influence:
    """Return the pad of a sensor on a grid.

    Parameters
    ----------
    sensor
        With an overlay of kind "pad".
    cells_per_tactel
        Along each side of a tactel.

    Raises
    ------
    ContactError
        When the overlay is no pad, or has no physical height, modulus or Poisson's ratio.
    """
    _check(sensor, cells_per_tactel)
    pad = sensor.overlay
    rows, columns = sensor.rows * cells_per_tactel + 2, sensor.columns * cells_per_tactel + 2
    dx = sensor.pitch_mm / cells_per_tactel
    domain = _domain(rows, pad.height_mm / dx), _domain(columns, pad.height_mm / dx)
    if max(domain) > LAYER_INFLUENCE.largest_domain:
        raise ContactError(
            f"a pad {pad.height_mm:g} mm high on cells of {dx:g} mm needs a grid of "
            f"{domain[0]} x {domain[1]}, allowed are {LAYER_INFLUENCE.largest_domain} a side",
            fix="take fewer cells per tactel, or a lower pad",
        )
    q = 2 * math.pi / dx * np.hypot(
        scipy.fft.fftfreq(domain[0])[:, None], scipy.fft.rfftfreq(domain[1])[None, :]
    )  # fmt: skip
    spectrum = layer_compliance(
        q, height_mm=pad.height_mm, young_mpa=pad.young_mpa, poisson=pad.poisson
    )
    own = float(scipy.fft.irfft2(spectrum, s=domain)[0, 0])
    along = [np.sinc(scipy.fft.fftfreq(domain[0])), np.sinc(scipy.fft.rfftfreq(domain[1]))]
    base = base_ratio(q * pad.height_mm, pad.poisson) / np.square(along[0][:, None] * along[1])
    spectrum.setflags(write=False)
    base.setflags(write=False)
    edge = edge_compliance(
        dx, height_mm=pad.height_mm, young_mpa=pad.young_mpa, poisson=pad.poisson
    )
    return Influence(sensor, cells_per_tactel, rows, columns, dx, edge, domain, spectrum, base, own)


def _domain(cells: int, heights: float) -> int:
    """Return the cells of the domain along one side; an even number that the FFT likes."""
    least = cells + math.ceil(LAYER_INFLUENCE.rim * heights)
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
    for name, value in (("height", pad.height_mm), ("Young's modulus", pad.young_mpa)):
        if not (math.isfinite(value) and value > 0):
            raise ContactError(
                f"the pad's {name} is {value:g}, it must be above 0", fix="correct the overlay"
            )
    if not 0 <= pad.poisson <= 0.5:
        raise ContactError(
            f"the pad's Poisson's ratio is {pad.poisson:g}, it must lie in 0 ... 0.5",
            fix="correct the overlay; rubber has 0.499 ... 0.5",
        )
    if not 1 <= cells_per_tactel <= 64:
        raise ContactError(
            f"{cells_per_tactel} cells per tactel, allowed are 1 ... 64",
            fix="take 4 for a touch, 16 for a reference",
        )
