"""The joint fit: image -> a few lattices, each with the scores of every cell in view.

Forces (newtons, or counts that rise with force) -> Fit: pose of the sensor on the lattice of
symbols, gain, and for every cell of the lattice under the sensor the log-likelihood of each symbol
and of none, partial symbols included. A coarse search under a few gains gives candidates; damped
least squares refines them, labels chosen again at every step. Lattice frame: mm; cell (i, j) is the
i-th column and the j-th row upwards, its symbol's axes are the frame's. A sensor point s lies at
R(theta) s + (x, y). Thesis 6.2.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.compiled import addresses
from recognizer.touch.options import Effort
from recognizer.touch.symbols.image import (
    Image,
    deep_gain,
    first_gain,
    normalize_image,
    tilted_gain,
)
from recognizer.touch.symbols.kernels import (
    FAR,
    FIRST_NOISE,
    FORM_SD,
    LARGEST_STEP,
    LEAST_NOISE,
    POSE,
    UNKNOWNS,
    kernels,
)
from recognizer.touch.symbols.linearize import LabelsAt, prior_precision
from recognizer.touch.symbols.search import Bank, LatticeScores, score_lattices
from recognizer.touch.symbols.template import PSI, psi

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_REST = 0.1  #: of a tactel's force that is left over the bare face's, in the coarse search
SAME_SHIFT = 0.08  #: pitches by which two lattices that are one may differ
SAME_TURN = 0.02  #: and half turns

# By how much the fit's own covariance is too small. Measured against simulated touches of all
# contact levels: on faces 95-97 % of the errors lie within the 95 % ellipse (`docs/recognizer.md`,
# "How sure it is").
PAD_SIZE = 1.18  #: times the variance under a pad, neighbours that err alike counted
TAB_SIZE = 0.6  #: times the variance under tabs ...
STRANGE_SIZE = 0.025  #: ... and with the fourth power of the form's distance from `FORM_SD`
UNSEEN = 1e-8  #: least eigenvalue of a normal matrix of unit diagonal


@dataclass(frozen=True, slots=True)
class Lattices:
    """Candidates: sensor point s lies at R(theta) s + (x, y) in the lattice frame."""

    #: (b, 7) x, y (mm), theta (rad); stroke excess, cross-talk, exponent - 1, scale - 1
    pose: Array
    gain: Array  #: (b, 4) logarithm of the scale; depth at the centre, slopes per half width
    value: Array  #: (b,) log-likelihood of the image, nats, up to a constant of the image
    normal: Array  #: (b, 11, 11) inverse covariance of pose and gain under `FIRST_NOISE`
    right: Array  #: (b, 11) slope of the log-likelihood by them


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """One way to see symbols in an image."""

    x_mm: float
    y_mm: float
    theta_rad: float
    nuisance: Array  #: (4,) stroke excess, cross-talk, exponent - 1, scale - 1
    gain: Array  #: (4,) logarithm of the scale, depth, and its slopes, of `image`
    cells: NDArray[np.int64]  #: (m, 2) column and upward row of the cells in view
    scores: Array  #: (m, q + 1) log-likelihoods, nats, 0 for the best; the last one: no symbol
    seen: Array  #: (m,) tactels on the cell, by how hard they press
    noise: float  #: standard deviation of psi with which the scores were made
    value: float  #: log-likelihood of the image with every cell at its best, nats
    covariance: Array  #: (3, 3) of x, y (mm) and theta (rad); NaN if not computed
    with_scale: Array | None = None  #: (4,) covariance of scale - 1 with these, and its variance

    @property
    def pose(self) -> Array:
        """Return (7,) of `Lattices`."""
        return np.array([self.x_mm, self.y_mm, self.theta_rad, *self.nuisance])

    @property
    def scale(self) -> float:
        """Return the size of the print, 1 as designed."""
        return 1.0 / (1.0 + float(self.nuisance[3]))

    @property
    def stroke_excess(self) -> float:
        """Return by how much strokes seem wider than designed, tenths of a mm."""
        return float(self.nuisance[0])


@dataclass(frozen=True, slots=True, eq=False)
class CoarseSearch:
    """The coarse search of an image under one gain; serves searches of any effort."""

    gain: Array  #: (4,)
    scores: LatticeScores


def search_image(
    image: Image, bank: Bank, gains: Sequence[Array] | None = None
) -> tuple[CoarseSearch, ...]:
    """Return the coarse searches of an image; none if nothing is pressed.

    Start gains, (4,) each, are guessed from the image if they are not given.
    """
    if gains is None:
        deep = deep_gain(image)
        guessed = (first_gain(image), tilted_gain(image) if deep is None else deep)
        gains = [gain for gain in guessed if gain is not None]
    return tuple(CoarseSearch(gain, _search_under(image, bank, gain)) for gain in gains)


def fit_lattices(
    image: Image,
    bank: Bank,
    effort: Effort,
    searches: Sequence[CoarseSearch] | None = None,
    *,
    with_covariance: bool = True,
) -> tuple[Fit, ...]:
    """Return the likeliest lattices of an image, best first; none if nothing is pressed.

    `searches` are the image's, where they are known.
    """
    if searches is None:
        searches = search_image(image, bank)
    lattices = _refine_candidates(image, bank, effort, searches)
    if not len(lattices.pose):
        return ()
    if effort.again:
        best = _distinct_lattices(image, lattices)[: effort.again]
        gains = [lattices.gain[b] for b in best]
        more = _refine_candidates(image, bank, effort, search_image(image, bank, gains))
        lattices = _joined(lattices, more)
    best = _distinct_lattices(image, lattices)[: effort.finalists]
    lattices = refine_lattices(
        image, lattices.pose[best], lattices.gain[best],
        steps=effort.final_steps, with_normal=with_covariance,
    )  # fmt: skip
    found = score_cells(image, lattices, with_covariance=with_covariance)
    return tuple(found[b] for b in _distinct_lattices(image, lattices))


def _refine_candidates(
    image: Image, bank: Bank, effort: Effort, searches: Sequence[CoarseSearch]
) -> Lattices:
    """Return the best lattices of coarse searches, each refined from its own gain."""
    starts = [one.scores.best(bank, effort.candidates) for one in searches]
    pose = np.concatenate([np.empty((0, 3)), *starts])
    gain = np.repeat([one.gain for one in searches], [len(start) for start in starts], axis=0)
    return refine_lattices(image, pose, gain, steps=effort.steps, with_normal=False)


def _joined(*found: Lattices) -> Lattices:
    return Lattices(
        *(np.concatenate([getattr(one, item.name) for one in found]) for item in fields(Lattices))
    )


def _distinct_lattices(image: Image, found: Lattices) -> list[int]:
    """Return the numbers of lattices, best first, each once."""
    pitch = image.template.pitch_mm
    kept: list[int] = []
    for b in np.argsort(-found.value, kind="stable").tolist():
        away = found.pose[kept, :3] - found.pose[b, :3]
        shift = np.abs((away[:, :2] / pitch + 0.5) % 1.0 - 0.5).max(axis=1)
        turn = np.abs((away[:, 2] / math.pi + 1.0) % 2.0 - 1.0)
        if not ((shift < SAME_SHIFT) & (turn < SAME_TURN)).any():
            kept.append(b)
    return kept


def _search_under(image: Image, bank: Bank, gain: Array) -> LatticeScores:
    measured = normalize_image(image, gain[None])
    response, bare = np.expm1(measured.psi[0] * math.log(1 + PSI)) / PSI, measured.bare[0]
    rest = np.maximum(1.0 - bare, LEAST_REST)
    seen = psi(np.maximum(response - bare, 0.0) / rest)
    weights = (measured.press[0] * rest) ** 2 * measured.trust
    return score_lattices(
        bank,
        seen.reshape(bank.shape).astype(np.float32),
        weights.reshape(bank.shape).astype(np.float32),
        image.template.order,
    )


def refine_lattices(
    image: Image,
    pose: Array,
    gain: Array,
    *,
    steps: int,
    labels_at: LabelsAt | None = None,
    with_normal: bool = True,
) -> Lattices:
    """Return candidates after at most `steps` damped steps, with their log-likelihoods.

    `pose` is (b, 7), or (b, 3) where nothing is known of the rest, `gain` (b, 4). Without
    `labels_at` each cell shows what fits best; without `with_normal`, `normal` and `right` are
    those of some step.
    """
    count = len(pose)
    whole = np.zeros((count, POSE))
    whole[:, : pose.shape[1]] = pose
    gain = np.array(gain, np.float64, order="C")
    labels = corner = None
    if labels_at is not None:
        labels, corner = label_tables(image, whole, steps, labels_at)
    data = image.data.of_lattices(count, labels, prior_precision(image))
    value, right = np.empty(count), np.zeros((count, UNKNOWNS))
    normal = np.zeros((count, UNKNOWNS, UNKNOWNS))
    kernels().refine(
        ctypes.addressof(data), steps, int(with_normal),
        *addresses(labels, corner, whole, gain, value, normal, right),
    )  # fmt: skip
    return Lattices(whole, gain, value, normal, right)


def label_tables(
    image: Image, pose: Array, steps: int, labels_at: LabelsAt
) -> tuple[NDArray[np.int8], Ints]:
    """Return labels (b, high, wide) of all cells that steps can reach, and the first (b, 2)."""
    pitch = image.template.pitch_mm
    scale = 1 + max(image.options.scale_most, float(np.abs(pose[:, 6]).max()))
    reach = scale * image.reach_mm + steps * max(LARGEST_STEP[:2])
    corner = np.floor((pose[:, :2] - reach) / pitch).astype(np.int64)
    side = math.ceil(2 * reach / pitch) + 2
    labels = labels_at(corner[:, None] + _square_of_cells(side))
    return labels.astype(np.int8).reshape(len(pose), side, side), corner


@lru_cache(maxsize=16)
def _square_of_cells(side: int) -> Ints:
    """Return the cells (side^2, 2) of a square, its first one (0, 0)."""
    down, along = np.divmod(np.arange(side * side), side)
    return np.stack([along, down], axis=-1)


def score_cells(
    image: Image, lattices: Lattices, *, with_covariance: bool = True
) -> tuple[Fit, ...]:
    """Return the fits of lattices with the scores of all their cells, in their order.

    The likeliest lattice's residuals give the noise of the scores.
    """
    count, tactels, order = len(lattices.pose), len(image.forces), image.template.order
    data = image.data.of_lattices(count)
    pose, gain = np.ascontiguousarray(lattices.pose), np.ascontiguousarray(lattices.gain)
    numbers, cells = np.empty(count, np.int64), np.empty((count, tactels, 2), np.int64)
    sums, seen = np.empty((count, tactels, order + 1)), np.empty((count, tactels))
    level, left = np.empty(count), np.empty((count, tactels))
    noise: float = kernels().score_cells(
        ctypes.addressof(data), int(np.argmax(lattices.value)), LEAST_NOISE,
        *addresses(pose, gain, numbers, cells, sums, seen, level, left),
    )  # fmt: skip
    covariance = np.full((count, 3, 3), math.nan)
    if with_covariance:
        covariance = covariances(image, lattices, left * image.trust, noise)
    unit = float(image.trust.sum()) * math.log(noise)
    found = []
    for b, m in enumerate(numbers.tolist()):
        scores = sums[b, :m]
        most = scores.max(axis=1)
        found.append(
            Fit(
                x_mm=float(pose[b, 0]),
                y_mm=float(pose[b, 1]),
                theta_rad=math.remainder(float(pose[b, 2]), 2 * math.pi),
                nuisance=pose[b, 3:],
                gain=gain[b],
                cells=cells[b, :m],
                scores=scores - most[:, None],
                seen=seen[b, :m] / image.cell_share,
                noise=noise,
                value=float(most.sum() + level[b] - unit),
                covariance=covariance[b],
            )
        )
    return tuple(found)


def covariances(image: Image, lattices: Lattices, away: Array, noise: float) -> Array:
    """Return the covariances (b, 3, 3) of x, y (mm) and theta (rad) of lattices.

    The normal matrix of the last step gives the shape. Its size is the noise of the fit, and what
    that noise does not show: tactels of a pad err with their neighbours, and under tabs a touch
    whose form lies far from the prior (`FORM_SD`) has more of the template wrong than the fitted
    part of it. `away` (b, n) are the residuals under the likeliest labels, on a covered tactel's
    scale; `noise` is the deviation of psi with which the lattices are scored.
    """
    if image.pressing.hardens:
        prior = np.array([*FORM_SD, image.options.scale_sd])
        strange = ((lattices.pose[:, 3:POSE] / prior) ** 2).sum(axis=1)
        size = TAB_SIZE + STRANGE_SIZE * strange**2
    else:
        size = PAD_SIZE * _neighbours_alike(away, image.shape, FAR * FIRST_NOISE)
    shapes = invert_normal(lattices.normal)[:, :3, :3]
    return np.asarray((noise / FIRST_NOISE) ** 2 * size[:, None, None] * shapes)


def invert_normal(normal: Array) -> Array:
    """Return the inverses of normal matrices (..., k, k), wide in what the image does not show."""
    diagonal = np.diagonal(normal, axis1=-2, axis2=-1)
    unit = 1.0 / np.sqrt(np.maximum(diagonal, 1e-12))
    units = unit[..., :, None] * unit[..., None, :]
    sizes, axes = np.linalg.eigh(normal * units)
    shown = axes / np.maximum(sizes, UNSEEN)[..., None, :]
    return np.asarray(shown @ axes.swapaxes(-2, -1) * units)


def _neighbours_alike(away: Array, shape: tuple[int, int], most: float) -> Array:
    """Return by how much (b,) neighbours that err alike widen a covariance, 1 or more.

    The sum of the autocorrelation of residuals over the eight neighbours.
    """
    left = np.clip(away, -most, most).reshape(-1, *shape)
    left = left - left.mean(axis=(1, 2), keepdims=True)
    own = np.maximum((left * left).sum(axis=(1, 2)), 1e-12)
    side = (left[:, 1:] * left[:, :-1]).sum(axis=(1, 2))
    side += (left[:, :, 1:] * left[:, :, :-1]).sum(axis=(1, 2))
    across = (left[:, 1:, 1:] * left[:, :-1, :-1]).sum(axis=(1, 2))
    across += (left[:, 1:, :-1] * left[:, :-1, 1:]).sum(axis=(1, 2))
    return np.asarray(np.maximum(1.0, 1.0 + 2.0 * (side + across) / own))
