"""Refinement: pose and gain by Gauss-Newton, labels chosen anew at every step.

With the labels held, the image is psi(f / g) = T_label(R(theta) s + (x, y) - cell), g the
force on a plateau (`pressing`). Pose and gain take turns, by weighted least squares over the
tactels, for all candidates at once; `noise` says what each is worth. Lattice frame and sensor
frame in mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.gain import Image, bounded_gain, normalize_image
from recognizer.touch.symbols.noise import NormalizedImage, log_likelihoods, psi_deviation
from recognizer.touch.symbols.template import Floats, ResponseTemplate, psi

Array = NDArray[np.float64]

DAMPING = 0.01  #: of the first step
SETTLED = 0.5  #: nats by which a step may still change what is taken as found
NOISE = 0.15  #: standard deviation of psi on a covered tactel, until it is known better
LIMITS = np.array([1.2, 0.7, 0.4, 0.03])  #: of width, cross-talk, exponent - 1, scale - 1
_FAR = 4.0  # standard deviations at which a tactel's loss stops growing
# largest changes in one step: x, y, theta, width, cross-talk, exponent, scale; gain
_STEP = np.array([1.0, 1.0, 0.08, 0.5, 0.5, 0.15, 0.01, 0.3, 0.1, 0.1, 0.1])
_LEAST = np.array([1.0, 1.0, 100.0, 0.1, 0.1, 0.1, 10.0, 1.0, 10.0, 10.0, 10.0])
PRIOR = np.array([0.0, 0.0, 0.0, 0.6, 0.4, 0.2, 0.01])  #: standard deviations; 0: not known
POSE = len(PRIOR)  #: unknowns of `Lattices.pose`
_SCALE_KNOWN = 0.3  # of the logarithm of the force scale, where it is in newtons


@dataclass(frozen=True, slots=True)
class Lattices:
    """Candidates: sensor point s lies at R(theta) s + (x, y) in the lattice frame."""

    pose: Array  #: (b, 7) x, y (mm), theta (rad); width, cross-talk, exponent - 1, scale - 1
    gain: Array  #: (b, 4) logarithm of the scale; depth at the centre, slopes per half width
    value: Array  #: (b,) log-likelihood of the image, nats, up to a constant of the image
    normal: Array  #: (b, 11, 11) inverse covariance of `pose` and `gain`, if noise were `NOISE`


def cells_and_offsets(image: Image, pose: Array, pitch: float) -> tuple[NDArray[np.int64], Array]:
    """Return the cell (column, upward row) under each tactel and its offset, both (b, n, 2)."""
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = image.points_mm.T
    c, s = c * (1 + pose[:, 6, None]), s * (1 + pose[:, 6, None])
    u = np.stack([pose[:, 0, None] + c * x - s * y, pose[:, 1, None] + s * x + c * y], axis=-1)
    cells = np.floor(u / pitch)
    return cells.astype(np.int64), u - (cells + 0.5) * pitch


#: Which symbols cells show: (b, n, 2) cells of b lattices -> (b, n) labels, -1 for none.
Shown = Callable[[NDArray[np.int64]], NDArray[np.int64]]


def refine_lattices(
    image: Image,
    template: ResponseTemplate,
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
    best = start
    trial, damping = start, np.full(len(start.pose), DAMPING)
    for step in range(steps + 1):
        seen = _evaluate(image, template, trial, noise, shown)
        tried = replace(trial, value=seen.value, normal=seen.normal)
        if step == 0:
            best, at_best = tried, seen
        else:
            better = seen.value > best.value
            settled = bool((np.abs(seen.value - best.value) < SETTLED).all())
            best, at_best = _either(better, tried, best), _either(better, seen, at_best)
            damping = np.where(better, damping / 3, np.minimum(damping * 8, 1e6))
            if settled:
                break
        if step == steps:
            break
        trial = _step_from(best, at_best, damping)
    return best


def _evaluate(
    image: Image, template: ResponseTemplate, at: Lattices, noise: float, shown: Shown | None
) -> _Evaluation:
    """Return how well lattices explain the image, and what a small change would do."""
    felt = normalize_image(image, at.gain)
    cells, offsets = cells_and_offsets(image, at.pose, template.pitch_mm)
    tables = tables_at(template, offsets, at.pose, felt)
    scores = log_likelihoods(felt, tables, np.full(len(at.pose), noise))
    number, dense = _number_cells(cells)
    labels = _best(number, dense, scores) if shown is None else shown(cells)
    value = np.take_along_axis(scores, labels[..., None], axis=2)[..., 0].sum(axis=1)
    value += felt.measure + (felt.trust * np.log(felt.press)).sum(axis=1)
    value -= 0.5 * (_from_prior(image, at) ** 2 * _precision(image)).sum(axis=1)
    values = _values_of(tables, labels, felt)
    jacobian, force = _jacobian(image, at, values, felt)
    width = _width(values, felt, noise)
    away = (image.forces - force) / width
    sure = np.where(np.abs(away) < _FAR, felt.trust, 0.0) / width**2
    weighted = (jacobian * sure[..., None]).swapaxes(1, 2)
    normal = weighted @ jacobian + np.diag(_precision(image))
    left = image.forces - force
    right = (weighted @ left[..., None])[..., 0]
    return _Evaluation(value, normal, right - _from_prior(image, at) * _precision(image))


def _step_from(at: Lattices, seen: _Evaluation, damping: Array) -> Lattices:
    """Return lattices after a Levenberg-Marquardt step."""
    diagonal = np.einsum("bii->bi", seen.normal) * damping[:, None] + _LEAST
    step = np.linalg.solve(
        seen.normal + diagonal[:, :, None] * np.eye(diagonal.shape[1]), seen.right[..., None]
    )[..., 0]
    step = np.clip(step, -_STEP, _STEP)
    pose, gain = at.pose + step[:, :POSE], at.gain + step[:, POSE:]
    pose[:, 3:] = np.clip(pose[:, 3:], -LIMITS, LIMITS)
    gain[:, 1] = np.clip(gain[:, 1], 0.3 * at.gain[:, 1], 0.9)
    return replace(at, pose=pose, gain=bounded_gain(gain))


def _either(better: NDArray[np.bool_], a: Any, b: Any) -> Any:
    """Return the candidates of a where they are better, else those of b."""
    picked = {
        item.name: np.where(
            better.reshape(-1, *[1] * (getattr(a, item.name).ndim - 1)),
            getattr(a, item.name),
            getattr(b, item.name),
        )
        for item in fields(a)
    }
    return type(a)(**picked)


def _from_prior(image: Image, at: Lattices) -> Array:
    """Return how far (b, 11) each unknown lies from what is known of it beforehand."""
    away = np.zeros((len(at.pose), 11))
    away[:, 3:POSE] = at.pose[:, 3:]
    if image.newtons:
        away[:, POSE] = at.gain[:, 0] - math.log(image.pressing.scale)
    return away


def _precision(image: Image) -> Array:
    """Return what is known of each unknown beforehand, one over its variance (11,)."""
    psi_deviation = np.concatenate([PRIOR, [_SCALE_KNOWN if image.newtons else 0.0, 0.0, 0.0, 0.0]])
    return np.where(psi_deviation > 0, 1 / np.maximum(psi_deviation, 1e-9) ** 2, 0.0)


def _width(values: Array, felt: NormalizedImage, noise: float) -> Array:
    """Return the standard deviation (b, n) of forces, from that of psi."""
    relative = noise * psi_deviation(values[:, :, None])[..., 0] / felt.press
    return np.asarray(relative * _by_psi(_response(values[..., 0])) * felt.plateau)


def explained_share(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, shown: Shown
) -> float:
    """Return the share of the variance of psi that given symbols explain where they stand.

    It is less than 0 where they explain nothing.

    Parameters
    ----------
    pose, gain
        (7,) and (4,) of `Lattices`.
    """
    felt = normalize_image(image, gain[None])
    cells, offsets = cells_and_offsets(image, pose[None], template.pitch_mm)
    tables = tables_at(template, offsets, pose[None], felt)
    labels = shown(cells)
    values, seen = _values_of(tables, labels, felt)[0, :, 0], felt.psi[0]
    trust = image.trust * (labels[0] >= 0)
    if image.falls is not None:  # where the face has fallen away there is nothing to explain
        trust = trust * felt.contact[0]
    mean = (trust * seen).sum() / max(trust.sum(), 1e-12)
    whole = float((trust * (seen - mean) ** 2).sum())
    return 1.0 - float((trust * (seen - values) ** 2).sum()) / max(whole, 1e-12)


def initial_lattices(pose: Array, gain: Array) -> Lattices:
    """Return candidates of which nothing is known but pose (b, 3 or 7) and gain (b, 4)."""
    pose = np.pad(pose, ((0, 0), (0, POSE - pose.shape[1])))
    none = np.zeros((len(pose), 11, 11))
    return Lattices(pose, gain, np.zeros(len(pose)), none)


def best_values(
    cells: NDArray[np.int64], tables: Floats, scores: Array, felt: NormalizedImage
) -> Array:
    """Return psi and slopes (b, n, 6) of the symbol that fits best in each cell, or of none."""
    number, dense = _number_cells(cells)
    return _values_of(tables, _best(number, dense, scores), felt)


def tables_at(
    template: ResponseTemplate, offsets: Array, pose: Array, felt: NormalizedImage
) -> Floats:
    """Return templates (b, n, q, 6) at offsets, for what is fitted of form and gain."""
    tables = template.at(offsets)
    for slope, by in enumerate(pose[:, 3:6, None, None].astype(np.float32).swapaxes(0, 1), 3):
        tables[..., 0] += tables[..., slope] * by
    if (felt.contact < 1).any():
        tables *= felt.contact[..., None, None].astype(np.float32)
    if felt.bare.any():
        bare = felt.bare[..., None].astype(np.float32)
        response = _response(tables[..., 0]).astype(np.float32)
        total = response + (1 - response) * bare
        by = (1 - bare) * (1 + 3 * response) / (1 + 3 * total)
        tables = (tables * by[..., None]).astype(np.float32)
        tables[..., 0] = psi(total)
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


def _values_of(tables: Floats, labels: NDArray[np.int64], felt: NormalizedImage) -> Array:
    """Return psi and slopes (b, n, 6) of given symbols, and of the bare face where there is none.

    Beyond the edge of a face nothing is felt: a tactel without a symbol shows what is nearer.
    """
    every = np.arange(labels.size) * tables.shape[2] + labels.clip(min=0).ravel()
    found = tables.reshape(-1, tables.shape[3]).take(every, axis=0).astype(np.float64)
    found = found.reshape(*labels.shape, -1)
    found[labels < 0] = 0.0
    floor = psi(felt.bare)
    bare = (labels < 0) & (felt.psi > floor / 2)
    found[bare, 0] = floor[bare]
    return np.asarray(found)


def _response(table: Array | Floats) -> Array:
    """Return y of psi(y)."""
    return np.asarray(np.expm1(table * np.float32(math.log(4.0))) / np.float32(3.0))


def _by_psi(response: Array) -> Array:
    """Return dy/dpsi."""
    return (1 + 3 * response) * math.log(4.0) / 3.0


def _number_cells(cells: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """Return how many cells there can be over all candidates, and each tactel's number."""
    low = cells.min(axis=1, keepdims=True)
    local = cells - low
    width = int(local.max()) + 1
    count = width * width
    dense = local[..., 1] * width + local[..., 0] + np.arange(len(cells))[:, None] * count
    return count * len(cells), dense


