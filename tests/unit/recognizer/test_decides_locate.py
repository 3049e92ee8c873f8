"""Places of the database: against a walk over every place, and costs worked by hand."""

import itertools
import math

import numpy as np
import pytest

from recognizer.touch.hypothesis import (
    Hypothesis,
    PlaceHypothesis,
    coincide,
    find_hypotheses,
    find_rivals,
    log_likelihood,
)

ALL = 10**6
SQUARE = [(i, j) for j in range(4) for i in range(4)]
APART = [(0, 0), (2, 0), (0, 2), (2, 2), (4, 1)]  # no two in a window


def at(row, column, face=0, fit=0):
    return Hypothesis(fit, row, column, face, 0.0)


def where(found):
    return {(one.row, one.column, one.face) for one in found}


def cost(scores, seen, label):
    """What a cell costs a place that shows a label there, nats.

    A registered symbol that is not felt costs 4 more than none; no cell more than 8, one of
    which less than 8 tactels are seen the same share of that.
    """
    none = scores[-1]
    own = none if label == len(scores) - 1 else max(scores[label], none - 4.0)
    return max(own, -8.0 * min(1.0, seen / 8.0))


def by_hand(lab, fit, place):
    row, column, face = place
    labels = lab.shows(row, column, face, fit.cells.tolist())
    return sum(cost(*one) for one in zip(fit.scores, fit.seen, labels, strict=True)) + fit.value


def soft(lab, place, cells, small, seed, spread=2.0, least=-9.0):
    """A fit at a place, blurred."""
    labels = lab.shows(*place, cells)
    rng = np.random.default_rng(seed)
    scores = small.sure_of(labels, least=least) + spread * rng.normal(size=(len(cells), 5))
    scores -= scores.max(axis=1, keepdims=True)
    return small.fit_of(cells, scores, rng.uniform(1.0, 30.0, len(cells)), value=-123.0)


@pytest.mark.parametrize(
    ("cells", "place"),
    [(SQUARE, place) for place in ((5, 3, 0), (3, 4, 0), (0, 11, 1), (10, 12, 1), (6, 7, 0))]
    + [(APART, (5, 3, 0)), (APART, (3, 4, 0))],
)
def test_the_place_of_a_clear_touch_is_found_with_its_likelihood(small, cells, place):
    lab = small.two_faces()
    for seed in range(4):
        fit = soft(lab, place, cells, small, seed, spread=0.5)
        found = find_hypotheses(lab.embossed, (fit,))
        every = sorted(((by_hand(lab, fit, one), one) for one in lab.places(cells)), reverse=True)
        assert (found[0].row, found[0].column, found[0].face) == every[0][1]
        for one in found:
            score = by_hand(lab, fit, (one.row, one.column, one.face))
            assert one.score == pytest.approx(score)
            assert log_likelihood(lab.embossed, fit, one) == pytest.approx(score)
        assert [one.score for one in found] == sorted((one.score for one in found), reverse=True)


@pytest.mark.parametrize("cells", [SQUARE, APART, [(i + 3, j) for i, j in SQUARE]])
@pytest.mark.parametrize("size", [(2**32 - 5, 2**30), (2**29 + 5, 2**31), (2**31, 2**29 + 5)])
def test_places_of_arrays_too_large_to_name_them_by_one_number(small, cells, size):
    rows, columns = size
    held = {
        ((r + 2) % rows, (c + 3) % columns): own
        for r, c in itertools.product(range(-5, 4), range(-6, 3))
        for own in [(int(r > 0), (r * r + 3 * c + r * c) % 4)]
    }
    lab = small.Lab(held, rows, columns)
    for row, column, face in ((1, columns - 2, 0), (rows - 2, 1, 0), (5, 0, 1)):
        place = (row, (column - cells[0][0]) % columns, face)
        fit = soft(lab, place, cells, small, seed=3, spread=0.5)
        found = find_hypotheses(lab.embossed, (fit,), ALL)
        places = where(found)
        assert len(places) == len(found)
        assert places <= lab.places(cells)
        assert place in places
        for one in found:
            own = by_hand(lab, fit, (one.row, one.column, one.face))
            assert one.score == pytest.approx(own)


def anchored(lab, fit, scores, symbol, anchors):
    """Places at which one of the surest cells is registered with a label that may be."""
    order = np.argsort(-np.array(symbol), kind="stable")[:anchors]
    return {
        ((r + fit.cells[n, 1]) % lab.rows, (c - fit.cells[n, 0]) % lab.columns, face)
        for n in order
        if symbol[n] > 0
        for (r, c), (face, label) in lab.held.items()
        if scores[n][label] > -8.0
    }


def costs(fit):
    """What each cell costs a place by the label that it shows there."""
    both = zip(fit.scores, fit.seen, strict=True)
    return np.array([[cost(own, seen, label) for label in range(5)] for own, seen in both])


