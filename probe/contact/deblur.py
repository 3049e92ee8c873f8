"""Forces on top of a pad, from the forces at its base, as far as they can be known. Thesis 4.2.

A wave of pressure arrives at the base as B(q h) (`layer_influence`); at the tactels' Nyquist
frequency of 0.61 (h = 1 mm), 0.185 (2 mm), 0.0065 (4 mm, nu = .4999). To invert that grows the
noise by its inverse: below `LEAST_SHARE` it is refused, above, forces f >= 0 are found for which
|K f - m|^2 + (sigma/tau)^2 |f|^2 is least: K the blur from tactel to tactel, m the readings, sigma
their noise, tau the root mean square of m. Signal under the noise is left out, and counted.
What arrives beyond the matrix counts for the outermost tactels, as in `layer_influence`.

References: C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, 1974, chapters 23 and 25.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.layer_influence import base_ratio, influence, nearest_tactel
from probe.errors import ContactError

Array = NDArray[np.float64]

LEAST_SHARE = 0.01  #: of a wave at the tactels' Nyquist frequency that must arrive
CELLS = 4  # of the layer, per tactel: finer than the blur


@dataclass(frozen=True, slots=True, eq=False)
class DeblurredImage:
    """Forces on the top of the pad."""

    forces_n: Array  #: (rows, columns) over each tactel, >= 0
    noise_n: float  #: standard deviation of one of them, root mean square
    resolved: int  #: directions of the image that stand above the noise, of rows times columns


def deblur(forces_n: ArrayLike, sensor: SensorType, *, noise_n: float) -> DeblurredImage:
    """Return the forces on top of a pad under readings (rows, columns), N.

    `noise_n` is the standard deviation of one reading, N; 0 takes readings and blur as exact.

    Raises `ContactError` when the overlay is no pad, or one that passes too little; for readings or
    a noise that are no numbers.
    """
    read = np.asarray(forces_n, dtype=np.float64)
    shape = (sensor.rows, sensor.columns)
    if read.shape != shape or not np.isfinite(read).all():
        raise ContactError(
            f"readings of shape {read.shape}, finite numbers of {shape} are needed",
            fix="give the force on each tactel, rows from the top",
        )
    if not 0 <= noise_n < math.inf:
        raise ContactError(
            f"a noise of {noise_n:g} N", fix="give the standard deviation of one reading, >= 0"
        )
    influence(sensor, CELLS)  # refuses what is no pad
    arrives = transmitted_share(sensor)
    if arrives < LEAST_SHARE:
        raise ContactError(
            f"a pad of {sensor.overlay.height_mm:g} mm passes {arrives:.2g} of a wave that is two "
            f"tactels long, {LEAST_SHARE:g} is needed: its blur cannot be inverted without noise "
            "drowning the image",
            fix=f"take a pad of at most {math.floor(100 * thickest_mm(sensor)) / 100:g} mm, tabs, "
            "or the image as it is",
        )
    blur, strengths = blur_of(sensor)
    level = math.sqrt(float(np.mean(np.square(read))))
    if level == 0:
        return DeblurredImage(np.zeros(shape), 0.0, 0)
    share = noise_n / level
    kept = strengths / (np.square(strengths) + share**2)
    return DeblurredImage(
        _fit_pressures(blur, read.ravel(), share).reshape(shape),
        noise_n * math.sqrt(float(np.mean(np.square(kept)))),
        int(np.count_nonzero(strengths > share)),
    )


def transmitted_share(sensor: SensorType) -> float:
    """Return the share of a wave two tactels long that arrives at the base of the pad."""
    s = math.pi / sensor.pitch_mm * sensor.overlay.height_mm
    return float(base_ratio(np.array(s), sensor.overlay.poisson))


def thickest_mm(sensor: SensorType) -> float:
    """Return the height of the highest pad of the sensor's material that can be deblurred."""
    from scipy.optimize import brentq

    # At s = 8 half of LEAST_SHARE arrives, at any Poisson's ratio.
    s = brentq(
        lambda s: float(base_ratio(np.array(s), sensor.overlay.poisson)) - LEAST_SHARE, 0.0, 8.0
    )
    return float(s) * sensor.pitch_mm / math.pi


def _fit_pressures(blur: Array, read: Array, share: float) -> Array:
    from scipy.optimize import nnls

    if share == 0:
        return np.asarray(nnls(blur, read)[0])
    system = np.concatenate([blur, share * np.eye(len(read))])
    return np.asarray(nnls(system, np.concatenate([read, np.zeros(len(read))]))[0])


@lru_cache(maxsize=4)
def blur_of(sensor: SensorType) -> tuple[Array, Array]:
    """Return the blur (n, n) from tactel to tactel, and its singular values (n,).

    Column k is what the tactels read of 1 N that presses evenly on the square of tactel k.
    """
    grid = influence(sensor, CELLS)
    n, dx, height = grid.cells_per_tactel, grid.dx_mm, sensor.overlay.height_mm
    down, right = (
        frequency(cells)
        for frequency, cells in zip(
            (scipy.fft.fftfreq, scipy.fft.rfftfreq), grid.domain, strict=True
        )
    )
    s = 2 * math.pi * height / dx * np.hypot(down[:, None], right)
    # A cell is pressed evenly and read as a whole: its own wave, and all shorter ones as one.
    own = np.square(np.sinc(down)[:, None] * np.sinc(right))
    beyond = base_ratio(np.array(2 * math.pi * height / dx), sensor.overlay.poisson)
    passed = base_ratio(s, sensor.overlay.poisson) * own + float(beyond) * (1 - own)
    orders = [
        nearest_tactel(whole, cells, n)
        for whole, cells in zip(grid.domain, (grid.rows, grid.columns), strict=True)
    ]
    blur = np.empty((sensor.rows * sensor.columns,) * 2)
    for tactel, (row, column) in enumerate(np.ndindex(sensor.rows, sensor.columns)):
        force = np.zeros(grid.domain)
        force[1 + row * n : 1 + (row + 1) * n, 1 + column * n : 1 + (column + 1) * n] = 1 / n**2
        arrived = scipy.fft.irfft2(scipy.fft.rfft2(force) * passed, s=grid.domain)
        for axis, (order, starts) in enumerate(orders):
            arrived = np.add.reduceat(arrived.take(order, axis=axis), starts, axis=axis)
        blur[:, tactel] = arrived.ravel()
    strengths: Array = np.asarray(np.linalg.svd(blur, compute_uv=False), np.float64)
    blur.setflags(write=False)
    strengths.setflags(write=False)
    return blur, strengths
