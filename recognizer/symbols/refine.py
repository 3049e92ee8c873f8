"""Refinement: pose and gain by Gauss-Newton, labels chosen anew at every step.

With the labels held, the image is psi(f / g(x)) = T_label(R(theta) s + (x, y) - cell): six
unknowns, three of the pose and three of the gain plane g, by weighted least squares over the
tactels, for all candidates at once; `noise` says what each is worth. Lattice frame and sensor
frame in mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.sensor import Sensor
from recognizer.symbols.noise import Felt, log_likelihoods, spread
from recognizer.symbols.template import Floats, Template, psi

Array = NDArray[np.float64]

STEEPEST = 1.7  #: slope of a gain plane; over 1 a part of the sensor hangs in the air
LEAST_PRESS = 0.2  #: of a tactel where the plane presses little or not at all
LEAST_GAIN = 0.12  #: of the largest over the sensor: below it a tactel tells nothing of symbols
NOISE = 0.15  #: standard deviation of psi on a covered tactel, until it is known better
SPREADS = -0.5, 0.7  #: of the spread, `template`
_FAR = 4.0  # standard deviations at which a tactel's loss stops growing
_STEP_MM, _STEP_RAD = 1.0, 0.08  # largest change in one step
_DAMPING = np.array([1.0, 1.0, 100.0, 3.0])


@dataclass(frozen=True, slots=True)
class Image:
    """What is fitted: forces of the tactels that tell something."""

    points_mm: Array  #: (n, 2) sensor frame
    forces: Array  #: (n,) newtons, or anything proportional
    trust: Array  #: (n,) 0 ... 1, 0 for bad tactels
    scale: Array  #: (2,) half width and half height of the sensor, mm

    def plane(self) -> Array:
        """Return the basis (n, 3) of gain planes: 1, x and y over the half widths."""
        return np.column_stack([np.ones(len(self.points_mm)), self.points_mm / self.scale])


@dataclass(frozen=True, slots=True)
class Lattices:
    """Candidates: sensor point s lies at R(theta) s + (x, y) in the lattice frame."""

    pose: Array  #: (b, 4) x, y (mm), theta (rad), spread (`template`)
    gain: Array  #: (b, 3) of the plane
    value: Array  #: (b,) log-likelihood of the image, nats, up to a constant of the image
    normal: Array  #: (b, 4, 4) inverse covariance of the pose and the spread


def image_of(sensor: Sensor, forces: Array, trust: Array) -> Image:
    """Return what is fitted of a frame: forces (rows, columns), trust (rows, columns)."""
    return Image(
        sensor.centres_mm().reshape(-1, 2),
        forces.reshape(-1).astype(np.float64),
        trust.reshape(-1).astype(np.float64),
        np.array(sensor.half_mm),
    )


def first_gain(image: Image, ink: float) -> Array:
    """Return the gain plane (3,) of an image that shows symbols of mean response `ink` all over."""
    basis = image.plane()
    root = np.sqrt(image.trust)
    gain = np.linalg.lstsq(basis * (root * ink)[:, None], image.forces * root, rcond=None)[0]
    return np.asarray(bounded_gain(np.asarray(gain, np.float64)[None], 0.9)[0])


def bounded_gain(gain: Array, steepest: float = STEEPEST) -> Array:
    """Return planes (b, 3) whose slopes are at most `steepest` times their value at the centre."""
    slope = np.abs(gain[:, 1:]).sum(axis=1)
    limit = steepest * gain[:, 0]
    factor = np.where(slope > limit, limit / np.maximum(slope, 1e-300), 1.0)
    return np.column_stack([gain[:, 0], gain[:, 1:] * factor[:, None]])


def felt_under(image: Image, gain: Array) -> Felt:
    """Return the image as it is under gain planes (b, 3)."""
    plane = gain @ image.plane().T
    floor = LEAST_GAIN * plane.max(axis=1, keepdims=True)
    divisor = np.maximum(plane, floor)
    measure = -(image.trust * np.log(divisor + 3.0 * image.forces)).sum(axis=1)
    press = np.clip(plane / (0.5 * gain[:, :1]), LEAST_PRESS, 1.0)
    return Felt(
        psi(image.forces / divisor), press, np.clip(plane / floor, 0.0, 1.0), image.trust, measure
    )


def cells_and_offsets(image: Image, pose: Array, pitch: float) -> tuple[NDArray[np.int64], Array]:
    """Return the cell (column, upward row) under each tactel and its offset, both (b, n, 2)."""
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = image.points_mm.T
    u = np.stack([pose[:, 0, None] + c * x - s * y, pose[:, 1, None] + s * x + c * y], axis=-1)
    cells = np.floor(u / pitch)
    return cells.astype(np.int64), u - (cells + 0.5) * pitch


#: Which symbols cells show: (b, n, 2) cells of b lattices -> (b, n) labels, -1 for none.
Shown = Callable[[NDArray[np.int64]], NDArray[np.int64]]


def refined(
    image: Image,
    template: Template,
    start: Lattices,
    *,
    steps: int,
    noise: float = NOISE,
    shown: Shown | None = None,
) -> Lattices:
    """Return the candidates after `steps` Gauss-Newton steps, with their log-likelihoods.

    Parameters
    ----------
    noise
        Standard deviation of psi on a covered tactel.
    shown
        What the cells show, where that is known; otherwise each cell shows what fits best.
    """
    pose, gain = start.pose.copy(), start.gain.copy()
    noises = np.full(len(pose), noise)
    value = start.value
    normal = np.zeros((len(pose), 4, 4))
    for step in range(steps + 1):
        felt = felt_under(image, gain)
        cells, offsets = cells_and_offsets(image, pose, template.pitch_mm)
        tables = tables_at(template, offsets, pose[:, 3], felt.contact)
        scores = log_likelihoods(felt, tables, noises)
        number, dense = _numbered(cells)
        labels = _best(number, dense, scores) if shown is None else shown(cells)
        value = np.take_along_axis(scores, labels[..., None], axis=2)[..., 0].sum(axis=1)
        value += felt.measure + (felt.trust * np.log(felt.press)).sum(axis=1)
        values = _labelled(tables, labels)
        width = noise * spread(values[:, :, None])[..., 0] / felt.press
        residual = felt.psi - values[..., 0]
        sure = felt.trust * (np.abs(residual) < _FAR * width) / width**2
        normal = _normal(image, pose, values, sure)
        if step == steps:
            break
        pose = pose + _moved(normal, image, pose, values, residual * sure)
        pose[:, 3] = np.clip(pose[:, 3], *SPREADS)
        gain = _gain(image, gain, values[..., 0], (sure > 0) * felt.contact * felt.press**2)
    return Lattices(pose, gain, value, normal)


def started(pose: Array, gain: Array) -> Lattices:
    """Return candidates of which nothing is known but pose (b, 4) and gain (b, 3)."""
    return Lattices(pose, gain, np.zeros(len(pose)), np.zeros((len(pose), 4, 4)))


def chosen(cells: NDArray[np.int64], tables: Floats, scores: Array) -> Array:
    """Return psi and slopes (b, n, 4) of the symbol that fits best in each cell, or of none."""
    number, dense = _numbered(cells)
    return _labelled(tables, _best(number, dense, scores))


def tables_at(template: Template, offsets: Array, spreads: Array, contact: Array) -> Floats:
    """Return templates (b, n, q, 4) at offsets, for the spread and the contact that is fitted."""
    tables = template.at(offsets)
    tables[..., 0] += tables[..., 3] * spreads[:, None, None].astype(np.float32)
    tables *= contact[..., None, None].astype(np.float32)
    return tables


def _best(number: int, dense: NDArray[np.int64], scores: Array) -> NDArray[np.int64]:
    """Return the label (b, n) of the symbol that fits best in the cell under each tactel, or -1."""
    flat = dense.ravel()
    sums = np.stack(
        [np.bincount(flat, column, number) for column in scores.reshape(flat.size, -1).T], axis=1
    )
    best = sums.argmax(axis=1)
    best[best == scores.shape[2] - 1] = -1
    return np.asarray(best[dense])


def _labelled(tables: NDArray[np.float32], labels: NDArray[np.int64]) -> Array:
    """Return psi and slopes (b, n, 4) of given symbols, 0 where there is none."""
    values = np.take_along_axis(tables, labels.clip(min=0)[..., None, None], axis=2)[:, :, 0]
    return np.asarray(values * (labels >= 0)[..., None], np.float64)


def _numbered(cells: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """Return how many cells there can be over all candidates, and each tactel's number."""
    low = cells.min(axis=1, keepdims=True)
    local = cells - low
    width = int(local.max()) + 1
    count = width * width
    dense = local[..., 1] * width + local[..., 0] + np.arange(len(cells))[:, None] * count
    return count * len(cells), dense


