"""Where a lattice of known symbols lies, and how sure that is: its last fit.

Image + a lattice near the truth + what its cells show -> pose, gain and their covariance. What a
sensor may be off by decides what each tactel is worth and how wide the ellipse is: how far its
readings scatter and how far its tips stand aside is fitted to each touch (`spread`), together with
what it adds to all readings alike and what neighbouring readings hold of each other (`blur`), which
makes slopes less steep than the template's. Damped least squares; lattice and sensor frame, mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.blur import second_differences
from recognizer.touch.symbols.compiled import LastSteps, fit_posterior_compiled
from recognizer.touch.symbols.covariance import invert_normal
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.gain import Image, bounded_gain
from recognizer.touch.symbols.kernels import compiled_kernels
from recognizer.touch.symbols.projection import (
    Shown,
    project_symbols,
    response_by_psi,
    response_of,
)
from recognizer.touch.symbols.refine import (
    POSE,
    force_jacobian,
    prior_departure,
    prior_precision,
)
from recognizer.touch.symbols.spread import TactelScatter, fit_spread, usual_spread
from recognizer.touch.symbols.template import ResponseTemplate

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PosePosterior:
    """A pose, as far as one touch tells it."""

    pose: Array  #: (7,) of `refine.Lattices`
    gain: Array  #: (4,)
    covariance: Array  #: (4, 4) of x, y (mm), theta (rad) and scale - 1
    spread: TactelScatter
    blur: tuple[float, float]  #: shares of each neighbour in a row's, in a column's reading


@dataclass(frozen=True, slots=True, eq=False)
class _Linearized:
    """An image about one lattice."""

    pose: Array
    gain: Array
    more: Array  # (3,) offset, blur across rows and across columns
    left: Array  # (n,) forces that are left over
    parts: Array  # (2, n) of `spread`
    jacobian: Array  # (n, 14) forces by pose, gain and these three
    departure: Array  # (14,) how far each unknown lies from what is known beforehand


def refit_pose(image: Image, template: ResponseTemplate, fit: Fit, shown: Shown) -> Fit:
    """Return a fit with pose, gain and covariance as its symbols tell them."""
    found = fit_posterior(image, template, fit.pose, fit.gain, shown)
    return replace(
        fit,
        x_mm=float(found.pose[0]),
        y_mm=float(found.pose[1]),
        theta_rad=math.remainder(float(found.pose[2]), math.tau),
        nuisance=found.pose[3:],
        gain=found.gain,
        covariance=found.covariance[:3, :3],
        with_scale=found.covariance[3],
    )


def fit_posterior(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, shown: Shown
) -> PosePosterior:
    """Return the pose of a lattice whose symbols are known.

    Parameters
    ----------
    pose, gain
        (7,) and (4,), to begin with.
    shown
        What the cells show.
    """
    least, most = _step_bounds(image)
    how = LastSteps(
        image.settings.posterior.steps, image.settings.spread, least, most, _precision(image)
    )
    library = compiled_kernels()
    found = None
    if library is not None:
        found = fit_posterior_compiled(library, image, template, pose, gain, shown, how)
    pose, gain, more, now, normal = found or _fit(image, template, pose, gain, shown, how)
    told = invert_normal(normal, image.settings.covariance.unseen)
    rows = [0, 1, 2, POSE - 1]
    covariance = _size(image, pose, more) * told[rows][:, rows]
    spread = TactelScatter(math.sqrt(now[0]), math.sqrt(now[1]))
    return PosePosterior(pose, gain, covariance, spread, (float(more[1]), float(more[2])))


def _fit(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, shown: Shown, how: LastSteps
) -> tuple[Array, Array, Array, Array, Array]:
    """Return what `compiled.fit_posterior_compiled` says."""
    known, trust, freedom = np.diag(how.known), image.trust, how.spread.freedom
    at = _linearize(image, template, pose, gain, np.zeros(3), shown)
    spread, damping = usual_spread(how.spread), image.settings.refine.damping
    for step in range(how.steps + 1):
        spread = fit_spread(spread, at.left, at.parts, at.jacobian, known, trust, how.spread)
        weights = spread.weights(at.left, at.parts, trust, freedom)
        weighted = (at.jacobian * weights[:, None]).T
        normal = weighted @ at.jacobian + known
        if step == how.steps:
            break
        right = weighted @ at.left - known @ at.departure
        moved = _move(image, at, normal, right, damping, how)
        tried = _linearize(image, template, *moved, shown)
        before, after = (
            spread.log_likelihood(one.left, one.parts, trust, freedom)
            - 0.5 * float(one.departure @ known @ one.departure)
            for one in (at, tried)
        )
        if after > before:
            at, damping = tried, damping / image.settings.refine.easier
        else:
            damping *= image.settings.refine.harder
    return at.pose, at.gain, at.more, np.square([spread.felt, spread.aside_mm]), normal


def _linearize(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, more: Array, shown: Shown
) -> _Linearized:
    noise = image.settings.noise
    felt, _, values = project_symbols(image, template, pose[None], gain[None], shown)
    jacobian, force = (
        one[0] for one in force_jacobian(image, pose[None], gain[None], values, felt)
    )
    value, plateau, press = values[0], felt.plateau[0], felt.press[0]
    unit = response_by_psi(response_of(value[:, 0])) * plateau / press
    columns = np.ones((len(force), 3))
    columns[:, 1:2], columns[:, 2:] = second_differences(force[:, None], image.shape)
    rows, across = second_differences(jacobian, image.shape)
    jacobian = jacobian + (more[1] * rows + more[2] * across)
    parts = np.empty((2, len(force)))
    parts[0] = noise.quiet**2 + value[:, 0] ** 2
    parts[1] = image.aside * (value[:, 1] ** 2 + value[:, 2] ** 2)
    parts *= unit**2
    left = image.forces - force - columns @ more
    departure = np.concatenate([prior_departure(image, pose[None], gain[None])[0], more])
    jacobian = np.concatenate([jacobian, columns], axis=1)
    return _Linearized(pose, gain, more, left, parts, jacobian, departure)


def _move(
    image: Image, at: _Linearized, normal: Array, right: Array, damping: float, how: LastSteps
) -> tuple[Array, Array, Array]:
    """Return pose, gain and the sensor's unknowns a damped step further."""
    refine = image.settings.refine
    lattice, limits = len(at.pose) + len(at.gain), np.array(refine.limits)
    system = normal.copy()
    system.flat[:: len(system) + 1] += np.diagonal(normal) * damping + how.least
    step = _clip(np.asarray(np.linalg.solve(system, right)), how.most)
    pose, gain = at.pose + step[:POSE], at.gain + step[POSE:lattice]
    pose[3:] = _clip(pose[3:], limits)
    gain[1] = min(max(gain[1], refine.shallower * at.gain[1]), refine.deepest)
    gain = bounded_gain(gain[None], image.settings.gain.steepest)[0]
    return pose, gain, at.more + step[lattice:]


