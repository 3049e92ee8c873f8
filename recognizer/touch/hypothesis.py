"""Places of the database at which the lattice of a fit may lie. Thesis 6.3.

A `Fit` names cells (i, j) of a lattice; a hypothesis says which array cell (row, column) the cell
(0, 0) is, and which face holds the symbols: cell (i, j) is then (row - j, column + i) where that
face holds it, and bare elsewhere. Its score is the sum of the cells' log-likelihoods, each bounded
below, so that a worn or wrong symbol costs a limited amount. Places come from the surest windows of
cells, by the array's own code; where no window is whole, from cells that any registered cell may
be. All are scored, and the likeliest kept. Sums over many places are compiled (`places.c`).
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.compiled import addresses
from recognizer.touch.lab import EmbossedArray, EncodedFace, cell_keys
from recognizer.touch.options import TIE_NATS
from recognizer.touch.recognition import RunnerUp
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.kernels import kernels
from recognizer.touch.symbols.linearize import LabelsAt

Ints = NDArray[np.int64]
Array = NDArray[np.float64]

Places = tuple[Ints, Ints, NDArray[np.int32]]  #: rows and columns (n,) of (0, 0), and faces

KEPT = 8  #: places of a fit, at most
NEAR = 14.0 - TIE_NATS  #: nats below the best within which places are verified
CAP = 8.0  #: nats that one cell can cost at most
CORNER = 8.0  #: tactels on a cell below which it can cost less than that
WORN = 4.0  #: nats of a symbol that is registered but not felt at all
ANCHORS = 3  #: cells tried as the one surely registered, where no window is whole
ANCHORS_OF_RIVALS = 2  #: where the best place is known
WINDOWS = 4  #: whole windows that are looked up, the surest ones
SURE = 6.0  #: nats by which each of their cells shows its symbol, not any other
MANY = 1024  #: candidates, from which on those count that two windows agree on
LARGE_LAB = 1 << 18  #: registered cells, from which on a whole window must be seen
FIRST_CELLS = 6  #: cells after which only ...
FOLLOWED = 512  #: ... so many candidates go on (`tests/bench/recognizer_scale.py`)
HEAVY = 12.0  #: tactels from which a cell counts whole in the order of the cells


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A registered place at which the lattice of a fit may lie."""

    fit: int  #: which of the fits
    row: int  #: array row of lattice cell (0, 0), on the torus
    column: int
    face: int  #: number in `EmbossedArray.faces`
    score: float  #: log-likelihood of the image, nats


@dataclass(frozen=True, eq=False)
class PlaceHypothesis:
    """A registered place of a touch, or of a scan, and the fit that lies there."""

    embossed: EmbossedArray
    hypothesis: Hypothesis
    fit: Fit
    score: float  #: log-likelihood of all images, nats

    @property
    def face(self) -> EncodedFace:
        """The face that holds the place."""
        return self.embossed.face(self.hypothesis.face)

    @property
    def index(self) -> tuple[int, int]:
        """Row and column of the array's cell under the sensor's centre."""
        return under_centre(self.embossed, self.fit, self.hypothesis)

    @property
    def runner_up(self) -> RunnerUp:
        """The place as the runner-up of an answer."""
        return RunnerUp(self.face.object, self.face.face, self.index)

    def coincides(self, other: PlaceHypothesis) -> bool:
        """Whether both are one place, and neither one a pitch off it."""
        return self.embossed is other.embossed and coincide(
            self.embossed, self.fit, self.hypothesis, other.fit, other.hypothesis
        )


def find_hypotheses(
    embossed: EmbossedArray, fits: tuple[Fit, ...], kept: int = KEPT
) -> list[Hypothesis]:
    """Return the likeliest places over all fits, best first, at most `kept` of each fit."""
    found: list[Hypothesis] = []
    for number, fit in enumerate(fits):
        scores = bounded_scores(fit)
        places = _window_candidates(embossed, fit)
        if places is None:
            symbol = scores[:, :-1].max(axis=1) - scores[:, -1]  # a symbol rather than none
            places = _anchor_candidates(embossed, fit, scores, symbol, ANCHORS)
        found += _rank_candidates(embossed, fit, number, scores, places, kept)
    return sorted(found, key=lambda hypothesis: -hypothesis.score)


