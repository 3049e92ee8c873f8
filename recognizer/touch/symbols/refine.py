"""Refinement: pose and gain by damped least squares, labels chosen anew at every step.

With the labels held, the image is psi(f / g) = T_label(R(theta) s + (x, y) - cell), g the
force on a plateau (`pressing`). Pose and gain move together, by weighted least squares over the
tactels, for all candidates at once; `NoiseSettings.first` says what each is worth. Lattice frame
and sensor frame in mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.settings import RefineSettings
from recognizer.touch.symbols.compiled import refine_compiled
from recognizer.touch.symbols.damped import ascend, damped_step
from recognizer.touch.symbols.gain import Image, bounded_gain
from recognizer.touch.symbols.kernels import compiled_kernels
from recognizer.touch.symbols.noise import NormalizedImage, log_likelihoods, psi_deviation
from recognizer.touch.symbols.projection import (
    Shown,
    likeliest_labels,
    project_template,
    response_by_psi,
    response_of,
    values_of,
)
from recognizer.touch.symbols.template import ResponseTemplate

Array = NDArray[np.float64]

POSE = 7  #: unknowns of `Lattices.pose`


@dataclass(frozen=True, slots=True)
class Lattices:
    """Candidates: sensor point s lies at R(theta) s + (x, y) in the lattice frame."""

    pose: Array  #: (b, 7) x, y (mm), theta (rad); width, cross-talk, exponent - 1, scale - 1
    gain: Array  #: (b, 4) logarithm of the scale; depth at the centre, slopes per half width
    value: Array  #: (b,) log-likelihood of the image, nats, up to a constant of the image
    normal: Array  #: (b, 11, 11) inverse covariance of pose and gain under `NoiseSettings.first`
    right: Array  #: (b, 11) slope of the log-likelihood by them


def refine_lattices(
    image: Image,
    template: ResponseTemplate,
    pose: Array,
    gain: Array,
    *,
    steps: int,
    shown: Shown | None = None,
    told: bool = True,
) -> Lattices:
    """Return candidates after damped steps, with their log-likelihoods.

    Parameters
    ----------
    pose
        (b, 7), or (b, 3) where nothing is known of the rest.
    gain
        (b, 4).
    steps
        How many, at most.
    shown
        What the cells show, where that is known; otherwise each cell shows what fits best.
    told
        Whether `normal` and `right` are asked for: without, they are those of some step.
    """
    whole = np.zeros((len(pose), POSE))
    whole[:, : pose.shape[1]] = pose
    library = compiled_kernels()
    if library is not None:
        precision = prior_precision(image)
        return Lattices(
            *refine_compiled(
                library, image, template, whole, gain, precision, steps, shown, told=told
            )
        )
    settings = image.settings.refine
    least, most = np.array(settings.least), np.array(settings.step)
    limits = np.array(settings.limits)

    def moved(at: Lattices, damping: Array) -> Lattices:
        step = np.clip(damped_step(at, damping, least), -most, most)
        pose, gain = at.pose + step[:, :POSE], at.gain + step[:, POSE:]
        pose[:, 3:] = np.clip(pose[:, 3:], -limits, limits)
        gain[:, 1] = np.clip(gain[:, 1], settings.shallower * at.gain[:, 1], settings.deepest)
        gain = bounded_gain(gain, image.settings.gain.steepest)
        return _evaluate_lattices(image, template, pose, gain, shown)

    start = _evaluate_lattices(image, template, whole, gain, shown)
    return ascend(start, moved, steps, settings, settings.settled)


@dataclass(frozen=True, slots=True)
class LinearizedImage:
    """An image about b poses and gains, each tactel weighed by what it is worth."""

    value: Array  #: (b,) log-likelihood of the image, nats, up to a constant of the image
    jacobian: Array  #: (b, n, 11) forces by pose and gain
    left: Array  #: (b, n) forces that are left over
    sure: Array  #: (b, n) one over their variances; 0 where a tactel does not pull
    known: Array  #: (b, 11) how far each unknown lies from what is known of it beforehand
    precision: Array  #: (11,) of that


def _evaluate_lattices(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, shown: Shown | None
) -> Lattices:
    """Return how well lattices explain the image, and what a small change would do."""
    at = linearize_image(image, template, pose, gain, shown)
    weighted = (at.jacobian * at.sure[..., None]).swapaxes(1, 2)
    normal = weighted @ at.jacobian + np.diag(at.precision)
    right = (weighted @ at.left[..., None])[..., 0] - at.known * at.precision
    return Lattices(pose, gain, at.value, normal, right)


def linearize_image(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, shown: Shown | None
) -> LinearizedImage:
    """Return how well lattices explain the image, and what changes with pose and gain.

    Parameters
    ----------
    pose, gain
        (b, 7) and (b, 4) of `Lattices`.
    shown
        As for `refine_lattices`.
    """
    noise = image.settings.noise
    under = project_template(image, template, pose, gain)
    felt, cells = under.felt, under.cells
    scores = log_likelihoods(felt, under.tables, np.full(len(pose), noise.first))
    labels = likeliest_labels(cells, scores, noise.tie) if shown is None else shown(cells)
    known, precision = prior_departure(image, pose, gain), prior_precision(image)
    value = np.take_along_axis(scores, labels[..., None], axis=2)[..., 0].sum(axis=1)
    value += felt.measure + (felt.trust * np.log(felt.press)).sum(axis=1)
    value -= 0.5 * (known**2 * precision).sum(axis=1)
    values = values_of(under, labels)
    jacobian, force = force_jacobian(image, pose, gain, values, felt)
    width = _width(values, felt, noise.first)
    left = image.forces - force
    sure = np.where(np.abs(left / width) < noise.far, felt.trust, 0.0) / width**2
    return LinearizedImage(value, jacobian, left, sure, known, precision)


def prior_departure(image: Image, pose: Array, gain: Array) -> Array:
    """Return how far (b, 11) each unknown lies from what is known of it beforehand."""
    away = np.zeros((len(pose), 11))
    away[:, 3:POSE] = pose[:, 3:]
    if image.newtons:
        away[:, POSE] = gain[:, 0] - math.log(image.pressing.scale)
    return away


def prior_precision(image: Image) -> Array:
    """Return what is known of each unknown beforehand, one over its variance (11,)."""
    return _precision_of(image.settings.refine, newtons=image.newtons)


@lru_cache(maxsize=8)
def _precision_of(settings: RefineSettings, *, newtons: bool) -> Array:
    scale = settings.scale_known if newtons else 0.0
    deviation = np.array([*settings.prior, scale, 0.0, 0.0, 0.0])
    precision = np.where(deviation > 0, 1 / np.maximum(deviation, 1e-9) ** 2, 0.0)
    precision.setflags(write=False)
    return precision


def _width(values: Array, felt: NormalizedImage, noise: float) -> Array:
    """Return the standard deviation (b, n) of forces, from that of psi."""
    unit = noise / felt.press
    relative = unit * psi_deviation(felt, values[:, :, None], unit)[..., 0]
    return np.asarray(relative * response_by_psi(response_of(values[..., 0])) * felt.plateau)


def force_jacobian(
    image: Image, pose: Array, gain: Array, values: Array, felt: NormalizedImage
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
    by_pose = by_pose * (response_by_psi(total) * felt.plateau)[..., None]
    symbol = np.clip((total - felt.bare) / np.maximum(1 - felt.bare, 1e-3), 0.0, 1.5)
    # beyond the edge of the face there is none
    rest = np.where(values[..., 0] > image.settings.noise.grazed, 1 - symbol, 0.0)
    unit = np.exp(gain[:, :1])
    lower = felt.depth - pressing.symbol
    force = unit * (symbol * felt.plain + rest * felt.lower)
    slope = unit * (symbol * pressing.slope(felt.depth) + rest * pressing.slope(lower))
    by_gain = np.concatenate([force[..., None], slope[..., None] * basis], axis=-1)
    return np.concatenate([by_pose, by_gain], axis=-1), force
