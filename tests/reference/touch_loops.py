"""The compiled loops of `recognizer.touch` in numpy: what each of them computes, to be compared.

Names and arguments are those of the module that calls the loop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from recognizer.touch.hypothesis import place_keys
from recognizer.touch.options import TIE_NATS
from recognizer.touch.symbols.fit import Fit, Lattices, covariances
from recognizer.touch.symbols.image import NormalizedImage, bounded_gain, normalize_image
from recognizer.touch.symbols.kernels import (
    ABOVE,
    DAMPING,
    DEEPEST_GAIN,
    EASIER,
    FAR,
    FIRST_NOISE,
    GRAZED,
    HARDER,
    HIDDEN,
    LARGEST_STEP,
    LEAST_DIAGONAL,
    LEAST_NOISE,
    POSE,
    QUIET,
    SETTLED,
    SHALLOWER,
    UNKNOWNS,
)
from recognizer.touch.symbols.linearize import (
    _cells_under,
    _fit_form,
    _width,
    _with_bare_face,
    force_jacobian,
    log_densities,
    log_densities_of_none,
    prior_departure,
    prior_precision,
    project_symbols,
    psi_deviation,
    reading_deviation,
)


@dataclass(frozen=True)
class Projection:
    """Templates where lattices put them."""

    felt: NormalizedImage
    cells: np.ndarray  #: (b, n, 2) column and upward row of the cell under each tactel
    tables: np.ndarray  #: (b, n, q, 6) templates there


def project_template(image, pose, gain):
    """Return what lies under the tactels for poses (b, 7) and gains (b, 4)."""
    felt = normalize_image(image, gain)
    cells, offsets = _cells_under(image, pose)
    return Projection(felt, cells, _fit_form(image.template.at(offsets), pose, felt))


def log_likelihoods(felt, tables, noise):
    """Return log-likelihoods (b, n, q + 1) of each symbol at each tactel; the last is no symbol."""
    unit = noise[:, None] / np.maximum(felt.press, 1e-3)
    symbols = log_densities(felt, tables[..., 0], psi_deviation(felt, tables, unit), unit)
    return np.concatenate([symbols, log_densities_of_none(felt, unit)[..., None]], axis=-1)


def likeliest_labels(cells, scores, tie=TIE_NATS):
    """Return the label (b, n) of what fits best in the cell under each tactel; -1: no symbol.

    A cell that is seen by its rim alone shows a symbol as well as none but for rounding: none.

    Parameters
    ----------
    scores
        (b, n, q + 1) log-likelihoods at each tactel; the last is no symbol.
    tie
        Nats by which a symbol fits better at least.
    """
    local = cells - cells.min(axis=1, keepdims=True)
    width = int(local.max()) + 1
    count = width * width
    dense = local[..., 1] * width + local[..., 0] + np.arange(len(cells))[:, None] * count
    flat = dense.ravel()
    sums = np.stack(
        [
            np.bincount(flat, column, count * len(cells))
            for column in scores.reshape(flat.size, -1).T
        ],
        axis=1,
    )
    symbols, none = sums[:, :-1], sums[:, -1]
    best = symbols.argmax(axis=1)
    best[none + tie > symbols.max(axis=1)] = -1
    return np.asarray(best[dense])


def values_of(under, labels):
    """Return psi and slopes (b, n, 6) of given symbols, or of the bare face."""
    tables = under.tables
    every = np.arange(labels.size) * tables.shape[2] + labels.clip(min=0).ravel()
    found = tables.reshape(-1, tables.shape[3]).take(every, axis=0).astype(np.float64)
    return _with_bare_face(under.felt, labels, found.reshape(*labels.shape, -1))


def refine_lattices(image, pose, gain, *, steps, labels_at=None):
    """Return candidates after damped steps, with their log-likelihoods."""
    whole = np.zeros((len(pose), POSE))
    whole[:, : pose.shape[1]] = pose
    least, most, limits = (np.array(one) for one in (LEAST_DIAGONAL, LARGEST_STEP, image.limits))

    best, damping = _evaluate(image, whole, gain, labels_at), np.full(len(pose), DAMPING)
    for _ in range(steps):
        diagonal = np.einsum("bii->bi", best.normal) * damping[:, None] + least
        system = best.normal + diagonal[:, :, None] * np.eye(UNKNOWNS)
        step = np.clip(np.linalg.solve(system, best.right[..., None])[..., 0], -most, most)
        pose, gain = best.pose + step[:, :POSE], best.gain + step[:, POSE:]
        pose[:, 3:] = np.clip(pose[:, 3:], -limits, limits)
        gain[:, 1] = np.clip(gain[:, 1], SHALLOWER * best.gain[:, 1], DEEPEST_GAIN)
        tried = _evaluate(image, pose, bounded_gain(gain), labels_at)
        better = tried.value > best.value
        done = (np.abs(tried.value - best.value) < SETTLED).all()
        picked = {}
        for item in fields(Lattices):
            new, old = getattr(tried, item.name), getattr(best, item.name)
            picked[item.name] = np.where(better.reshape(-1, *[1] * (new.ndim - 1)), new, old)
        best = Lattices(**picked)
        damping = np.where(better, damping / EASIER, np.minimum(damping * HARDER, 1e6))
        if done:
            break
    return best


def _evaluate(image, pose, gain, labels_at):
    under = project_template(image, pose, gain)
    felt, cells = under.felt, under.cells
    scores = log_likelihoods(felt, under.tables, np.full(len(pose), FIRST_NOISE))
    labels = likeliest_labels(cells, scores) if labels_at is None else labels_at(cells)
    known, precision = prior_departure(image, pose, gain), prior_precision(image)
    value = np.take_along_axis(scores, labels[..., None], axis=2)[..., 0].sum(axis=1)
    value += felt.measure + (felt.trust * np.log(felt.press)).sum(axis=1)
    value -= 0.5 * (known**2 * precision).sum(axis=1)
    values = values_of(under, labels)
    jacobian, force = force_jacobian(image, pose, gain, values, felt)
    width = _width(values, felt)
    left = image.forces - force
    sure = np.where(np.abs(left / width) < FAR, felt.trust, 0.0) / width**2
    weighted = (jacobian * sure[..., None]).swapaxes(1, 2)
    normal = weighted @ jacobian + np.diag(precision)
    right = (weighted @ left[..., None])[..., 0] - known * precision
    return Lattices(pose, gain, value, normal, right)


def score_cells(image, lattices):
    """Return the fits of lattices with the scores of all their cells, in their order."""
    best = int(np.argmax(lattices.value))
    under = project_template(image, lattices.pose, lattices.gain)
    felt, cells = under.felt, under.cells
    away = _residuals(under)
    bounded = np.minimum(np.abs(away[best]), FAR * FIRST_NOISE)
    left = math.sqrt(float((felt.trust * bounded**2).sum() / felt.trust.sum()))
    noise = max(LEAST_NOISE, left)
    each = log_likelihoods(felt, under.tables, np.full(len(cells), noise))
    level = felt.measure + (felt.trust * np.log(felt.press)).sum(axis=1)
    covariance = covariances(image, lattices, away * image.trust, noise)
    unit = float(image.trust.sum()) * math.log(noise)
    found = []
    for b, (pose, gain) in enumerate(zip(lattices.pose, lattices.gain, strict=True)):
        known, dense = np.unique(cells[b], axis=0, return_inverse=True)
        dense = dense.reshape(-1)
        scores = np.stack([np.bincount(dense, one, len(known)) for one in each[b].T], axis=1)
        most = scores.max(axis=1)
        found.append(
            Fit(
                *pose[:2].tolist(), math.remainder(float(pose[2]), math.tau), pose[3:], gain,
                cells=known, scores=scores - most[:, None],
                seen=np.bincount(dense, felt.press[b] * felt.trust, len(known)),
                noise=noise, value=float(most.sum() + level[b] - unit), covariance=covariance[b],
            )
        )  # fmt: skip
    return tuple(found)


def _residuals(under):
    """Return how far (b, n) readings lie from the likeliest labels, on a covered tactel's scale."""
    felt, cells = under.felt, under.cells
    scores = log_likelihoods(felt, under.tables, np.full(len(cells), FIRST_NOISE))
    values = values_of(under, likeliest_labels(cells, scores))
    unit = FIRST_NOISE / felt.press
    deviation = psi_deviation(felt, values[:, :, None], unit)[..., 0]
    return (felt.psi - values[..., 0]) * felt.press / deviation


