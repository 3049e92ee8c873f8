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

from probe.sensor import Sensor
from recognizer.symbols.noise import Felt, log_likelihoods, spread
from recognizer.symbols.pressing import Pressing
from recognizer.symbols.template import Floats, Template, psi

Array = NDArray[np.float64]

STEEPEST = 1.7  #: slope of a gain plane; over 1 a part of the sensor hangs in the air
USUAL = 0.25  #: depth of a usual touch, heights of the overlay, where the scale is not known
DAMPING = 0.01  #: of the first step
LEAST_PRESS = 0.2  #: of a tactel where the plane presses little or not at all
LEAST_GAIN = 0.12  #: of the largest over the sensor: below it a tactel tells nothing of symbols
SETTLED = 0.5  #: nats by which a step may still change what is taken as found
NOISE = 0.15  #: standard deviation of psi on a covered tactel, until it is known better
LIMITS = np.array([1.2, 0.7, 0.4, 0.03])  #: of width, cross-talk, exponent - 1, scale - 1
_AROUND = 5  # tactels, side of a neighbourhood
_EVEN = 0.3  # share of the highest readings that the lowest reach on the bare face
_HIGH = 0.06  # and share of the highest of all
_FEW = 10  # tactels, at least
_FAR = 4.0  # standard deviations at which a tactel's loss stops growing
# largest changes in one step: x, y, theta, width, cross-talk, exponent, scale; gain
_STEP = np.array([1.0, 1.0, 0.08, 0.5, 0.5, 0.15, 0.01, 0.3, 0.1, 0.1, 0.1])
_LEAST = np.array([1.0, 1.0, 100.0, 0.1, 0.1, 0.1, 10.0, 1.0, 10.0, 10.0, 10.0])
_PRIOR = np.array([0.0, 0.0, 0.0, 0.6, 0.4, 0.2, 0.01])  # standard deviations; 0: not known
_POSE = len(_PRIOR)
_SCALE_KNOWN = 0.3  # of the logarithm of the force scale, where it is in newtons


@dataclass(frozen=True, slots=True)
class Image:
    """What is fitted: forces of the tactels that tell something."""

    points_mm: Array  #: (n, 2) sensor frame
    forces: Array  #: (n,) newtons, or anything proportional
    trust: Array  #: (n,) 0 ... 1, 0 for bad tactels
    shape: tuple[int, int]  #: rows and columns
    half_mm: Array  #: (2,) half width and half height of the sensor
    pressing: Pressing
    newtons: bool  #: whether the scale of the pressing is that of the forces

    def plane(self) -> Array:
        """Return the basis (n, 3) of planes: 1, x and y over the half widths."""
        return np.column_stack([np.ones(len(self.points_mm)), self.points_mm / self.half_mm])


@dataclass(frozen=True, slots=True)
class Lattices:
    """Candidates: sensor point s lies at R(theta) s + (x, y) in the lattice frame."""

    pose: Array  #: (b, 7) x, y (mm), theta (rad); width, cross-talk, exponent - 1, scale - 1
    gain: Array  #: (b, 4) logarithm of the scale; depth at the centre, slopes per half width
    value: Array  #: (b,) log-likelihood of the image, nats, up to a constant of the image
    normal: Array  #: (b, 11, 11) inverse covariance of `pose` and `gain`, if noise were `NOISE`


def image_of(
    sensor: Sensor, forces: Array, trust: Array, pressing: Pressing, *, newtons: bool
) -> Image:
    """Return what is fitted of a frame: forces (rows, columns), trust (rows, columns)."""
    return Image(
        sensor.centres_mm().reshape(-1, 2),
        forces.reshape(-1).astype(np.float64),
        trust.reshape(-1).astype(np.float64),
        forces.shape,
        np.array(sensor.half_mm),
        pressing,
        newtons,
    )


