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
LIMITS = np.array([0.7, 0.4, 0.03])  #: of spread, exponent - 1 and scale - 1, `template`
_SHALLOW = 0.4  # least depth of the bare face, against the largest gain
_REACHED = 0.15  # psi beside symbols at which the bare face may be pressed
_REACHING = 8  # such tactels, at least
_FAR = 4.0  # standard deviations at which a tactel's loss stops growing
_STEP = np.array([1.0, 1.0, 0.08, 0.5, 0.15, 0.01])  # largest change in one step
_DAMPING = np.array([1.0, 1.0, 100.0, 1.0, 1.0, 100.0])
_PRIOR = np.array([0.0, 0.0, 0.0, 0.5, 0.2, 0.01])
_PRIOR = np.where(_PRIOR > 0, 1 / np.maximum(_PRIOR, 1e-9) ** 2, 0.0)


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

    pose: Array  #: (b, 6) x, y (mm), theta (rad); spread, exponent - 1, scale - 1
    gain: Array  #: (b, 4) of the plane, and how much less the bare face gets (inf: all of it)
    value: Array  #: (b,) log-likelihood of the image, nats, up to a constant of the image
    normal: Array  #: (b, 6, 6) inverse covariance of `pose`


def image_of(sensor: Sensor, forces: Array, trust: Array) -> Image:
    """Return what is fitted of a frame: forces (rows, columns), trust (rows, columns)."""
    return Image(
        sensor.centres_mm().reshape(-1, 2),
        forces.reshape(-1).astype(np.float64),
        trust.reshape(-1).astype(np.float64),
        np.array(sensor.half_mm),
    )


def first_gain(image: Image, ink: float) -> Array:
    """Return the gain (4,) of an image that shows symbols of mean response `ink` all over."""
    basis = image.plane()
    root = np.sqrt(image.trust)
    gain = np.linalg.lstsq(basis * (root * ink)[:, None], image.forces * root, rcond=None)[0]
    return np.append(bounded_gain(np.asarray(gain, np.float64)[None], 0.9)[0], np.inf)


def bounded_gain(gain: Array, steepest: float = STEEPEST) -> Array:
    """Return planes (b, 3) whose slopes are at most `steepest` times their value at the centre."""
    slope = np.abs(gain[:, 1:]).sum(axis=1)
    limit = steepest * gain[:, 0]
    factor = np.where(slope > limit, limit / np.maximum(slope, 1e-300), 1.0)
    return np.column_stack([gain[:, 0], gain[:, 1:] * factor[:, None]])


def felt_under(image: Image, gain: Array) -> Felt:
    """Return the image as it is under gains (b, 4)."""
    plane = gain[:, :3] @ image.plane().T
    least = LEAST_GAIN * plane.max(axis=1, keepdims=True)
    divisor = np.maximum(plane, least)
    return Felt(
        psi=psi(image.forces / divisor),
        press=np.clip(plane / (0.5 * gain[:, :1]), LEAST_PRESS, 1.0),
        floor=psi((plane - gain[:, 3:]) / divisor),
        contact=np.clip(plane / least, 0.0, 1.0),
        trust=image.trust,
        measure=-(image.trust * np.log(divisor + 3.0 * image.forces)).sum(axis=1),
    )


def cells_and_offsets(image: Image, pose: Array, pitch: float) -> tuple[NDArray[np.int64], Array]:
    """Return the cell (column, upward row) under each tactel and its offset, both (b, n, 2)."""
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = image.points_mm.T
    c, s = c * (1 + pose[:, 5, None]), s * (1 + pose[:, 5, None])
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
    bare: bool = True,
) -> Lattices:
    """Return the candidates after `steps` Gauss-Newton steps, with their log-likelihoods.

    Parameters
    ----------
    noise
        Standard deviation of psi on a covered tactel.
    shown
        What the cells show, where that is known; otherwise each cell shows what fits best.
    bare
        Whether the bare face between the symbols may be felt as well.
    """
    pose, gain = start.pose.copy(), start.gain.copy()
    noises = np.full(len(pose), noise)
    value = start.value
    normal = np.zeros((len(pose), 6, 6))
    for step in range(steps + 1):
        felt = felt_under(image, gain)
        cells, offsets = cells_and_offsets(image, pose, template.pitch_mm)
        tables = tables_at(template, offsets, pose, felt)
        scores = log_likelihoods(felt, tables, noises)
        number, dense = _numbered(cells)
        labels = _best(number, dense, scores) if shown is None else shown(cells)
        value = np.take_along_axis(scores, labels[..., None], axis=2)[..., 0].sum(axis=1)
        value += felt.measure + (felt.trust * np.log(felt.press)).sum(axis=1)
        values = _labelled(tables, labels, felt)
        width = noise * spread(values[:, :, None])[..., 0] / felt.press
        residual = felt.psi - values[..., 0]
        sure = felt.trust * (np.abs(residual) < _FAR * width) / width**2
        normal = _normal(image, pose, values, sure)
        if step == steps:
            break
        pose = pose + _moved(normal, image, pose, values, residual * sure)
        pose[:, 3:] = np.clip(pose[:, 3:], -LIMITS, LIMITS)
        gain = _gain(image, felt, gain, values, sure > 0, bare)
    return Lattices(pose, gain, value, normal)


