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


def test_without_a_symbol_everything_matches():
    assert chance_of_match(np.zeros((0, 4)), np.zeros(0, np.int64)) == 1.0


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


def doubt_of(small, lab, row=4, column=4, arrays=None, **changed):
    """Of a touch that shows beyond doubt what a place of the first face of a lab holds."""
    labels = lab.shows(row, column, 0, SEEN)
    fit = small.fit_of(SEEN, small.sure_of(labels, lab.order), **changed)
    arrays = [lab.embossed] if arrays is None else arrays
    place = Hypothesis(0, row, column, 0, 0.0)
    return expected_matches(arrays, lab.embossed, fit, place)


def square(small, side, order=4, **changed):
    labels = np.random.default_rng(3).integers(order, size=(side, side))
    held = {(r, c): (0, int(labels[r, c])) for r in range(side) for c in range(side)}
    return small.Lab(held, rows=side + 4, columns=side + 5, order=order, **changed)


def test_places_times_chance(small):
    for side, order, dense in ((8, 4, False), (10, 4, False), (8, 2, False), (8, 4, True)):
        lab = square(small, side, order=order, dense=dense)
        assert doubt_of(small, lab) == pytest.approx(side**2 / order**9)


def test_all_arrays_that_are_embossed_alike_count(small):
    lab, other = square(small, 8), square(small, 10)
    larger = SimpleNamespace(**vars(other.embossed.style) | {"pitch_mm": 12.0})
    unlike = replace(other.embossed, style=larger)
    letters = replace(other.embossed, alphabet="letters-4")
    both = [lab.embossed, other.embossed, unlike, letters]
    doubt = doubt_of(small, lab, arrays=both)
    assert doubt == pytest.approx(164 / 4**9)
    # nine clear symbols of four say 18 bits, however many places there are
    assert place_bits(both, lab.embossed, doubt) == pytest.approx(18)
    assert place_bits([lab.embossed], lab.embossed, 64 / 4**9) == pytest.approx(18)


def test_at_an_edge_the_places_count_whose_border_agrees(small, monkeypatch):
    lab = square(small, 8)
    # cells (0, 0) ... (2, 2) of a place at row 4, column 7: the left column of them alone is held
    assert doubt_of(small, lab, column=7) == pytest.approx(6 / 4**3 + 2 / 4**3)
    # in the corner one cell is held, and one place is such a corner
    assert doubt_of(small, lab, row=0, column=7) == pytest.approx(1 / 4)
    # a large lab is not gone through
    monkeypatch.setattr(recognizer.touch.chance, "LARGE_LAB", 63)
    assert doubt_of(small, lab, column=7) == pytest.approx(64 / 4**3)
    monkeypatch.setattr(recognizer.touch.chance, "LARGE_LAB", 64)
    assert doubt_of(small, lab, column=7) == pytest.approx(8 / 4**3)


@pytest.mark.parametrize(("behind", "places"), [(0.0, 8), (3.9, 8), (4.1, 64)])
def test_a_place_that_itself_falls_behind_may_be_matched_over_a_bare_cell(small, behind, places):
    """A bare cell costs a place that holds a symbol 4 nats: as much as a worn one."""
    lab = square(small, 8)
    cells = [(0, 0), (0, 1), (1, 0)]  # the last one is beyond the edge
    scores = small.sure_of(lab.shows(4, 7, 0, cells))
    label = lab.shows(4, 7, 0, cells)[0]
    scores[0, :4] = -12.0
    scores[0, label], scores[0, (label + 1) % 4] = -behind, 0.0
    fit = small.fit_of(cells, scores)
    found = expected_matches([lab.embossed], lab.embossed, fit, Hypothesis(0, 4, 7, 0, 0.0))
    # of the first cell two symbols score as well, of the second one does
    assert found == pytest.approx(places * 2 / 4 / 4)


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


def sure_touch(small, lab, row, column):
    place = Hypothesis(0, row, column, 0, 0.0)
    return small.fit_of(SEEN, small.sure_of(lab.shows(row, column, 0, SEEN), lab.order)), place


def test_corners_count_in_a_corner_edges_at_an_edge_and_arrays_that_are_embossed_alike(
    small, by_border, monkeypatch
):
    lab, other = square(small, 8), square(small, 10)
    assert by_border(lab, *sure_touch(small, lab, 4, 7)) == pytest.approx(6 / 4**3)
    assert by_border(lab, *sure_touch(small, lab, 0, 7)) == pytest.approx(1 / 4)
    larger = SimpleNamespace(pitch_mm=8.0, height_mm=1.2, stroke_mm=1.4)
    both = [lab.embossed, replace(other.embossed, style=lab.embossed.style)]
    unlike = [lab.embossed, replace(other.embossed, style=larger)]
    unlike.append(replace(both[1], alphabet="letters-4"))
    fit, place = sure_touch(small, lab, 4, 4)
    assert by_border(lab, fit, place, both) == pytest.approx((36 + 64) / 4**9)
    assert by_border(lab, fit, place, unlike) == pytest.approx(36 / 4**9)
    for large, told in ((163, math.inf), (164, 100 / 4**9)):
        monkeypatch.setattr(recognizer.touch.chance, "LARGE_LAB", large)
        assert by_border(lab, fit, place, both) == pytest.approx(told)