def first_gain(image: Image, ink: float) -> Array | None:
    """Return the gain (4,) of an image with symbols of mean response `ink` all over.

    None where nothing presses.
    """
    basis = image.plane()
    root = np.sqrt(image.trust)
    plane = np.linalg.lstsq(basis * (root * ink)[:, None], image.forces * root, rcond=None)[0]
    if not (np.isfinite(plane).all() and plane[0] > 0):
        return None
    pressing = image.pressing
    scale = pressing.scale if image.newtons else plane[0] / float(pressing.force(np.array(USUAL)))
    depth = pressing.depth(np.array(plane[0] / scale))
    slopes = plane[1:] / (scale * float(pressing.slope(depth)))
    gain = np.array([math.log(scale), depth, *slopes])
    return np.asarray(bounded_gain(gain[None], 0.9)[0])


def tilted_gain(image: Image) -> Array | None:
    """Return the gain (4,) of an image in which a part of the bare face is pressed; None if not.

    Where a plate tilts over blank ground it comes down on the face itself, far deeper than on
    symbols. There even the lowest readings of a neighbourhood as wide as a symbol are high.
    """
    from scipy.ndimage import percentile_filter

    forces = image.forces.reshape(image.shape)
    low, high = (
        percentile_filter(forces, share, size=_AROUND, mode="nearest").reshape(-1)
        for share in (20, 80)
    )
    known = image.trust > 0
    flat = known & (low > _EVEN * high) & (low > _HIGH * np.max(high))
    top = known & (low < _EVEN / 2 * high) & (image.forces > 0.8 * high)
    if flat.sum() < _FEW or top.sum() < _FEW:
        return None
    pressing = image.pressing
    scale = pressing.scale
    if not image.newtons:
        scale = float(np.median(image.forces[top])) / float(pressing.force(np.array(USUAL)))
    depth = pressing.depth(image.forces / scale) + np.where(flat, pressing.symbol, 0.0)
    basis, sure = image.plane(), np.sqrt(image.trust * (flat | top))
    plane = np.linalg.lstsq(basis * sure[:, None], depth * sure, rcond=None)[0]
    if not (np.isfinite(plane).all() and plane[0] > 0):
        return None
    return np.asarray(bounded_gain(np.array([[math.log(scale), *plane]]))[0])


def bounded_gain(gain: Array, steepest: float = STEEPEST) -> Array:
    """Return gains (b, 4) whose slopes are at most `steepest` times the depth at the centre."""
    slope = np.abs(gain[:, 2:]).sum(axis=1)
    limit = steepest * gain[:, 1]
    factor = np.where(slope > limit, limit / np.maximum(slope, 1e-300), 1.0)
    return np.column_stack([gain[:, :2], gain[:, 2:] * factor[:, None]])


def felt_under(image: Image, gain: Array) -> Felt:
    """Return the image as it is under gains (b, 4)."""
    depth = gain[:, 1:] @ image.plane().T
    plain = image.pressing.force(depth)
    least = LEAST_GAIN * plain.max(axis=1, keepdims=True)
    share = np.maximum(plain, least)
    divisor = np.exp(gain[:, :1]) * share
    return Felt(
        psi=psi(image.forces / divisor),
        press=np.clip(depth / (0.5 * gain[:, 1:2]), LEAST_PRESS, 1.0),
        bare=image.pressing.force(depth - image.pressing.symbol) / share,
        contact=np.clip(plain / least, 0.0, 1.0),
        trust=image.trust,
        measure=-(image.trust * np.log(divisor + 3.0 * image.forces)).sum(axis=1),
    )


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
    best = start
    trial, damping = start, np.full(len(start.pose), DAMPING)
    for step in range(steps + 1):
        seen = _seen(image, template, trial, noise, shown)
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
        trial = _moved(best, at_best, damping)
    return best