def find_rivals(
    embossed: EmbossedArray, fit: Fit, best: Hypothesis, number: int, kept: int = KEPT
) -> list[Hypothesis]:
    """Return the likeliest other places of the whole database under a fit, best first.

    `find_hypotheses` looks where a few windows point to; a place that differs from the best one in
    a cell of such a window is found here, under scores that the best place has made sharp. `number`
    is that of the fit that the places get.
    """
    scores = bounded_scores(fit)
    held = labels_of(embossed, best, fit.cells)
    sure = np.where(held < embossed.array.order, scores.max(axis=1) - scores[:, -1], 0.0)
    found = _anchor_candidates(embossed, fit, scores, sure, ANCHORS_OF_RIVALS)
    return [
        other
        for other in _rank_candidates(embossed, fit, number, scores, found, kept + 1)
        if (other.row, other.column, other.face) != (best.row, best.column, best.face)
    ]


def _rank_candidates(
    embossed: EmbossedArray, fit: Fit, number: int, scores: Array, found: Places, kept: int
) -> list[Hypothesis]:
    rows, columns, owners = found
    if len(rows) == 0:
        return []
    followed, values = _log_likelihoods(embossed, fit, scores, found)
    best = np.argsort(-values, kind="stable")[:kept]
    return [
        Hypothesis(number, int(rows[k]), int(columns[k]), int(owners[k]), value + fit.value)
        for k, value in zip(followed[best].tolist(), values[best].tolist(), strict=True)
    ]


def _window_candidates(embossed: EmbossedArray, fit: Fit) -> Places | None:
    """Return where (0, 0) can lie, by the surest whole windows; None if there is none."""
    order = embossed.array.order
    symbols = np.sort(fit.scores[:, :order], axis=1)
    sure = np.minimum(symbols[:, -1] - symbols[:, -2], symbols[:, -1] - fit.scores[:, order])
    labels = fit.scores[:, :order].argmax(axis=1)
    # on a grid of cells in view, columns and upward rows, none of them sure where none is
    i, j = (fit.cells - fit.cells.min(axis=0)).T
    number = np.full((i.max() + 1, j.max() + 1), -1)
    number[i, j] = np.arange(len(fit.cells))
    whole = np.append(sure, -np.inf)[number]
    seen: list[tuple[float, int, list[int]]] = []
    largest = 0
    for k, index in enumerate(embossed.windows):
        down, right = index.shape
        wide, high = whole.shape[0] - right + 1, whole.shape[1] - down + 1
        if wide < 1 or high < 1 or down * right < largest:
            continue
        corners = [(c, down - 1 - r) for r in range(down) for c in range(right)]
        least = reduce(np.minimum, [whole[x : x + wide, y : y + high] for x, y in corners])
        surest = np.sort(least, axis=None)[-WINDOWS:]  # no others are looked up
        kept = (least > SURE) & (least >= surest[0])
        for left, low in np.argwhere(kept).tolist():
            cells = [int(number[left + x, low + y]) for x, y in corners]
            seen.append((float(least[left, low]), k, cells))
            largest = len(cells)
    seen = [window for window in seen if len(window[2]) == largest]
    if not seen:
        return None
    found: list[NDArray[np.integer[Any]]] = []
    first: list[int] = []
    for _, k, cells in sorted(seen, reverse=True)[:WINDOWS]:
        weakest = min(cells, key=lambda n: float(sure[n]))
        second = int(np.argsort(fit.scores[weakest, :order])[-2])
        for other in (int(labels[weakest]), second):
            code = 0
            for n in cells:
                code = code * order + (other if n == weakest else int(labels[n]))
            found.append(embossed.windows[k].at(code))
            first.append(cells[0])
    return _origins(embossed, fit, found, first)


def _anchor_candidates(
    embossed: EmbossedArray, fit: Fit, scores: Array, symbol: Array, anchors: int
) -> Places:
    """Return where (0, 0) can lie if one of a few cells is a registered one; none in a large lab.

    `symbol` (m,) are nats by which cells hold a symbol; the first `anchors` of them are tried.
    """
    order = embossed.array.order
    small = len(embossed.keys) <= LARGE_LAB
    tried = np.argsort(-symbol, kind="stable")[: anchors if small else 0]
    tried = tried[symbol[tried] > 0]
    likely = scores[tried, :order] > -CAP
    found = [np.flatnonzero(one[embossed.labels[:-1]]) for one in likely]
    return _origins(embossed, fit, found, tried.tolist())


