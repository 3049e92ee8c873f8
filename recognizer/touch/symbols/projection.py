"""What lies under the tactels: cells of lattices, templates at their offsets, and chosen labels.

Poses (b, 7) and gains (b, 4) of b lattices + image (n tactels) -> cell and template under each
tactel; labels -> psi and its slopes. A sensor point s lies at R(theta) s + (x, y) in the lattice
frame. Lattice and sensor frame in mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.gain import Image, normalize_image
from recognizer.touch.symbols.noise import NormalizedImage
from recognizer.touch.symbols.template import PSI, Floats, ResponseTemplate, psi

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Which symbols cells show: (b, n, 2) cells of b lattices -> (b, n) labels, -1 for none.
Shown = Callable[[Ints], Ints]


@dataclass(frozen=True, slots=True)
class Projection:
    """Templates where lattices put them."""

    felt: NormalizedImage
    cells: Ints  #: (b, n, 2) column and upward row of the cell under each tactel
    tables: Floats  #: (b, n, q, 6) templates there, for what is fitted of form and gain


def project_template(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array
) -> Projection:
    """Return what lies under the tactels for poses (b, 7) and gains (b, 4)."""
    felt = normalize_image(image, gain)
    cells, offsets = _cells_under(image, template, pose)
    return Projection(felt, cells, _fit_form(template.at(offsets), pose, felt))


def project_symbols(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, shown: Shown
) -> tuple[NormalizedImage, Ints, Array]:
    """Return an image under gains, labels (b, n) of what is shown, and `values_of` these."""
    felt = normalize_image(image, gain)
    cells, offsets = _cells_under(image, template, pose)
    labels = shown(cells)
    tables = _fit_form(template.of(offsets, labels.clip(min=0)), pose, felt)
    return felt, labels, _with_bare_face(felt, labels, tables[:, :, 0].astype(np.float64))


def likeliest_labels(cells: Ints, scores: Array, tie: float) -> Ints:
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


def values_of(under: Projection, labels: Ints) -> Array:
    """Return psi and slopes (b, n, 6) of given symbols, and of the bare face where there is none.

    Beyond the edge of a face nothing is felt: a tactel without a symbol shows what is nearer.
    """
    tables = under.tables
    every = np.arange(labels.size) * tables.shape[2] + labels.clip(min=0).ravel()
    found = tables.reshape(-1, tables.shape[3]).take(every, axis=0).astype(np.float64)
    return _with_bare_face(under.felt, labels, found.reshape(*labels.shape, -1))


def _with_bare_face(felt: NormalizedImage, labels: Ints, found: Array) -> Array:
    found[labels < 0] = 0.0
    floor = psi(felt.bare)
    bare = (labels < 0) & (felt.psi > floor / 2)
    found[bare, 0] = floor[bare]
    return np.asarray(found)


def response_of(value: Array | Floats) -> Array:
    """Return y of psi(y)."""
    return np.asarray(np.expm1(value * np.float32(math.log(1 + PSI))) / np.float32(PSI))


def response_by_psi(response: Array) -> Array:
    """Return dy/dpsi."""
    return (1 + PSI * response) * math.log(1 + PSI) / PSI


def _cells_under(image: Image, template: ResponseTemplate, pose: Array) -> tuple[Ints, Array]:
    """Return the cell (b, n, 2) under each tactel, and where in it that lies, mm."""
    c, s = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = image.points_mm.T
    c, s = c * (1 + pose[:, 6, None]), s * (1 + pose[:, 6, None])
    u = np.stack([pose[:, 0, None] + c * x - s * y, pose[:, 1, None] + s * x + c * y], axis=-1)
    cells = np.floor(u / template.pitch_mm)
    return cells.astype(np.int64), u - (cells + 0.5) * template.pitch_mm


def _fit_form(tables: Floats, pose: Array, felt: NormalizedImage) -> Floats:
    """Return templates (b, n, q, 6), their own to be changed, as form and gain are fitted."""
    for slope, by in enumerate(pose[:, 3:6, None, None].astype(np.float32).swapaxes(0, 1), 3):
        tables[..., 0] += tables[..., slope] * by
    if (felt.contact < 1).any():
        tables *= felt.contact[..., None, None].astype(np.float32)
    if felt.bare.any():
        bare = felt.bare[..., None].astype(np.float32)
        response = response_of(tables[..., 0]).astype(np.float32)
        total = response + (1 - response) * bare
        by = (1 - bare) * (1 + 3 * response) / (1 + 3 * total)
        tables = (tables * by[..., None]).astype(np.float32)
        tables[..., 0] = psi(total)
    return tables