def _step_bounds(image: Image) -> tuple[Array, Array]:
    """Return what the diagonal gains (14,), and the largest step (14,)."""
    refine, settings = image.settings.refine, image.settings.posterior
    most = np.array([*refine.step, *settings.step])
    most[len(refine.step)] *= float(image.forces.max())
    return np.array([*refine.least, *settings.least]), most


def _clip(values: Array, most: Array) -> Array:
    return np.asarray(np.minimum(np.maximum(values, -most), most))


def _precision(image: Image) -> Array:
    """Return what is known of each unknown beforehand, one over its variance (14,)."""
    settings = image.settings.posterior
    offset = settings.offset * max(float(image.forces.max()), 1e-12)
    more = 1.0 / np.square([offset, settings.blur, settings.blur])
    return np.concatenate([prior_precision(image), more])


def _size(image: Image, pose: Array, more: Array) -> float:
    """Return by how much the covariance is wider than least squares say.

    Readings that hold much of each other do so in a way that no second difference tells. And where
    strokes are felt in another form than was known beforehand, more of the template is wrong than
    the fitted part of it: what is not fitted moves all symbols alike, so that nothing of it is left
    over (`docs/recognizer.md`, "How sure it is").
    """
    settings, refine = image.settings.covariance, image.settings.refine
    heard = image.settings.template.cross_talk * (1 + float(pose[4]))
    heard += 2 * float(more[1:].sum())
    blurred = settings.blurred * max(0.0, heard - settings.usual_blur)
    away = pose[3 : POSE - 1] / np.array(refine.prior[3 : POSE - 1])
    strange = max(0.0, float(away @ away) - settings.usual_form)
    return (settings.size + blurred) * (1 + settings.form * strange)
