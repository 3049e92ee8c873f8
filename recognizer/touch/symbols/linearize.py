"""An image about lattices of known symbols: likelihood, forces, and their derivatives.

Poses (b, 7) and gains (b, 4) of b lattices + image (n tactels) + labels of the cells -> the
log-likelihood of each, the forces that the symbols give, and how they change with pose and gain.
The image is psi(f / g) = T_label(R(theta) s + (x, y) - cell), g the force on a plateau (`image`),
s a sensor point. Lattice and sensor frame in mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.image import Image, NormalizedImage, normalize_image
from recognizer.touch.symbols.kernels import (
    DISPLACED_MM,
    FAR,
    FIRST_NOISE,
    FORCE_SCALE_SD,
    FORM_SD,
    GRAZED,
    LOUD,
    MOST_NATS,
    POSE,
    QUIET,
    UNKNOWNS,
)
from recognizer.touch.symbols.template import PSI, Floats, psi

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Which symbols cells show: (b, n, 2) cells of b lattices -> (b, n) labels, -1 for none.
LabelsAt = Callable[[Ints], Ints]


@dataclass(frozen=True, slots=True)
class LinearizedImage:
    """An image about b poses and gains, each tactel with its weight."""

    value: Array  #: (b,) log-likelihood of the image, nats, up to a constant of the image
    jacobian: Array  #: (b, n, 11) forces by pose and gain
    left: Array  #: (b, n) forces that are left over
    sure: Array  #: (b, n) one over their variances; 0 where a tactel does not pull
    known: Array  #: (b, 11) how far each unknown lies from what is known of it beforehand
    precision: Array  #: (11,) of that


def linearize_image(
    image: Image, pose: Array, gain: Array, labels_at: LabelsAt, precision: Array | None = None
) -> LinearizedImage:
    """Return how well lattices of known symbols explain an image, and its derivatives.

    `pose` (b, 7), `gain` (b, 4); `precision` (11,) of the prior, that of the image if not given.
    """
    measured, labels, values = project_symbols(image, pose, gain, labels_at)
    if precision is None:
        precision = prior_precision(image)
    known = prior_departure(image, pose, gain)
    value = _log_likelihood(measured, labels, values)
    value += measured.measure + (measured.trust * np.log(measured.press)).sum(axis=1)
    value -= 0.5 * (known**2 * precision).sum(axis=1)
    jacobian, force = force_jacobian(image, pose, gain, values, measured)
    width = _width(values, measured)
    left = image.forces - force
    sure = np.where(np.abs(left / width) < FAR, measured.trust, 0.0) / width**2
    return LinearizedImage(value, jacobian, left, sure, known, precision)


def prior_departure(image: Image, pose: Array, gain: Array) -> Array:
    """Return how far (b, 11) each unknown lies from its prior."""
    away = np.zeros((len(pose), UNKNOWNS))
    away[:, 3:POSE] = pose[:, 3:]
    if image.newtons:
        away[:, POSE] = gain[:, 0] - math.log(image.pressing.scale)
    return away


def prior_precision(image: Image) -> Array:
    """Return the prior of each unknown, one over its variance (11,); 0: nothing is known."""
    precision = np.zeros(UNKNOWNS)
    precision[3:POSE] = 1 / np.square([*FORM_SD, image.options.scale_sd])
    if image.newtons:
        precision[POSE] = 1 / FORCE_SCALE_SD**2
    return precision


def _width(values: Array, measured: NormalizedImage) -> Array:
    """Return the standard deviation (b, n) of forces, from that of psi."""
    unit = FIRST_NOISE / measured.press
    relative = unit * psi_deviation(measured, values[:, :, None], unit)[..., 0]
    return np.asarray(relative * response_by_psi(response_of(values[..., 0])) * measured.plateau)


def force_jacobian(
    image: Image, pose: Array, gain: Array, values: Array, measured: NormalizedImage
) -> tuple[Array, Array]:
    """Return the derivatives (b, n, 11) of the forces by pose and gain, and the forces (b, n)."""
    pressing, basis = image.pressing, image.plane
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = image.points_mm.T
    across, up = c * x - s * y, s * x + c * y
    slope_x, slope_y = values[..., 1], values[..., 2]
    turn, scale = slope_y * across - slope_x * up, slope_x * across + slope_y * up
    free = np.moveaxis(values[..., 3:], -1, 0)
    by_pose = np.stack([slope_x, slope_y, turn, *free, scale], axis=-1)
    total = response_of(values[..., 0])
    by_pose = by_pose * (response_by_psi(total) * measured.plateau)[..., None]
    symbol = np.clip((total - measured.bare) / np.maximum(1 - measured.bare, 1e-3), 0.0, 1.5)
    # beyond the edge of the face there is none
    rest = np.where(values[..., 0] > GRAZED, 1 - symbol, 0.0)
    unit = np.exp(gain[:, :1])
    lower = measured.depth - pressing.symbol
    force = unit * (symbol * measured.plain + rest * measured.lower)
    slope = unit * (symbol * pressing.slope(measured.depth) + rest * pressing.slope(lower))
    by_gain = np.concatenate([force[..., None], slope[..., None] * basis], axis=-1)
    return np.concatenate([by_pose, by_gain], axis=-1), force


def project_symbols(
    image: Image, pose: Array, gain: Array, labels_at: LabelsAt
) -> tuple[NormalizedImage, Ints, Array]:
    """Return an image under gains, the label (b, n) under each tactel, and psi and slopes there.

    Psi and slopes (b, n, 6) are those of the bare face where there is no symbol.
    """
    measured = normalize_image(image, gain)
    cells, offsets = _cells_under(image, pose)
    labels = labels_at(cells)
    tables = _fit_form(image.template.of(offsets, labels.clip(min=0)), pose, measured)
    return measured, labels, _with_bare_face(measured, labels, tables[:, :, 0].astype(np.float64))


def _with_bare_face(measured: NormalizedImage, labels: Ints, found: Array) -> Array:
    """Return psi and slopes (b, n, 6), of the bare face where there is no symbol.

    Beyond the edge of a face nothing presses: a tactel without a symbol shows the nearer of both.
    """
    found[labels < 0] = 0.0
    floor = psi(measured.bare)
    bare = (labels < 0) & (measured.psi > floor / 2)
    found[bare, 0] = floor[bare]
    return np.asarray(found)


def response_of(value: Array | Floats) -> Array:
    """Return y of psi(y)."""
    return np.asarray(np.expm1(value * np.float32(math.log(1 + PSI))) / np.float32(PSI))


def response_by_psi(response: Array) -> Array:
    """Return dy/dpsi."""
    return (1 + PSI * response) * math.log(1 + PSI) / PSI


def _cells_under(image: Image, pose: Array) -> tuple[Ints, Array]:
    """Return the cell (b, n, 2) under each tactel, and the tactel's offset from its centre, mm."""
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    pitch = image.template.pitch_mm
    x, y = image.points_mm.T
    c, s = c * (1 + pose[:, 6, None]), s * (1 + pose[:, 6, None])
    u = np.stack([pose[:, 0, None] + c * x - s * y, pose[:, 1, None] + s * x + c * y], axis=-1)
    cells = np.floor(u / pitch)
    return cells.astype(np.int64), u - (cells + 0.5) * pitch