def _origins(
    embossed: EmbossedArray, fit: Fit, found: Sequence[NDArray[np.integer[Any]]], numbers: list[int]
) -> Places:
    """Return where (0, 0) lies, each place once.

    `found` are registered cells, several (n,); `numbers` the fit's cell that each of them may be.
    """
    at = np.concatenate([*found, np.zeros(0, np.int64)])
    cells = np.repeat(fit.cells[numbers], np.array([len(one) for one in found], int), axis=0)
    array, faces = embossed.array, len(embossed.faces) + 1
    if array.rows * array.columns < 2**63 // faces:
        known, names = None, name_places(embossed, at, cells)
    else:
        known, place = np.unique(place_keys(embossed, at, cells), return_inverse=True)
        names = place * faces + embossed.owners[at]
    both, votes = count_names(names)
    if len(both) > MANY and (votes > 1).any():
        both = both[votes > 1]  # several windows say the same
    place, once = np.divmod(both, faces)
    key = place.astype(np.uint64) if known is None else known[place]
    row, column = np.divmod(key, np.uint64(array.columns))
    return row.astype(np.int64), column.astype(np.int64), once.astype(np.int32)


def _log_likelihoods(
    embossed: EmbossedArray, fit: Fit, scores: Array, found: Places
) -> tuple[Ints, Array]:
    """Return numbers (k,) of candidates and their log-likelihoods, 0 with every cell at its best.

    The surest cells come first; of many candidates only the best are followed to the end.
    """
    spread = scores.max(axis=1) - scores.min(axis=1)
    order = np.argsort(-spread * np.minimum(fit.seen, HEAVY), kind="stable")
    first, rest = order[:FIRST_CELLS], order[FIRST_CELLS:]
    total = add_scores(embossed, found, fit.cells[first], scores[first], np.zeros(len(found[0])))
    kept = np.arange(len(total))
    if len(rest) and len(total) > FOLLOWED:
        kept = np.sort(np.argpartition(-total, FOLLOWED)[:FOLLOWED])
        found, total = (found[0][kept], found[1][kept], found[2][kept]), total[kept]
    return kept, add_scores(embossed, found, fit.cells[rest], scores[rest], total)


def log_likelihood(embossed: EmbossedArray, fit: Fit, hypothesis: Hypothesis) -> float:
    """Return the log-likelihood of the image if the fit lies at this place, nats."""
    return float(log_likelihoods_at(embossed, fit, [hypothesis])[0])


def log_likelihoods_at(
    embossed: EmbossedArray, fit: Fit, hypotheses: Sequence[Hypothesis]
) -> Array:
    """Return the log-likelihoods (n,) of the image if the fit lies at each of n places, nats."""
    places = (
        np.array([one.row for one in hypotheses], np.int64),
        np.array([one.column for one in hypotheses], np.int64),
        np.array([one.face for one in hypotheses], np.int32),
    )
    none = np.zeros(len(hypotheses))
    return add_scores(embossed, places, fit.cells, bounded_scores(fit), none) + fit.value


def bounded_scores(fit: Fit) -> Array:
    """Return scores (m, q + 1) with bounded losses: a registered symbol may be worn, or read wrong.

    Less is lost in a cell of which the sensor sees only a corner.
    """
    least = CAP * np.minimum(1.0, fit.seen / CORNER)[:, None]
    bounded = np.array(fit.scores)
    np.maximum(bounded[:, :-1], fit.scores[:, -1:] - WORN, out=bounded[:, :-1])
    np.maximum(bounded, -least, out=bounded)
    return bounded


def labels_of(embossed: EmbossedArray, hypothesis: Hypothesis, cells: Ints) -> Ints:
    """Return the labels (m,) that cells (m, 2) of a lattice show at a place; `order` for none."""
    array = embossed.array
    held_by, label = embossed.at(
        (hypothesis.row - cells[:, 1]) % array.rows,
        (hypothesis.column + cells[:, 0]) % array.columns,
    )
    return np.where(held_by == hypothesis.face, label, array.order).astype(np.int64)