@pytest.mark.parametrize("seed", range(12))
def test_where_no_window_is_whole_three_cells_are_tried_in_turn_as_registered_ones(small, seed):
    lab = small.two_faces()
    fit = soft(lab, (4, 3, 0), APART, small, seed, spread=3.0, least=-3.0)
    bounded = costs(fit)
    symbol = bounded[:, :4].max(axis=1) - bounded[:, 4]
    truth = anchored(lab, fit, bounded, symbol, 3)
    assert truth != anchored(lab, fit, bounded, symbol, 2)
    found = find_hypotheses(lab.embossed, (fit,), ALL)
    assert where(found) == truth
    assert len(found) == len(truth)  # each once
    for one in found:
        assert one.score == pytest.approx(by_hand(lab, fit, (one.row, one.column, one.face)))


@pytest.mark.parametrize(
    ("pairs", "single", "count"), [(2, 509, 1024), (1, 511, 1), (0, 600, 1200)]
)
def test_of_more_than_1024_candidates_those_count_that_two_windows_agree_on_if_any(
    small, pairs, single, count
):
    # each zero alone is two candidates, each pair three, of which one has both
    zeros = {10 * n for n in range(single)}
    zeros |= {10_000 + 10 * n + far for n in range(pairs) for far in (0, 2)}
    held = {(0, c): (0, int(c not in zeros)) for c in range(20_000)}
    lab = small.Lab(held, rows=1, columns=20_000)
    fit = small.fit_of([(0, 0), (2, 0)], [[0.0, -30, -30, -30, -30]] * 2)
    found = find_hypotheses(lab.embossed, (fit,), ALL)
    assert len(found) == count
    assert sum(one.score == 0.0 for one in found) == pairs


@pytest.mark.parametrize("seed", range(8))
def test_rivals_are_sought_from_two_cells_that_the_best_place_holds(small, seed):
    lab = small.two_faces()
    best = (5, 5, 0)
    cells = [(i, j) for i in range(5) for j in range(3)]  # columns 8 and on hold nothing there
    fit = soft(lab, best, cells, small, seed, spread=3.0, least=-3.0)
    bounded, held = costs(fit), np.array(lab.shows(*best, cells)) < 4
    sure = held * (bounded.max(axis=1) - bounded[:, 4])
    truth = anchored(lab, fit, bounded, sure, 2)
    found = find_rivals(lab.embossed, fit, at(*best), 9, ALL)
    assert where(found) == truth - {best}
    assert {one.fit for one in found} == {9}
    for one in found:
        assert one.score == pytest.approx(by_hand(lab, fit, (one.row, one.column, one.face)))
    few = find_rivals(lab.embossed, fit, at(*best), 9, 3)
    kept = 3 if best in truth and by_hand(lab, fit, best) >= found[2].score else 4
    assert [one.score for one in few] == pytest.approx([one.score for one in found[:kept]])


def test_a_place_of_the_same_cell_on_another_face_is_a_rival(small):
    # two faces side by side: a lattice over both is a place of either
    held = {(3, c): (int(c > 4), c % 3) for c in range(2, 8)}
    lab = small.Lab(held)
    cells = [(i, 0) for i in (3, 0, 1, 2, 4, 5)]
    fit = small.fit_of(cells, small.sure_of([(i + 2) % 3 for i, _ in cells]))
    found = find_hypotheses(lab.embossed, (fit,), ALL)
    assert {(3, 2, 0), (3, 2, 1)} <= where(found)
    rivals = find_rivals(lab.embossed, fit, at(3, 2, 0), 0, ALL)
    assert (3, 2, 0) not in where(rivals)


def test_one_place_is_within_half_a_pitch_and_an_eighth_turn_round_the_array(small):
    embossed = small.two_faces().embossed  # 11 x 13, pitch 7

    def fit(x=3.0, y=3.0, theta=0.2):
        return small.fit_of([(0, 0)], [[0.0] * 5], x_mm=x, y_mm=y, theta_rad=theta)

    for row, column, other, same in (
        (9, 12, fit(), True), (8, 12, fit(), False), (9, 11, fit(), False),
        (9, 12, fit(x=6.4), True), (9, 12, fit(x=6.6), False), (9, 12, fit(x=-0.4), True),
        (9, 12, fit(y=6.4), True), (9, 12, fit(y=-0.6), False), (9, 11, fit(x=10.0), True),
        (10, 12, fit(y=10.0), True), (10, 12, fit(y=-4.0), False), (9, 0, fit(x=-4.0), True),
        (0, 12, fit(y=17.0), True), (0, 12, fit(y=3.0), False), (9, 12, fit(theta=0.98), True),
        (9, 12, fit(theta=0.99), False), (9, 12, fit(theta=0.2 - math.tau), True),
    ):  # fmt: skip
        assert coincide(embossed, fit(), at(9, 12, 1), other, at(row, column, 1)) is same
    assert not coincide(embossed, fit(), at(9, 12, 1), fit(), at(9, 12, 0))
    places = [
        PlaceHypothesis(embossed=lab, hypothesis=at(9, column, 1), fit=fit(), score=0.0)
        for lab, column in ((embossed, 12), (embossed, 12), (embossed, 11), (None, 12))
    ]
    assert [places[0].coincides(other) for other in places] == [True, True, False, False]
