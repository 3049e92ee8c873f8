"""A place of the database at which the lattice of a fit may lie, and what the cells say of it.

A `Fit` names cells (i, j) of a lattice; a place says which array cell (row, column) the cell
(0, 0) is, and which face holds the symbols: cell (i, j) is then (row - j, column + i) where
that face holds it, and shows no symbol where it does not. Its score is the sum of the
cells' log-likelihoods, none of them lower than a limit, so that a worn or wrong symbol costs
what it should and no more. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.lab import EmbossedArray
from recognizer.touch.place_scores import add_scores
from recognizer.touch.settings import HypothesisSettings
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.projection import Shown

Ints = NDArray[np.int64]
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A registered place at which the lattice of a fit may lie."""

    fit: int  #: which of the fits
    row: int  #: array row of lattice cell (0, 0), on the torus
    column: int
    face: int  #: number in `EmbossedArray.faces`
    score: float  #: log-likelihood of the image, nats


def log_likelihood(
    embossed: EmbossedArray, fit: Fit, hypothesis: Hypothesis, settings: HypothesisSettings
) -> float:
    """Return the log-likelihood of the image if the fit lies at this place, nats."""
    return float(log_likelihoods_at(embossed, fit, [hypothesis], settings)[0])


def log_likelihoods_at(
    embossed: EmbossedArray,
    fit: Fit,
    hypotheses: Sequence[Hypothesis],
    settings: HypothesisSettings,
) -> Array:
    """Return the log-likelihoods (n,) of the image if the fit lies at each of n places, nats."""
    places = (
        np.array([one.row for one in hypotheses], np.int64),
        np.array([one.column for one in hypotheses], np.int64),
        np.array([one.face for one in hypotheses], np.int32),
    )
    scores, none = bounded_scores(fit, settings), np.zeros(len(hypotheses))
    return add_scores(embossed, places, fit.cells, scores, none) + fit.value


@lru_cache(maxsize=16)
def bounded_scores(fit: Fit, settings: HypothesisSettings) -> Array:
    """Return scores (m, q + 1) in which a registered symbol may be worn away, or read wrong.

    Of a cell of which the sensor sees only a corner, less is believed.
    """
    least = settings.cap * np.minimum(1.0, fit.seen / settings.corner)[:, None]
    bounded = np.array(fit.scores)
    np.maximum(bounded[:, :-1], fit.scores[:, -1:] - settings.worn, out=bounded[:, :-1])
    np.maximum(bounded, -least, out=bounded)
    bounded.setflags(write=False)
    return bounded


def labels_at(embossed: EmbossedArray, hypothesis: Hypothesis, cells: Ints) -> Ints:
    """Return the labels (m,) that cells (m, 2) of a lattice show at a place; `order` for none."""
    array = embossed.array
    held_by, label = embossed.at(
        (hypothesis.row - cells[:, 1]) % array.rows,
        (hypothesis.column + cells[:, 0]) % array.columns,
    )
    return np.where(held_by == hypothesis.face, label, array.order).astype(np.int64)


def shown_at(embossed: EmbossedArray, hypotheses: Sequence[Hypothesis]) -> Shown:
    """Return what the cells of lattices show if each lies at its place."""
    array = embossed.array
    rows, columns, faces = (
        np.array([[getattr(one, name)] for one in hypotheses]) for name in ("row", "column", "face")
    )

    def shown(cells: Ints) -> Ints:
        held_by, label = embossed.at(
            (rows - cells[..., 1]) % array.rows, (columns + cells[..., 0]) % array.columns
        )
        return np.where(held_by == faces, label, -1).astype(np.int64)

    return shown


def under_centre(embossed: EmbossedArray, fit: Fit, hypothesis: Hypothesis) -> tuple[int, int]:
    """Return row and column of the array's cell under the sensor's centre."""
    pitch, array = embossed.style.pitch_mm, embossed.array
    i, j = math.floor(fit.x_mm / pitch), math.floor(fit.y_mm / pitch)
    return (hypothesis.row - j) % array.rows, (hypothesis.column + i) % array.columns


def neighbours(embossed: EmbossedArray, a: tuple[int, int], b: tuple[int, int]) -> bool:
    """Whether two cells are one, up to a cell's rounding."""
    array = embossed.array
    return (a[0] - b[0] + 1) % array.rows <= 2 and (a[1] - b[1] + 1) % array.columns <= 2


def coincide(
    embossed: EmbossedArray, fit: Fit, a: Hypothesis, other_fit: Fit, b: Hypothesis
) -> bool:
    """Whether two hypotheses put the sensor's centre in one place: half a pitch, an eighth turn.

    The cells under the centre do not tell: between two cells they differ by one where fits
    differ by nothing, as they do of two places that lie one pitch apart.
    """
    array, pitch = embossed.array, embossed.style.pitch_mm
    down = a.row - b.row - (fit.y_mm - other_fit.y_mm) / pitch
    along = a.column - b.column + (fit.x_mm - other_fit.x_mm) / pitch
    turn = math.remainder(fit.theta_rad - other_fit.theta_rad, math.tau)
    return (
        a.face == b.face
        and abs(math.remainder(down, array.rows)) < 0.5
        and abs(math.remainder(along, array.columns)) < 0.5
        and abs(turn) < math.pi / 4
    )