def _jacobian(
    image: Image, at: Lattices, values: Array, felt: NormalizedImage
) -> tuple[Array, Array]:
    """Return the derivatives (b, n, 11) of the forces by pose and gain, and the forces (b, n)."""
    pressing, basis, pose = image.pressing, image.plane, at.pose
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = image.points_mm.T
    across, up = c * x - s * y, s * x + c * y
    slope_x, slope_y = values[..., 1], values[..., 2]
    turn, scale = slope_y * across - slope_x * up, slope_x * across + slope_y * up
    free = np.moveaxis(values[..., 3:], -1, 0)
    by_pose = np.stack([slope_x, slope_y, turn, *free, scale], axis=-1)
    total = _response(values[..., 0])
    by_pose = by_pose * (_by_psi(total) * felt.plateau)[..., None]
    symbol = np.clip((total - felt.bare) / np.maximum(1 - felt.bare, 1e-3), 0.0, 1.5)
    rest = np.where(total > 0, 1 - symbol, 0.0)  # beyond the edge of the face there is none
    unit = np.exp(at.gain[:, :1])
    lower = felt.depth - pressing.symbol
    force = unit * (symbol * felt.plain + rest * felt.lower)
    slope = unit * (symbol * pressing.slope(felt.depth) + rest * pressing.slope(lower))
    by_gain = np.concatenate([force[..., None], slope[..., None] * basis], axis=-1)
    return np.concatenate([by_pose, by_gain], axis=-1), force


@dataclass(frozen=True, slots=True)
class _Evaluation:
    value: Array  # (b,) log-likelihood with what is known beforehand
    normal: Array  # (b, 11, 11)
    right: Array  # (b, 11)