def _seen(
    image: Image, template: Template, at: Lattices, noise: float, shown: Shown | None
) -> _Seen:
    """Return how well lattices explain the image, and what a small change would do."""
    felt = felt_under(image, at.gain)
    cells, offsets = cells_and_offsets(image, at.pose, template.pitch_mm)
    tables = tables_at(template, offsets, at.pose, felt)
    scores = log_likelihoods(felt, tables, np.full(len(at.pose), noise))
    number, dense = _numbered(cells)
    labels = _best(number, dense, scores) if shown is None else shown(cells)
    value = np.take_along_axis(scores, labels[..., None], axis=2)[..., 0].sum(axis=1)
    value += felt.measure + (felt.trust * np.log(felt.press)).sum(axis=1)
    value -= 0.5 * (_known(image, at) ** 2 * _precision(image)).sum(axis=1)
    values = _labelled(tables, labels, felt)
    jacobian, force = _jacobian(image, at, values, felt)
    width = _width(image, at, values, felt, noise)
    away = (image.forces - force) / width
    sure = np.where(np.abs(away) < _FAR, felt.trust, 0.0) / width**2
    weighted = (jacobian * sure[..., None]).swapaxes(1, 2)
    normal = weighted @ jacobian + np.diag(_precision(image))
    left = image.forces - force
    right = (weighted @ left[..., None])[..., 0]
    return _Seen(value, normal, right - _known(image, at) * _precision(image))


def _moved(at: Lattices, seen: _Seen, damping: Array) -> Lattices:
    """Return lattices after a Levenberg-Marquardt step."""
    diagonal = np.einsum("bii->bi", seen.normal) * damping[:, None] + _LEAST
    step = np.linalg.solve(
        seen.normal + diagonal[:, :, None] * np.eye(diagonal.shape[1]), seen.right[..., None]
    )[..., 0]
    step = np.clip(step, -_STEP, _STEP)
    pose, gain = at.pose + step[:, :_POSE], at.gain + step[:, _POSE:]
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


def _known(image: Image, at: Lattices) -> Array:
    """Return how far (b, 11) each unknown lies from what is known of it beforehand."""
    away = np.zeros((len(at.pose), 11))
    away[:, 3:_POSE] = at.pose[:, 3:]
    if image.newtons:
        away[:, _POSE] = at.gain[:, 0] - math.log(image.pressing.scale)
    return away


def _precision(image: Image) -> Array:
    """Return what is known of each unknown beforehand, one over its variance (11,)."""
    spread = np.concatenate([_PRIOR, [_SCALE_KNOWN if image.newtons else 0.0, 0.0, 0.0, 0.0]])
    return np.where(spread > 0, 1 / np.maximum(spread, 1e-9) ** 2, 0.0)


def _width(image: Image, at: Lattices, values: Array, felt: Felt, noise: float) -> Array:
    """Return the standard deviation (b, n) of forces, from that of psi."""
    total = _response(values[..., 0])
    by_psi = (1 + 3 * total) * math.log(4.0) / 3.0
    relative = noise * spread(values[:, :, None])[..., 0] / felt.press
    return np.asarray(relative * by_psi * _plateau(image, at))


def _plateau(image: Image, at: Lattices) -> Array:
    """Return the force (b, n) on a plateau at every tactel, with the floor of `felt_under`."""
    plain = image.pressing.force(at.gain[:, 1:] @ image.plane().T)
    least = LEAST_GAIN * plain.max(axis=1, keepdims=True)
    return np.asarray(np.exp(at.gain[:, :1]) * np.maximum(plain, least))


def explained_share(
    image: Image, template: Template, pose: Array, gain: Array, shown: Shown
) -> float:
    """Return the share of the variance of psi that given symbols explain where they stand.

    It is less than 0 where they explain nothing.

    Parameters
    ----------
    pose, gain
        (7,) and (4,) of `Lattices`.
    """
    felt = felt_under(image, gain[None])
    cells, offsets = cells_and_offsets(image, pose[None], template.pitch_mm)
    tables = tables_at(template, offsets, pose[None], felt)
    labels = shown(cells)
    values, seen = _labelled(tables, labels, felt)[0, :, 0], felt.psi[0]
    trust = image.trust * (labels[0] >= 0)
    mean = (trust * seen).sum() / max(trust.sum(), 1e-12)
    whole = float((trust * (seen - mean) ** 2).sum())
    return 1.0 - float((trust * (seen - values) ** 2).sum()) / max(whole, 1e-12)


