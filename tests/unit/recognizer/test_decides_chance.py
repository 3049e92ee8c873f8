"""How many places match by chance, and what borders say: every combination, and by hand."""

import itertools
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import recognizer.touch.chance
from recognizer.touch.chance import (
    chance_of_match,
    expected_by_border,
    expected_matches,
    place_bits,
)
from recognizer.touch.hypothesis import Hypothesis, bounded_scores

SEEN = [(i, j) for j in range(3) for i in range(3)]


def counted(scores, held):
    """The share of all combinations that score as well, one after another."""
    own = sum(row[k] for row, k in zip(scores, held, strict=True))
    sums = [sum(combination) for combination in itertools.product(*scores)]
    return sum(value >= own - 1e-9 for value in sums) / len(sums)


@pytest.mark.parametrize("seed", range(8))
def test_it_is_the_share_of_all_combinations_and_never_less(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    scores = -rng.exponential(3.0, (5, 4))
    held = np.where(rng.random(5) < 0.7, scores.argmax(axis=1), rng.integers(4, size=5))
    truth, found = counted(scores.tolist(), held.tolist()), []
    for grain in (1e-4, 0.25, 1.0):
        monkeypatch.setattr(recognizer.touch.chance, "GRAIN", grain)
        found.append(chance_of_match(scores, held))
    assert found[0] == pytest.approx(truth, abs=1e-12)
    assert truth - 1e-12 <= min(found[1:])
    assert found[1] <= 5 * truth


def square(small, side, order=4, **changed):
    labels = np.random.default_rng(3).integers(order, size=(side, side))
    held = {(r, c): (0, int(labels[r, c])) for r in range(side) for c in range(side)}
    return small.Lab(held, rows=side + 4, columns=side + 5, order=order, **changed)


def places_that_match(lab, cells, scores, held, anchor, behind):
    """Every combination of symbols of every place that holds the cell seen best, one by one."""
    own, total = sum(row[k] for row, k in zip(scores, held, strict=True)), 0.0
    embossed = lab.embossed
    for key, owner in zip(embossed.keys.tolist(), embossed.owners.tolist(), strict=False):
        row, column = divmod(key, embossed.array.columns)
        row, column = row + cells[anchor][1], column - cells[anchor][0]
        bears = [label < lab.order for label in lab.shows(row, column, owner, cells)]
        each = [line[:-1] if here else line[-1:] for line, here in zip(scores, bears, strict=True)]
        sums = np.array([sum(one) for one in itertools.product(*each)])
        total += float((sums >= own - behind).mean())
    return total


@pytest.fixture
def by_border(small, monkeypatch):
    """The doubt of a hypothesis, shares of borders and of what is pressed as they are given."""

    def doubt(lab, fit, place, arrays=None, share=1.0, pressed=1.0):
        monkeypatch.setattr(recognizer.touch.chance, "share_of_borders", lambda *_: share)
        monkeypatch.setattr(
            recognizer.touch.chance, "_pressed_share", lambda *_: np.full(len(fit.cells), pressed)
        )
        found = SimpleNamespace(embossed=lab.embossed, fit=fit, hypothesis=place)
        return expected_by_border(arrays or [lab.embossed], found, 1.3)

    return doubt


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("row", "column"), [(3, 4), (0, 4), (1, 0), (4, 2)])
def test_places_are_counted_with_what_their_outlines_cost(
    small, by_border, seed, row, column, monkeypatch
):
    """A place may be matched that is bare where a symbol is seen, or bears one where none is."""
    rng, cells = np.random.default_rng(seed), [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0)]
    lab = square(small, 5)
    held = lab.shows(row, column, 0, cells)
    scores = -rng.exponential(4.0, (5, 5))
    scores[np.arange(5), held] = -rng.exponential(1.0, 5)
    scores -= scores.max(axis=1, keepdims=True)
    monkeypatch.setattr(recognizer.touch.chance, "GRAIN", 1e-2)
    fit, place = small.fit_of(cells, scores), Hypothesis(0, row, column, 0, 0.0)
    bounded = bounded_scores(fit).tolist()
    anchor = next(n for n, label in enumerate(held) if label < lab.order)
    about = (lab, cells, bounded, held, anchor)
    truth, rounded = places_that_match(*about, 1e-9), places_that_match(*about, 0.05)
    found = by_border(lab, fit, place)
    assert truth * (1 - 1e-9) <= found <= rounded * (1 + 1e-9)
    assert by_border(lab, fit, place, share=0.1) == pytest.approx(found / 10)
    monkeypatch.setattr(recognizer.touch.chance, "GRAIN", 0.25)
    assert truth * (1 - 1e-9) <= by_border(lab, fit, place) <= 5 * truth


def test_all_arrays_that_are_embossed_alike_count(small, by_border, monkeypatch):
    lab, other = square(small, 8), square(small, 10)
    alike = replace(other.embossed, style=lab.embossed.style)
    larger = SimpleNamespace(**vars(alike.style) | {"pitch_mm": 12.0})
    others = [replace(alike, style=larger), replace(alike, alphabet="letters-4")]
    arrays, place = [lab.embossed, alike, *others], Hypothesis(0, 4, 4, 0, 0.0)
    fit = small.fit_of(SEEN, small.sure_of(lab.shows(4, 4, 0, SEEN)))
    doubt = expected_matches(arrays, lab.embossed, fit, place)
    assert doubt == pytest.approx(164 / 4**9)
    # nine clear symbols of four say 18 bits, however many places there are
    assert place_bits(arrays, lab.embossed, doubt) == pytest.approx(18)
    assert place_bits([lab.embossed], lab.embossed, 64 / 4**9) == pytest.approx(18)
    assert by_border(lab, fit, place, arrays) == pytest.approx((36 + 64) / 4**9)
    for large, told in ((163, math.inf), (164, 100 / 4**9)):  # a large lab is not gone through
        monkeypatch.setattr(recognizer.touch.chance, "LARGE_LAB", large)
        assert by_border(lab, fit, place, arrays) == pytest.approx(told)