def _fit_form(tables: Floats, pose: Array, measured: NormalizedImage) -> Floats:
    """Return templates (b, n, q, 6) under form and gain; they may be changed."""
    for slope, by in enumerate(pose[:, 3:6, None, None].astype(np.float32).swapaxes(0, 1), 3):
        tables[..., 0] += tables[..., slope] * by
    if (measured.contact < 1).any():
        tables *= measured.contact[..., None, None].astype(np.float32)
    if measured.bare.any():
        bare = measured.bare[..., None].astype(np.float32)
        response = response_of(tables[..., 0]).astype(np.float32)
        total = response + (1 - response) * bare
        by = (1 - bare) * (1 + 3 * response) / (1 + 3 * total)
        tables = (tables * by[..., None]).astype(np.float32)
        tables[..., 0] = psi(total)
    return tables


def psi_deviation(measured: NormalizedImage, tables: Floats | Array, unit: Array) -> Floats:
    """Return the spread (b, n, q) of psi around templates (b, n, q, 6), in units (b, n)."""
    value, x, y = tables[..., 0], tables[..., 1], tables[..., 2]
    square = QUIET**2 + value * value + DISPLACED_MM**2 * (x * x + y * y)
    return np.asarray(np.sqrt(square + _readings_share(measured, value, unit)), np.float32)


def _readings_share(measured: NormalizedImage, value: Array | Floats, unit: Array) -> Array | float:
    """Return the share of the noise of readings in the square (b, n, q) of a spread."""
    if measured.faint.max(initial=0.0) < LOUD:
        return 0.0
    return (reading_deviation(measured, value) / unit[..., None]) ** 2


def reading_deviation(measured: NormalizedImage, value: Array | Floats) -> Array:
    """Return the standard deviation of psi (b, n, q) by the noise of readings."""
    by_response = PSI / math.log1p(PSI) * np.exp(-math.log1p(PSI) * value)
    return np.asarray(by_response * measured.faint[..., None])


def _log_likelihood(measured: NormalizedImage, labels: Ints, values: Array) -> Array:
    """Return the log-likelihoods (b,) of given labels (b, n), with their psi and slopes."""
    unit = FIRST_NOISE / np.maximum(measured.press, 1e-3)
    symbol = values[:, :, None].astype(np.float32)
    width = psi_deviation(measured, symbol, unit)
    own = log_densities(measured, symbol[..., 0], width, unit)[..., 0]
    return np.asarray(np.where(labels < 0, log_densities_of_none(measured, unit), own).sum(axis=1))


def log_densities_of_none(measured: NormalizedImage, unit: Array) -> Array:
    """Return the log-likelihood (b, n) of no symbol: beyond the edge of the face, or on it."""
    floor = psi(measured.bare)
    bare = np.stack([np.zeros_like(floor), floor], axis=-1)
    width = np.sqrt(QUIET**2 + bare**2 + _readings_share(measured, bare, unit))
    return np.asarray(log_densities(measured, bare, width, unit).max(axis=-1))


def log_densities(
    measured: NormalizedImage, values: Array | Floats, widths: Array | Floats, unit: Array
) -> Array:
    """Return log-likelihoods (b, n, q) of values, each with its width in units of the noise."""
    away = (measured.psi[..., None] - values) / (unit[..., None] * widths)
    each = -np.minimum(0.5 * away * away, MOST_NATS) - np.log(widths)
    return np.asarray(measured.trust[:, None] * each, np.float64)
