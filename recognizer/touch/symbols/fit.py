"""The joint fit: image -> a few lattices, each with the scores of every cell in view.

Forces (newtons, or counts that rise with force) -> Fit: pose of the sensor on the lattice of
symbols, gain, and for every cell of the lattice under the sensor the log-likelihood of each
symbol and of none. Whole and partial symbols count alike: each with what it shows.
Lattice frame: mm; cell (i, j) is the i-th column and the j-th row upwards, its symbol's
axes are the frame's. A sensor point s lies at R(theta) s + (x, y). Thesis 6.2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.settings import FitSettings
from recognizer.touch.symbols.compiled import CellSums, sum_cells_compiled
from recognizer.touch.symbols.covariance import covariances
from recognizer.touch.symbols.deep_press import deep_gain
from recognizer.touch.symbols.gain import Image, first_gain, normalize_image, tilted_gain
from recognizer.touch.symbols.kernels import compiled_kernels
from recognizer.touch.symbols.noise import log_likelihoods, psi_deviation
from recognizer.touch.symbols.projection import (
    Projection,
    likeliest_labels,
    project_template,
    values_of,
)
from recognizer.touch.symbols.refine import Lattices, refine_lattices
from recognizer.touch.symbols.search import Bank, search
from recognizer.touch.symbols.template import PSI, ResponseTemplate, psi

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """One way to see symbols in an image."""

    x_mm: float
    y_mm: float
    theta_rad: float
    nuisance: Array  #: (4,) width, cross-talk, exponent - 1, scale - 1
    gain: Array  #: (4,) logarithm of the scale, depth, and its slopes, `pressing`
    cells: NDArray[np.int64]  #: (m, 2) column and upward row of the cells in view
    scores: Array  #: (m, q + 1) log-likelihoods, nats, 0 for the best; the last one: no symbol
    seen: Array  #: (m,) tactels that look at the cell, by how hard they press
    noise: float  #: standard deviation of psi with which the scores were made
    value: float  #: log-likelihood of the image with every cell at its best, nats
    covariance: Array  #: (3, 3) of x, y (mm) and theta (rad); NaN where it was not asked for
    with_scale: Array | None = None  #: (4,) covariance of scale - 1 with these, and its variance

    @property
    def pose(self) -> Array:
        """Return (7,) of `refine.Lattices`."""
        return np.array([self.x_mm, self.y_mm, self.theta_rad, *self.nuisance])

    @property
    def scale(self) -> float:
        """Return the size of the print as it is felt, 1 as designed."""
        return 1.0 / (1.0 + float(self.nuisance[3]))

    @property
    def stroke_excess(self) -> float:
        """Return by how much strokes are felt wider than designed, `TemplateSettings.wider_mm`."""
        return float(self.nuisance[0])


def fit_lattices(
    image: Image,
    template: ResponseTemplate,
    bank: Bank,
    settings: FitSettings,
    gains: Sequence[Array] | None = None,
    *,
    told: bool = True,
) -> tuple[Fit, ...]:
    """Return the likeliest lattices of an image, best first; none if nothing is pressed.

    Gains to begin with, (4,) each, are guessed from the image if they are not given. `told`:
    whether covariances are asked for.
    """
    if gains is None:
        deep = deep_gain(image)
        guessed = (first_gain(image, template.ink), tilted_gain(image) if deep is None else deep)
        gains = [gain for gain in guessed if gain is not None]
    starts = [_search_under(image, template, bank, gain, settings.candidates) for gain in gains]
    if sum(len(start) for start in starts) == 0:
        return ()
    each = [len(start) for start in starts]
    pose, gain = np.concatenate(starts), np.repeat(gains, each, axis=0)
    lattices = refine_lattices(image, template, pose, gain, steps=settings.steps, told=False)
    if settings.crossed:
        lattices = _cross_gains(image, template, lattices, settings.crossed)
    best = _distinct_lattices(image, template, lattices)[: settings.finalists]
    pose, gain = lattices.pose[best], lattices.gain[best]
    lattices = refine_lattices(image, template, pose, gain, steps=settings.final_steps, told=told)
    found = score_cells(image, template, lattices, told=told)
    return tuple(found[b] for b in _distinct_lattices(image, template, lattices))


def _distinct_lattices(image: Image, template: ResponseTemplate, found: Lattices) -> list[int]:
    """Return the numbers of lattices, best first, each once."""
    same, pitch = image.settings.search, template.pitch_mm
    kept: list[int] = []
    for b in np.argsort(-found.value, kind="stable").tolist():
        away = found.pose[kept, :3] - found.pose[b, :3]
        shift = np.abs((away[:, :2] / pitch + 0.5) % 1.0 - 0.5).max(axis=1)
        turn = np.abs((away[:, 2] / math.pi + 1.0) % 2.0 - 1.0)
        if not ((shift < same.same_shift) & (turn < same.same_turn)).any():
            kept.append(b)
    return kept


def _cross_gains(image: Image, template: ResponseTemplate, found: Lattices, gains: int) -> Lattices:
    """Return lattices, and the same turned by quarters, each under the best of several gains.

    A square lattice turned by a quarter is one again, so all four see the image alike but for
    the symbols; and a lattice may be stuck under a gain from which another one got away.
    """
    best = np.argsort(-found.value, kind="stable")
    tried = []
    pose = found.pose[best[: 2 * gains]]
    for _ in range(4):
        tried.append(pose)
        pose = pose.copy()
        pose[:, 0], pose[:, 1] = -pose[:, 1], pose[:, 0].copy()
        pose[:, 2] += math.pi / 2
    poses = np.concatenate([*tried, found.pose[np.sort(best[2 * gains :])]])
    each = [
        refine_lattices(image, template, poses, one, steps=1, told=False)
        for one in np.repeat(found.gain[best[:gains], None], len(poses), axis=1)
    ]
    kept = np.argmax([lattices.value for lattices in each], axis=0)
    rows = np.arange(len(poses))
    picked = {
        item.name: np.stack([getattr(lattices, item.name) for lattices in each])[kept, rows]
        for item in fields(Lattices)
    }
    return Lattices(**picked)


def _search_under(
    image: Image, template: ResponseTemplate, bank: Bank, gain: Array, keep: int
) -> Array:
    """Return the best lattices (n, 3) of the coarse search under a gain."""
    felt = normalize_image(image, gain[None])
    response, bare = (np.expm1(felt.psi[0] * math.log(1 + PSI)) / PSI, felt.bare[0])
    rest = np.maximum(1.0 - bare, image.settings.search.least_rest)
    seen = psi(np.maximum(response - bare, 0.0) / rest)
    weights = (felt.press[0] * rest) ** 2 * felt.trust
    return search(
        bank,
        seen.reshape(bank.shape).astype(np.float32),
        weights.reshape(bank.shape).astype(np.float32),
        template.order,
        keep,
    )


def score_cells(
    image: Image,
    template: ResponseTemplate,
    lattices: Lattices,
    *,
    told: bool = True,
) -> tuple[Fit, ...]:
    """Return the fits of lattices with the scores of all their cells, in their order.

    Scores are made with the noise that the likeliest lattice leaves. `told`: whether their normal
    matrices are, and so covariances can be.
    """
    sums = _sum_cells(image, template, lattices)
    covariance = np.full((len(lattices.pose), 3, 3), math.nan)
    if told:
        covariance = covariances(image, lattices, sums.left * image.trust, sums.noise)
    unit = float(image.trust.sum()) * math.log(sums.noise)
    found = []
    for b, count in enumerate(sums.count.tolist()):
        scores = sums.scores[b, :count]
        most = scores.max(axis=1)
        found.append(
            Fit(
                x_mm=float(lattices.pose[b, 0]),
                y_mm=float(lattices.pose[b, 1]),
                theta_rad=math.remainder(float(lattices.pose[b, 2]), 2 * math.pi),
                nuisance=lattices.pose[b, 3:],
                gain=lattices.gain[b],
                cells=sums.cells[b, :count],
                scores=scores - most[:, None],
                seen=sums.seen[b, :count],
                noise=sums.noise,
                value=float(most.sum() + sums.level[b] - unit),
                covariance=covariance[b],
            )
        )
    return tuple(found)


def _sum_cells(image: Image, template: ResponseTemplate, lattices: Lattices) -> CellSums:
    """Return what the cells in view of lattices score, and what that is judged by."""
    settings, best = image.settings.noise, int(np.argmax(lattices.value))
    library = compiled_kernels()
    if library is not None:
        return sum_cells_compiled(library, image, template, lattices.pose, lattices.gain, best)
    under = project_template(image, template, lattices.pose, lattices.gain)
    felt, cells = under.felt, under.cells
    away = _residuals(under)
    bounded = np.minimum(np.abs(away[best]), settings.far * settings.first)
    left = math.sqrt(float((felt.trust * bounded**2).sum() / felt.trust.sum()))
    noise = max(settings.least, left)
    each = log_likelihoods(felt, under.tables, np.full(len(cells), noise))
    level = felt.measure + (felt.trust * np.log(felt.press)).sum(axis=1)
    count = np.zeros(len(cells), np.int64)
    names, scores, seen = np.zeros_like(cells), np.zeros_like(each), np.zeros_like(away)
    for b in range(len(cells)):
        known, dense = np.unique(cells[b], axis=0, return_inverse=True)
        dense, count[b] = dense.reshape(-1), len(known)
        names[b, : count[b]] = known
        for k, column in enumerate(each[b].T):
            scores[b, : count[b], k] = np.bincount(dense, column, len(known))
        seen[b, : count[b]] = np.bincount(dense, felt.press[b] * felt.trust, len(known))
    return CellSums(noise, count, names, scores, seen, level, away)


def _residuals(under: Projection) -> Array:
    """Return how far (b, n) readings lie from the likeliest labels, on a covered tactel's scale."""
    felt, cells = under.felt, under.cells
    scores = log_likelihoods(felt, under.tables, np.full(len(cells), felt.settings.first))
    values = values_of(under, likeliest_labels(cells, scores, felt.settings.tie))
    unit = felt.settings.first / felt.press
    deviation = psi_deviation(felt, values[:, :, None], unit)[..., 0]
    return (felt.psi - values[..., 0]) * felt.press / deviation