def _jacobian(image: Image, pose: Array, values: Array) -> Array:
    """Return the derivatives (b, n, 4) of psi by x, y, theta and spread."""
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = image.points_mm.T
    slope_x, slope_y = values[..., 1], values[..., 2]
    turn = slope_x * (-s * x - c * y) + slope_y * (c * x - s * y)
    return np.stack([slope_x, slope_y, turn, values[..., 3]], axis=-1)


def _normal(image: Image, pose: Array, values: Array, sure: Array) -> Array:
    """Return the normal matrices (b, 4, 4) of pose and spread."""
    jacobian = _jacobian(image, pose, values)
    return np.asarray((jacobian * sure[..., None]).swapaxes(1, 2) @ jacobian)


def _moved(normal: Array, image: Image, pose: Array, values: Array, pull: Array) -> Array:
    """Return the damped Gauss-Newton step (b, 4) of the pose and the spread."""
    right = _jacobian(image, pose, values).swapaxes(1, 2) @ pull[..., None]
    step = np.linalg.solve(normal + np.diag(_DAMPING), right)[..., 0]
    limits = np.array([_STEP_MM, _STEP_MM, _STEP_RAD, 0.5])
    return np.clip(step, -limits, limits)


def _gain(image: Image, gain: Array, values: Array, weights: Array) -> Array:
    """Return the gain planes (b, 3) that explain the forces best, labels and pose held."""
    response = np.expm1(values * math.log(4.0)) / 3.0
    basis = image.plane()
    sure = weights / (0.03 + 0.10 * response) ** 2
    design = basis[None] * response[..., None]
    weighted = design * sure[..., None]
    normal = np.einsum("bni,bnj->bij", weighted, design)
    ridge = 1e-2 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.diag([0.0, 1.0, 1.0])
    ridge += 1e-9 * (1 + np.trace(normal, axis1=1, axis2=2))[:, None, None] * np.eye(3)
    right = np.einsum("bni,n->bi", weighted, image.forces)
    found = np.linalg.solve(normal + ridge, right[..., None])[..., 0]
    usable = found[:, 0] > 0
    return bounded_gain(np.where(usable[:, None], found, gain))
