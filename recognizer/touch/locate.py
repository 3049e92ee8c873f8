"""Cells in view -> hypotheses: the places of the database that they can be. Thesis 6.3.

Places come from the surest windows of cells, by the array's own code; where no window is whole,
from cells that any registered cell may be. All are scored, and the likeliest kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.hypothesis import Hypothesis, bounded_scores, labels_at
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.place_scores import (
    Places,
    add_scores,
    count_names,
    name_places,
    place_keys,
)
from recognizer.touch.settings import HypothesisSettings
from recognizer.touch.symbols.fit import Fit

Ints = NDArray[np.int64]
Array = NDArray[np.float64]


def find_hypotheses(
    embossed: EmbossedArray, fits: tuple[Fit, ...], settings: HypothesisSettings
) -> list[Hypothesis]:
    """Return the likeliest places over all fits, best first, at most `kept` of each fit."""
    found: list[Hypothesis] = []
    for number, fit in enumerate(fits):
        found += _hypotheses_of(embossed, fit, number, settings)
    return sorted(found, key=lambda hypothesis: -hypothesis.score)


def find_rivals(
    embossed: EmbossedArray,
    fit: Fit,
    best: Hypothesis,
    number: int,
    settings: HypothesisSettings,
) -> list[Hypothesis]:
    """Return the likeliest other places of the whole database under a fit, best first.

    `find_hypotheses` looks where a few windows point to; a place that differs from the best one
    in a cell of such a window is found here, under scores that the best place has made sharp.

    Parameters
    ----------
    best
        Whose rivals are sought.
    number
        Of the fit, which the places get.
    """
    scores = bounded_scores(fit, settings)
    held = labels_at(embossed, best, fit.cells)
    sure = np.where(held < embossed.array.order, scores.max(axis=1) - scores[:, -1], 0.0)
    found = _anchor_candidates(embossed, fit, scores, sure, settings.anchors_again, settings)
    one_more = replace(settings, kept=settings.kept + 1)
    return [
        other
        for other in _rank_candidates(embossed, fit, number, scores, found, one_more)
        if (other.row, other.column, other.face) != (best.row, best.column, best.face)
    ]


def _hypotheses_of(
    embossed: EmbossedArray, fit: Fit, number: int, settings: HypothesisSettings
) -> list[Hypothesis]:
    scores = bounded_scores(fit, settings)
    found = _window_candidates(embossed, fit, settings)
    if found is None:
        symbol = scores[:, :-1].max(axis=1) - scores[:, -1]  # a symbol rather than none
        found = _anchor_candidates(embossed, fit, scores, symbol, settings.anchors, settings)
    return _rank_candidates(embossed, fit, number, scores, found, settings)


def _rank_candidates(
    embossed: EmbossedArray,
    fit: Fit,
    number: int,
    scores: Array,
    found: Places,
    settings: HypothesisSettings,
) -> list[Hypothesis]:
    """Return the likeliest candidates, best first."""
    rows, columns, owners = found
    if len(rows) == 0:
        return []
    followed, values = _log_likelihoods(embossed, fit, scores, found, settings)
    best = np.argsort(-values, kind="stable")[: settings.kept]
    return [
        Hypothesis(number, int(rows[k]), int(columns[k]), int(owners[k]), value + fit.value)
        for k, value in zip(followed[best].tolist(), values[best].tolist(), strict=True)
    ]


def _window_candidates(
    embossed: EmbossedArray, fit: Fit, settings: HypothesisSettings
) -> Places | None:
    """Return where (0, 0) can lie, from the surest whole windows; None if there is none."""
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
    for k, index in enumerate(embossed.windows()):
        down, right = index.shape
        wide, high = whole.shape[0] - right + 1, whole.shape[1] - down + 1
        if wide < 1 or high < 1 or down * right < largest:
            continue
        corners = [(c, down - 1 - r) for r in range(down) for c in range(right)]
        least = reduce(np.minimum, [whole[x : x + wide, y : y + high] for x, y in corners])
        surest = np.sort(least, axis=None)[-settings.windows :]  # no others are looked up
        kept = (least > settings.sure) & (least >= surest[0])
        for left, low in np.argwhere(kept).tolist():
            cells = [int(number[left + x, low + y]) for x, y in corners]
            seen.append((float(least[left, low]), k, cells))
            largest = len(cells)
    seen = [window for window in seen if len(window[2]) == largest]
    if not seen:
        return None
    found: list[NDArray[np.integer[Any]]] = []
    first: list[int] = []
    for _, k, cells in sorted(seen, reverse=True)[: settings.windows]:
        weakest = min(cells, key=lambda n: float(sure[n]))
        second = int(np.argsort(fit.scores[weakest, :order])[-2])
        for other in (int(labels[weakest]), second):
            code = 0
            for n in cells:
                code = code * order + (other if n == weakest else int(labels[n]))
            found.append(embossed.windows()[k].at(code))
            first.append(cells[0])
    return _origins(embossed, fit, found, first, settings)


def _anchor_candidates(
    embossed: EmbossedArray,
    fit: Fit,
    scores: Array,
    symbol: Array,
    anchors: int,
    settings: HypothesisSettings,
) -> Places:
    """Return where (0, 0) can lie if one of a few cells is a registered one.

    None in a lab that is too large for that.

    Parameters
    ----------
    symbol
        (m,) nats by which cells hold a symbol; the first `anchors` of them are tried.
    """
    order = embossed.array.order
    small = len(embossed.keys) <= settings.large
    tried = np.argsort(-symbol, kind="stable")[: anchors if small else 0]
    tried = tried[symbol[tried] > 0]
    likely = scores[tried, :order] > -settings.cap
    found = [np.flatnonzero(one[embossed.labels[:-1]]) for one in likely]
    return _origins(embossed, fit, found, tried.tolist(), settings)


def _origins(
    embossed: EmbossedArray,
    fit: Fit,
    found: Sequence[NDArray[np.integer[Any]]],
    numbers: list[int],
    settings: HypothesisSettings,
) -> Places:
    """Return where (0, 0) lies, each place once.

    Parameters
    ----------
    found, numbers
        Registered cells (n,), and the number of the fit's cell that may be any of them; several
        such.
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
    if len(both) > settings.many and (votes > 1).any():
        both = both[votes > 1]  # several windows say the same
    place, once = np.divmod(both, faces)
    key = place.astype(np.uint64) if known is None else known[place]
    row, column = np.divmod(key, np.uint64(array.columns))
    return row.astype(np.int64), column.astype(np.int64), once.astype(np.int32)


def _log_likelihoods(
    embossed: EmbossedArray,
    fit: Fit,
    scores: Array,
    found: Places,
    settings: HypothesisSettings,
) -> tuple[Ints, Array]:
    """Return numbers (k,) of candidates, and their log-likelihoods, 0 if every cell is at its best.

    The surest cells come first; of many candidates only the best are followed to the end.
    """
    spread = scores.max(axis=1) - scores.min(axis=1)
    order = np.argsort(-spread * np.minimum(fit.seen, settings.heavy), kind="stable")
    first, rest = order[: settings.first], order[settings.first :]
    total = add_scores(embossed, found, fit.cells[first], scores[first], np.zeros(len(found[0])))
    kept = np.arange(len(total))
    if len(rest) and len(total) > settings.followed:
        kept = np.sort(np.argpartition(-total, settings.followed)[: settings.followed])
        found, total = (found[0][kept], found[1][kept], found[2][kept]), total[kept]
    return kept, add_scores(embossed, found, fit.cells[rest], scores[rest], total)