def explained_share(image, pose, gain, labels_at):
    """Return the share of the variance of psi that given symbols explain where they stand."""
    felt, labels, shows = project_symbols(image, pose[None], gain[None], labels_at)
    values, seen = shows[0, :, 0], felt.psi[0]
    trust = image.trust * (labels[0] >= 0)
    if image.falls is not None:  # where the face has fallen away there is nothing to explain
        trust = trust * felt.contact[0]
    noise = reading_deviation(felt, values[None, :, None])[0, :, 0]
    trust = trust / (1.0 + (noise / (QUIET * FIRST_NOISE)) ** 2)
    mean = (trust * seen).sum() / max(trust.sum(), 1e-12)
    whole = float((trust * (seen - mean) ** 2).sum())
    left = float((trust * (seen - values) ** 2).sum())
    above = np.where(values > GRAZED, 1.0, ABOVE)
    noise_alone = min(float((trust * above * noise**2).sum()), HIDDEN * whole, left)
    return 1.0 - (left - noise_alone) / max(whole - noise_alone, 1e-12)


def add_scores(embossed, places, cells, scores, before):
    """Return sums (n,) of the scores of cells at each place."""
    rows, columns, owners = places
    array, total = embossed.array, before.copy()
    for (i, j), each in zip(cells.tolist(), scores, strict=True):
        held_by, label = embossed.at((rows - j) % array.rows, (columns + i) % array.columns)
        total += each[np.where(held_by == owners, label, array.order)]
    return total


def name_places(embossed, at, cells):
    """Return key of the place times (faces + 1), and its face, as one number (n,) for each."""
    keys = place_keys(embossed, at, cells).astype(np.int64)
    return keys * (len(embossed.faces) + 1) + embossed.owners[at]


def count_places(embossed, cells, prices, slack):
    """Return how many registered cells can be the one that cells are counted from."""
    array, keys, owners = embossed.array, embossed.keys, embossed.owners[:-1]
    row, column = (part.astype(np.int64) for part in np.divmod(keys, np.uint64(array.columns)))
    left = np.full(len(keys), slack)
    for (i, j), price in zip(cells.tolist(), prices.tolist(), strict=True):
        held_by, _ = embossed.at((row - j) % array.rows, (column + i) % array.columns)
        left = left - price * (held_by == owners)
        kept = left >= 0
        row, column, owners, left = row[kept], column[kept], owners[kept], left[kept]
    return len(row)