def started(pose: Array, gain: Array) -> Lattices:
    """Return candidates of which nothing is known but pose (b, 6) and gain (b, 4)."""
    return Lattices(pose, gain, np.zeros(len(pose)), np.zeros((len(pose), 6, 6)))


def chosen(cells: NDArray[np.int64], tables: Floats, scores: Array, felt: Felt) -> Array:
    """Return psi and slopes (b, n, 5) of the symbol that fits best in each cell, or of none."""
    number, dense = _numbered(cells)
    return _labelled(tables, _best(number, dense, scores), felt)


def tables_at(template: Template, offsets: Array, pose: Array, felt: Felt) -> Floats:
    """Return templates (b, n, q, 5) at offsets, for the spread, exponent and gain fitted."""
    tables = template.at(offsets)
    by = pose[:, 3:5].astype(np.float32)[:, :, None, None]
    tables[..., 0] += tables[..., 3] * by[:, 0] + tables[..., 4] * by[:, 1]
    tables *= felt.contact[..., None, None].astype(np.float32)
    if felt.floor.any():
        floor = felt.floor[..., None].astype(np.float32)
        bare = floor > tables[..., 0]
        tables[bare] = 0
        tables[..., 0] = np.maximum(tables[..., 0], floor)
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


def _labelled(tables: Floats, labels: NDArray[np.int64], felt: Felt) -> Array:
    """Return psi and slopes (b, n, 5) of given symbols, and of the bare face where there is none.

    Beyond the edge of a face nothing is felt: a tactel without a symbol shows what is nearer.
    """
    values = np.take_along_axis(tables, labels.clip(min=0)[..., None, None], axis=2)[:, :, 0]
    found = np.where((labels >= 0)[..., None], values, 0).astype(np.float64)
    bare = (labels < 0) & (felt.psi > felt.floor / 2)
    found[bare, 0] = felt.floor[bare]
    return found


def _numbered(cells: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """Return how many cells there can be over all candidates, and each tactel's number."""
    low = cells.min(axis=1, keepdims=True)
    local = cells - low
    width = int(local.max()) + 1
    count = width * width
    dense = local[..., 1] * width + local[..., 0] + np.arange(len(cells))[:, None] * count
    return count * len(cells), dense


def _jacobian(image: Image, pose: Array, values: Array) -> Array:
    """Return the derivatives (b, n, 6) of psi by the pose and what is fitted with it."""
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = image.points_mm.T
    across, up = c * x - s * y, s * x + c * y
    slope_x, slope_y = values[..., 1], values[..., 2]
    turn, scale = slope_y * across - slope_x * up, slope_x * across + slope_y * up
    return np.stack([slope_x, slope_y, turn, values[..., 3], values[..., 4], scale], axis=-1)


def _normal(image: Image, pose: Array, values: Array, sure: Array) -> Array:
    """Return the normal matrices (b, 6, 6), with what is known of the last three beforehand."""
    jacobian = _jacobian(image, pose, values)
    normal = (jacobian * sure[..., None]).swapaxes(1, 2) @ jacobian
    return np.asarray(normal + np.diag(_PRIOR))


def _moved(normal: Array, image: Image, pose: Array, values: Array, pull: Array) -> Array:
    """Return the damped Gauss-Newton step (b, 6)."""
    right = (_jacobian(image, pose, values).swapaxes(1, 2) @ pull[..., None])[..., 0]
    right[:, 3:] -= _PRIOR[3:] * pose[:, 3:]
    step = np.linalg.solve(normal + np.diag(_DAMPING), right[..., None])[..., 0]
    return np.clip(step, -_STEP, _STEP)


def _gain(
    image: Image, felt: Felt, gain: Array, values: Array, near: NDArray[np.bool_], bare: bool
) -> Array:
    """Return the gains (b, 4) that explain the forces best, labels and pose held.

    Symbols press with the plane g, the bare face with what is left of it after its depth h,
    g - h: linear in both, once it is known which tactels reach the face.
    """
    basis = image.plane()
    response = np.expm1(values[..., 0] * math.log(4.0)) / 3.0
    by_symbol = np.abs(values[..., 1:3]).sum(axis=-1) > 0
    by_symbol |= response > 0.7
    flat = ~by_symbol & (felt.psi > _REACHED)
    reached = flat & (bare & (flat.sum(axis=1) >= _REACHING))[:, None]
    weights = np.where(near & by_symbol, felt.contact * felt.press**2, 0.0) * felt.trust
    weights = np.where(reached, felt.trust, weights)
    share = np.where(reached, 1.0, response)
    sure = weights / (0.03 + 0.10 * share) ** 2
    design = np.concatenate(
        [basis[None] * share[..., None], -reached[..., None].astype(np.float64)], axis=-1
    )
    weighted = design * sure[..., None]
    normal = weighted.swapaxes(1, 2) @ design
    size = np.trace(normal[:, :3, :3], axis1=1, axis2=2)[:, None, None]
    normal += size * np.diag([0.0, 1e-2, 1e-2, 1e-6]) + 1e-9 * (1 + size) * np.eye(4)
    found = np.linalg.solve(normal, weighted.swapaxes(1, 2) @ image.forces[:, None])[..., 0]
    plane = bounded_gain(np.where(found[:, :1] > 0, found[:, :3], gain[:, :3]))
    least = _SHALLOW * (plane @ basis.T).max(axis=1)
    depth = np.where(reached.any(axis=1), np.maximum(found[:, 3], least), np.inf)
    return np.column_stack([plane, depth])