def started(pose: Array, gain: Array) -> Lattices:
    """Return candidates of which nothing is known but pose (b, 3 or 7) and gain (b, 4)."""
    pose = np.pad(pose, ((0, 0), (0, _POSE - pose.shape[1])))
    none = np.zeros((len(pose), 11, 11))
    return Lattices(pose, gain, np.zeros(len(pose)), none)


def chosen(cells: NDArray[np.int64], tables: Floats, scores: Array, felt: Felt) -> Array:
    """Return psi and slopes (b, n, 6) of the symbol that fits best in each cell, or of none."""
    number, dense = _numbered(cells)
    return _labelled(tables, _best(number, dense, scores), felt)


def tables_at(template: Template, offsets: Array, pose: Array, felt: Felt) -> Floats:
    """Return templates (b, n, q, 6) at offsets, for what is fitted of form and gain."""
    tables = template.at(offsets)
    by = pose[:, 3:6].astype(np.float32)[:, None, :, None]
    tables[..., 0] += (tables[..., 3:] @ by)[..., 0]
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


def _labelled(tables: Floats, labels: NDArray[np.int64], felt: Felt) -> Array:
    """Return psi and slopes (b, n, 6) of given symbols, and of the bare face where there is none.

    Beyond the edge of a face nothing is felt: a tactel without a symbol shows what is nearer.
    """
    values = np.take_along_axis(tables, labels.clip(min=0)[..., None, None], axis=2)[:, :, 0]
    found = np.where((labels >= 0)[..., None], values, 0).astype(np.float64)
    floor = psi(felt.bare)
    bare = (labels < 0) & (felt.psi > floor / 2)
    found[bare, 0] = floor[bare]
    return found


def _response(table: Array | Floats) -> Array:
    """Return y of psi(y)."""
    return np.asarray(np.expm1(table * np.float32(math.log(4.0))) / np.float32(3.0))


def _numbered(cells: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """Return how many cells there can be over all candidates, and each tactel's number."""
    low = cells.min(axis=1, keepdims=True)
    local = cells - low
    width = int(local.max()) + 1
    count = width * width
    dense = local[..., 1] * width + local[..., 0] + np.arange(len(cells))[:, None] * count
    return count * len(cells), dense


def _jacobian(image: Image, at: Lattices, values: Array, felt: Felt) -> tuple[Array, Array]:
    """Return the derivatives (b, n, 11) of the forces by pose and gain, and the forces (b, n)."""
    pressing, basis, pose = image.pressing, image.plane(), at.pose
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = image.points_mm.T
    across, up = c * x - s * y, s * x + c * y
    slope_x, slope_y = values[..., 1], values[..., 2]
    turn, scale = slope_y * across - slope_x * up, slope_x * across + slope_y * up
    free = np.moveaxis(values[..., 3:], -1, 0)
    by_pose = np.stack([slope_x, slope_y, turn, *free, scale], axis=-1)
    total = _response(values[..., 0])
    by_psi = (1 + 3 * total) * math.log(4.0) / 3.0
    by_pose = by_pose * (by_psi * _plateau(image, at))[..., None]
    depth = at.gain[:, 1:] @ basis.T
    symbol = np.clip((total - felt.bare) / np.maximum(1 - felt.bare, 1e-3), 0.0, 1.5)
    rest = np.where(total > 0, 1 - symbol, 0.0)  # beyond the edge of the face there is none
    unit = np.exp(at.gain[:, :1])
    lower = depth - pressing.symbol
    force = unit * (symbol * pressing.force(depth) + rest * pressing.force(lower))
    slope = unit * (symbol * pressing.slope(depth) + rest * pressing.slope(lower))
    by_gain = np.concatenate([force[..., None], slope[..., None] * basis], axis=-1)
    return np.concatenate([by_pose, by_gain], axis=-1), force


@dataclass(frozen=True, slots=True)
class _Seen:
    value: Array  # (b,) log-likelihood with what is known beforehand
    normal: Array  # (b, 11, 11)
    right: Array  # (b, 11)