def labels_at(embossed: EmbossedArray, hypotheses: Sequence[Hypothesis]) -> LabelsAt:
    """Return the labels of lattices' cells, -1 for none, if each lattice lies at its place."""
    array = embossed.array
    rows, columns, faces = (
        np.array([[getattr(one, name)] for one in hypotheses]) for name in ("row", "column", "face")
    )

    def labels(cells: Ints) -> Ints:
        held_by, label = embossed.at(
            (rows - cells[..., 1]) % array.rows, (columns + cells[..., 0]) % array.columns
        )
        return np.where(held_by == faces, label, -1).astype(np.int64)

    return labels


def under_centre(embossed: EmbossedArray, fit: Fit, hypothesis: Hypothesis) -> tuple[int, int]:
    """Return row and column of the array's cell under the sensor's centre."""
    pitch, array = embossed.style.pitch_mm, embossed.array
    i, j = math.floor(fit.x_mm / pitch), math.floor(fit.y_mm / pitch)
    return (hypothesis.row - j) % array.rows, (hypothesis.column + i) % array.columns


def coincide(
    embossed: EmbossedArray, fit: Fit, a: Hypothesis, other_fit: Fit, b: Hypothesis
) -> bool:
    """Whether two hypotheses put the sensor's centre in one place: half a pitch, an eighth turn.

    The cells under the centre do not decide: at the border of two cells they differ by one where
    fits differ by nothing, and so do those of two places one pitch apart.
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


def add_scores(
    embossed: EmbossedArray, places: Places, cells: Ints, scores: Array, before: Array
) -> Array:
    """Return sums (n,) of the scores (m, order + 1) of cells (m, 2) at each place.

    The last score counts where the place's face holds no symbol; sums are added to `before` (n,),
    cell by cell.
    """
    total = before.copy()
    rows, columns, owners = (np.ascontiguousarray(one) for one in places)
    cells, scores = np.ascontiguousarray(cells), np.ascontiguousarray(scores)
    kernels().add_scores(
        ctypes.addressof(embossed.held), len(total), *addresses(rows, columns, owners),
        len(cells), *addresses(cells, scores, total),
    )  # fmt: skip
    return total


def name_places(embossed: EmbossedArray, at: Ints, cells: Ints) -> Ints:
    """Return key of the place times (faces + 1), and its face, as one number (n,) for each.

    Cell (0, 0) lies at that place if cells (n, 2) are the registered ones `at` (n,). Arrays too
    large for one number are named by `place_keys`.
    """
    names = np.empty(len(at), np.int64)
    at, cells = np.ascontiguousarray(at), np.ascontiguousarray(cells)
    kernels().name_places(
        ctypes.addressof(embossed.held), len(at), *addresses(at, cells), len(embossed.faces) + 1,
        *addresses(names),
    )  # fmt: skip
    return names


def place_keys(embossed: EmbossedArray, at: Ints, cells: Ints) -> NDArray[np.uint64]:
    """Return where cell (0, 0) lies (n,), `cell_keys`, if cells (n, 2) are the registered `at`."""
    array = embossed.array
    rows, columns = np.divmod(embossed.keys[at], np.uint64(array.columns))
    row = (rows.astype(np.int64) + cells[:, 1]) % array.rows
    column = (columns.astype(np.int64) - cells[:, 0]) % array.columns
    return cell_keys(array.columns, row, column)


def count_names(names: Ints) -> tuple[Ints, Ints]:
    """Return non-negative numbers (n,), each once and rising, and how often each occurs."""
    known, spare, votes = names.copy(), np.empty_like(names), np.empty_like(names)
    count = kernels().count_names(len(names), *addresses(known, spare, votes))
    return known[:count], votes[:count]


def count_places(embossed: EmbossedArray, cells: Ints, prices: Array, slack: float) -> int:
    """Return how many registered cells can be the one that cells are counted from.

    `cells` (m, 2) show no symbol; `prices` (m,) are the nats of each where the place holds one,
    which may sum to `slack`.
    """
    cells, prices = np.ascontiguousarray(cells), np.ascontiguousarray(prices)
    at = ctypes.addressof(embossed.held)
    return int(kernels().count_places(at, len(cells), *addresses(cells, prices), slack))
