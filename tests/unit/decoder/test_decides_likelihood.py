"""Every decision of the likelihood decoder against Bayes' rule, place by place."""

import math
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest

import decoder.likelihood
import decoder.ranking
from decoder import Likelihood, WindowError, decode_likelihood
from decoder.errors import MethodError
from decoder.ranking import Joint, Places, best_of, ranking_of
from decoder.window import (
    checked_labels,
    checked_scores,
    hard_scores,
    parse_window,
    unrelated_score,
)
from generator.array import array_from

BINARY = array_from({"family": "prba", "order": 2, "degree": 8})  # 15 x 17
QUATERNARY = array_from({"family": "prmva", "order": 4, "degree": 4})  # 15 x 17
PRODUCT = array_from({"family": "prpa", "factors": {
    "rows": {"order": 2, "degree": 3}, "columns": {"order": 2, "degree": 4}}})  # fmt: skip
MIXED = array_from({"family": "prmvpa", "factors": {
    "rows": {"order": 2, "degree": 3}, "columns": {"order": 4, "degree": 2}}})  # fmt: skip
ARRAYS = {"binary": BINARY, "quaternary": QUATERNARY, "product": PRODUCT}
OTHER_FIELDS = {
    **{f"GF({q})": array_from({"family": "prmva", "order": q, "degree": n})
       for q, n in ((3, 6), (5, 4), (8, 2), (9, 3))},
    "one row": array_from({"family": "prbs", "order": 2, "degree": 8}),
}  # fmt: skip
ALL_TURNS = (0, 1, 2, 3)


@lru_cache
def hypotheses(array, shape, turns=(0,), cells=None):
    """All (row, column, turn), and the labels (P, k q) as 0 and 1 that each shows."""
    if cells is None:
        cells = [(r, c) for r in range(array.rows) for c in range(array.columns)]
    found, shown = [], []
    for turn in turns:
        height, width = shape if turn % 2 == 0 else shape[::-1]
        a, b = np.indices((height, width))
        for r, c in cells:
            labels = array.symbols((r + a) % array.rows, (c + b) % array.columns)
            seen = np.rot90(labels, -turn)  # as it lies in the window that was read
            found.append((r, c, turn))
            shown.append(np.eye(array.order)[np.asarray(seen, int).ravel()].ravel())
    return found, np.array(shown)


def bayes(array, scores, turns=(0,), cells=None, blank=0.01):
    """Hypotheses, best first, with nats below the best; and the doubt of the best.

    A surface without code has the probability `blank`, every place and turn the same share of
    the rest; without code all symbols are equally likely at every cell.
    """
    found, shown = hypotheses(array, scores.shape[:2], turns, cells and tuple(cells))
    flat = (scores - scores.max(axis=-1, keepdims=True)).reshape(-1, array.order).astype(float)
    each = shown @ flat.ravel()
    weights = (1 - blank) / len(found) * np.exp(each)
    nothing = blank * math.prod(float(np.exp(cell).mean()) for cell in flat)
    order = np.argsort(-each, kind="stable")
    total = weights.sum() + nothing
    ranked = [(*found[n], each[n] - each[order[0]]) for n in order]
    doubt = float((weights.sum() - weights[order[0]] + nothing) / total)
    return ranked, doubt, nothing > weights.sum()


def drawn(array, shape, seed, scale=1.5):
    return scale * np.random.default_rng(seed).normal(size=(*shape, array.order))


@pytest.mark.parametrize(
    ("name", "turns"),
    [(name, turns) for name in ARRAYS for turns in ((0,), (3, 1), ALL_TURNS)]
    + [(name, (0,)) for name in OTHER_FIELDS],
)
def test_doubt_margin_and_place_are_those_of_bayes_rule(name, turns):
    array = (ARRAYS | OTHER_FIELDS)[name]
    for seed, shape in enumerate([(1, 14)] if name == "one row" else [(4, 4), (3, 5), (5, 3)]):
        scores = drawn(array, shape, seed)
        ranked, doubt, _ = bayes(array, scores, turns)
        found = Likelihood(array, rotations=turns, doubt=1.0).decode(scores)
        one = found[0]
        assert (one.row, one.column, one.rotation) == ranked[0][:3]
        assert one.doubt == pytest.approx(doubt, rel=1e-3)
        assert one.margin == pytest.approx(-ranked[1][3], abs=1e-4)
        assert one.runner_up.score == pytest.approx(ranked[1][3], abs=1e-4)
        second = one.runner_up
        assert (second.row, second.column, second.rotation) == ranked[1][:3]
        assert one.candidates == ()
        listed = Likelihood(array, rotations=turns, doubt=1.0).decode(scores, top=5)[0].candidates
        score = {own[:3]: own[3] for own in ranked}
        at = [score[c.row, c.column, c.rotation] for c in listed]
        assert [c.score for c in listed] == pytest.approx(at, abs=1e-4)
        assert at == pytest.approx([own[3] for own in ranked[:5]], abs=1e-4)


@pytest.mark.parametrize("blank", [0.0, 0.01, 0.3])
def test_the_more_turns_and_places_the_more_a_blank_surface_weighs(blank):
    scores = hard_scores(QUATERNARY.symbols(*np.indices((3, 3))), 4, 0.2)
    for turns, cells in (
        ((0,), None), ((0, 2), None), (ALL_TURNS, None),
        (ALL_TURNS, [(0, 0), (3, 5), (14, 16), (7, 7)]),
    ):  # fmt: skip
        _, doubt, _ = bayes(QUATERNARY, scores, turns, cells, blank)
        options = {"prior": cells, "rotations": turns, "blank": blank, "doubt": 1.0}
        found = Likelihood(QUATERNARY, **options).decode(scores)
        assert found.doubts[0] == pytest.approx(doubt, rel=1e-3)


def test_scores_of_labels_by_hand():
    # 4 symbols, wrong with 0.4: right 0.6, each other 0.4 / 3
    found = hard_scores(np.array([[2, -1], [0, 3]]), 4, 0.4)
    least = math.log(0.4 / 3 / 0.6)
    truth = np.full((2, 2, 4), least)
    truth[0, 0, 2] = truth[0, 1] = truth[1, 0, 0] = truth[1, 1, 3] = 0.0
    np.testing.assert_allclose(found, truth, rtol=1e-6)
    unrelated = 3 * math.log((1 + 3 * math.exp(least)) / 4)
    assert unrelated_score(found.reshape(1, 4, 4))[0] == pytest.approx(unrelated)
    for order, bound in ((2, 0.5), (4, 0.75)):
        hard_scores(np.array([0]), order, bound - 1e-6)
        for error in (bound, 0.0, -0.1):
            with pytest.raises(WindowError, match="error rate"):
                hard_scores(np.array([0]), order, error)


def clear(array, shape, seed, scale):
    """Scores of a place's own window, read more or less surely."""
    a, b = np.indices(shape)
    own = np.eye(array.order)[np.asarray(array.symbols(a + 3, b + 4), int)]
    away = np.random.default_rng(seed).uniform(0.5, 1.5, (*shape, array.order))
    return -scale * away * (1 - own)


def with_doubt(target, turns=(0,)):
    """Scores of a window whose best place is wrong with a probability `target`."""
    low, high = 0.1, 20.0
    for _ in range(26):
        middle = (low + high) / 2
        doubt = bayes(BINARY, clear(BINARY, (5, 5), 3, middle), turns)[1]
        low, high = (middle, high) if doubt > target else (low, middle)
    return clear(BINARY, (5, 5), 3, high)


@pytest.mark.parametrize("turns", [(0,), ALL_TURNS])
def test_by_default_one_wrong_answer_in_two_thousand_is_allowed(turns):
    for decode in (
        lambda scores, **given: Likelihood(BINARY, rotations=turns, **given).decode(scores)[0],
        lambda scores, **given: decode_likelihood(BINARY, scores, rotations=turns, **given)[0],
    ):
        allowed, refused = decode(with_doubt(4.95e-4, turns)), decode(with_doubt(5.05e-4, turns))
        assert allowed
        assert allowed.candidates == ()
        assert refused.reason == "ambiguous"
        assert not decode(with_doubt(4.95e-4, turns), doubt=4e-4)
        assert decode(with_doubt(4.95e-4, turns), doubt=allowed.doubt)


@pytest.mark.parametrize("turns", [(0,), (1,), ALL_TURNS])
@pytest.mark.parametrize("name", ["binary", "quaternary"])
def test_why_nothing_is_answered(name, turns):
    array = ARRAYS[name]
    reasons = set()
    for seed in range(30):
        rng = np.random.default_rng(seed)
        shape = ((7, 6), (3, 4), (5, 3))[seed % 3]
        scores = drawn(array, shape, seed, scale=rng.choice([0.8, 1.5, 3.0]))
        scores[rng.random(shape) < (0.0, 0.2, 0.6)[seed % 3]] = 0.0
        _, doubt, blank = bayes(array, scores, turns)
        if doubt <= 5e-4:
            continue
        seen = np.nonzero((scores != 0).any(axis=2))
        reason = "not an encoded surface" if blank else "ambiguous"
        if not array.identifies(*seen):
            reason = "too few symbols"
        found = Likelihood(array, rotations=turns).decode(scores)[0]
        assert (found.reason, found.row, found.rotation) == (reason, None, 0)
        reasons.add(reason)
        assert bool(found.candidates) is (reason != "not an encoded surface")
    assert len(reasons) == 3


@pytest.mark.parametrize("turns", [(0,), ALL_TURNS])
def test_candidates_are_listed_down_to_seven_nats_and_sixteen_of_them(turns):
    lengths = set()
    for seed, scale in enumerate((0.5, 2.0, 5.0, 8.0, 10.0, 15.0, 20.0, 30.0)):
        scores = drawn(BINARY, (3, 3), 100 + seed, scale)
        scores[2, 1:] = 0.0  # so that no window is answered, nor one without code
        ranked, doubt, _ = bayes(BINARY, scores, turns, blank=0.0)
        assert doubt > 5e-4
        found = Likelihood(BINARY, rotations=turns, blank=0.0).decode(scores)[0]
        truth = [one[3] for one in ranked if one[3] >= -7.0][:16]
        assert [c.score for c in found.candidates] == pytest.approx(truth, abs=1e-4)
        lengths.add(len(truth))
    assert 16 in lengths
    assert min(lengths) < 16


@pytest.mark.parametrize("turns", [(0,), ALL_TURNS])
def test_a_prior_of_one_place_has_no_rival_but_its_turns(turns):
    scores = drawn(BINARY, (4, 4), 5)
    found = Likelihood(BINARY, prior=[(3, 4)], rotations=turns, doubt=1.0).decode(scores, top=5)[0]
    ranked, doubt, _ = bayes(BINARY, scores, turns, [(3, 4)])
    assert (found.row, found.column, found.rotation) == ranked[0][:3]
    assert found.doubt == pytest.approx(doubt, rel=1e-3)
    assert len(found.candidates) == len(turns)
    if len(turns) == 1:
        assert (found.margin, found.runner_up, found.candidates[0].score) == (None, None, 0.0)
    else:
        assert found.margin == pytest.approx(-ranked[1][3], abs=1e-4)


def test_a_prior_is_taken_round_the_torus_each_place_once_and_may_be_so_large():
    cells = [(3, 4), (3, 4), (14, 16), (18, 21)]  # 15 x 17: the last is (3, 4) again
    scores = drawn(BINARY, (4, 4), 6)
    _, doubt, _ = bayes(BINARY, scores, cells=[(3, 4), (14, 16)])
    found = Likelihood(BINARY, prior=cells, doubt=1.0).decode(scores)
    assert found.doubts[0] == pytest.approx(doubt, rel=1e-3)
    # 2^20 places, and 2^27 numbers: places times rows times columns times two symbols
    for count, shape in (((1 << 20) + 1, (1, 1)), (1 << 20, (65, 1)), (1 << 20, (1, 65))):
        with pytest.raises(WindowError):
            Places(BINARY, shape, np.broadcast_to(np.array([18, 21]), (count, 2)))


def test_windows_of_a_large_batch_are_weighed_as_one_by_one(monkeypatch):
    rng = np.random.default_rng(7)
    scores = rng.normal(size=(23, 3, 3, 2)).astype(np.float32)
    whole = Likelihood(BINARY, rotations=(0, 1)).decode(scores)
    monkeypatch.setattr(decoder.likelihood, "_WINDOWS", 5)
    for values in (1 << 18, 1):
        monkeypatch.setattr(decoder.likelihood, "_VALUES", values)
        parts = Likelihood(BINARY, rotations=(0, 1)).decode(scores)
        for name in ("rows", "columns", "reasons", "rotations", "indices"):
            np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))
        np.testing.assert_allclose(parts.margins, whole.margins, atol=1e-5)
        np.testing.assert_allclose(parts.doubts, whole.doubts, rtol=1e-4)
        assert parts.candidates.keys() == whole.candidates.keys()
    for i in (0, 4, 5, 22):
        one = Likelihood(BINARY, rotations=(0, 1)).decode(scores[i])
        assert (one.rows[0], one.columns[0]) == (whole.rows[i], whole.columns[i])
        assert one.doubts[0] == pytest.approx(whole.doubts[i], rel=1e-4)


@pytest.mark.parametrize("name", ARRAYS)
def test_the_index_is_the_one_congruent_to_row_and_column(name):
    array = ARRAYS[name]
    for r, c in ((0, 0), (1, 0), (0, 1), (6, 11), (2, 14)):
        a, b = np.indices((5, 5))
        window = array.symbols((r + a) % array.rows, (c + b) % array.columns)
        found = Likelihood(array, error=1e-6).decode(window)[0]
        truth = r * array.columns + c
        if name != "product":
            truth = next(t for t in range(255) if (t % 15, t % 17) == (r, c))
        assert (found.row, found.column, found.t) == (r, c, truth)
    for degree in (48, 64):
        array = array_from({"family": "prba", "order": 2, "degree": degree})
        r, c = array.rows - 2, array.columns - 3
        a, b = np.indices((9, 9)).astype(np.uint64)
        rows, columns = (np.uint64(r) + a) % array.rows, (np.uint64(c) + b) % array.columns
        found = Likelihood(array, prior=[(r, c), (0, 0)]).decode(array.symbols(rows, columns))[0]
        assert (found.row, found.column) == (r, c)
        assert (found.t % array.rows, found.t % array.columns) == (r, c)
        assert found.t < array.rows * array.columns


@pytest.mark.parametrize(
    "options",
    [{"doubt": 0.0}, {"doubt": 1.01}, {"blank": -0.01}, {"blank": 1.0}, {"prior": [1, 2]},
     {"prior": np.zeros((0, 2), int)}, {"rotations": ()}, {"rotations": (4,)},
     {"rotations": (0, -1)}],
)  # fmt: skip
def test_what_is_no_probability_no_place_and_no_turn_is_refused(options):
    with pytest.raises(WindowError) as refused:
        Likelihood(BINARY, **options).decode(np.zeros((6, 6), int))
    assert refused.value.fix
    Likelihood(BINARY, doubt=1.0, blank=0.0, rotations=(0, 1, 2, 3))  # the bounds
    Likelihood(BINARY, doubt=1e-12, blank=0.999, rotations=(3,))


@pytest.mark.parametrize("places", [3, 40, 1023, 1024, 1500, 4099])
@pytest.mark.parametrize("number", [1, 2, 3, 16, 20])
def test_the_best_places_are_where_they_are_said_to_be(places, number):
    values = np.random.default_rng(9).normal(size=(3, places)).astype(np.float32)
    values[1] = np.sort(values[1])
    values[0, 0] = 5.0  # in the first block
    values[2, -1] = 9.0  # in the last block, which may be short
    found, chosen, rest = best_of(values.copy(), number)
    kept = min(max(number, 2), places)
    assert found.shape == chosen.shape == (3, kept)
    np.testing.assert_array_equal(np.take_along_axis(values, found, axis=1), chosen)
    np.testing.assert_array_equal(chosen, -np.sort(-values, axis=1)[:, :kept])
    weights = np.exp(values - values.max(axis=1, keepdims=True))
    np.testing.assert_allclose(rest, weights.sum(axis=1) - 1, rtol=1e-4)


@pytest.mark.parametrize("number", [2, 5, 20])
@pytest.mark.parametrize("pairs", [15, 40, 60])  # one, two and four rows at a time
@pytest.mark.parametrize(("array", "shape"), [(PRODUCT, (4, 5)), (MIXED, (6, 2))])
def test_windows_of_products_are_searched_as_weighed(monkeypatch, array, shape, pairs, number):
    rng = np.random.default_rng(10)
    scores = rng.normal(size=(8, *shape, array.order))
    scores *= np.array([1, 2, 3, 4, 6, 8, 20, 60])[:, None, None, None]  # from faint to sharp
    rows_alone = 40 * rng.normal(size=(shape[0], 1, array.law.shape[0], 1))
    scores[7][..., array.law] = rows_alone  # all places of a row are alike
    scores -= scores.max(axis=-1, keepdims=True)
    flat = scores.reshape(8, shape[0] * shape[1], -1).astype(np.float32)
    monkeypatch.setattr(decoder.ranking, "_PAIRS", pairs)
    found = ranking_of(array, shape).rank(flat, number)
    _, shown = hypotheses(array, shape)  # 7 x 15
    for i in range(8):
        each = shown @ flat[i].ravel().astype(float)
        best = np.sort(each)[::-1]
        np.testing.assert_allclose(found.values[i], best[:number], rtol=1e-5, atol=1e-5)
        listed = found.rows[i] * array.columns + found.columns[i]
        assert len(set(listed.tolist())) == number
        np.testing.assert_allclose(each[listed.astype(int)], found.values[i], rtol=1e-5, atol=1e-5)
        # every row that weighs is weighed, listed or not
        assert found.rest[i] == pytest.approx(np.exp(best[1:] - best[0]).sum(), rel=1e-4)


def test_places_that_are_too_many_to_be_tried_weigh_as_many_on_the_average():
    array = array_from({"family": "prba", "order": 2, "degree": 20})  # beyond the transform
    scores = drawn(array, (6, 6), 4, 0.35)
    scores -= scores.max(axis=-1, keepdims=True)
    found = ranking_of(array, (6, 6)).rank(scores.reshape(1, 36, 2).astype(np.float32), 2)
    labels = array.symbols(*np.indices((array.rows, array.columns)))
    every = sum(scores[a, b][np.roll(labels, (-a, -b), (0, 1))] for a in range(6) for b in range(6))
    best = every[int(found.rows[0, 0]), int(found.columns[0, 0])]
    assert found.values[0, 0] == pytest.approx(best, abs=1e-3)
    assert found.rest[0] == pytest.approx(np.exp(every - best).sum() - 1, rel=0.05)
    # with weights that tell little, what is not tried is nearly all of it
    assert found.rest[0] > 100


@pytest.mark.parametrize("column", [-1, -6, -40])
def test_a_prior_next_to_the_end_of_a_cycle_of_2_to_the_64(column):
    array = array_from({"family": "prbs", "order": 2, "degree": 64})
    cycle = 2**64 - 1
    steps = [(cycle + column + k) % cycle for k in range(90)]
    prior = np.array([[0, 5], [0, cycle + column]], dtype=np.uint64)
    scores = hard_scores(array.symbols([0] * 90, steps), 2)[None]
    found = Places(array, (1, 90), prior).rank(scores, 2)
    assert found.columns[0].tolist() == [cycle + column, 5]
    assert found.values[0, 0] == 0.0
    assert found.values[0, 1] < 0.0


@pytest.mark.parametrize(("rows", "columns"), [((1 << 17) - 1, 3), (3, (1 << 17) - 1)])
def test_product_arrays_of_more_than_2_to_the_16_rows_or_columns_are_refused(rows, columns):
    with pytest.raises(MethodError):
        Joint(SimpleNamespace(rows=rows, columns=columns), (3, 3))


def test_labels_are_symbols_of_the_array_or_unseen():
    assert checked_labels([[-1, 3]], 4).tolist() == [[[-1, 3]]]
    for labels, said in (([-2, 3], "from -2 to 3"), ([-1, 4], "from -1 to 4"), ([4, 4], "from 4")):
        with pytest.raises(WindowError, match=said):
            checked_labels([labels], 4)
    for text, cells in (("0? 31", [[0, -1], [3, 1]]), ("3,?", [[3, -1]])):
        assert parse_window(text, 4).tolist() == cells
    for text in ("4", "x"):
        with pytest.raises(WindowError, match=f"row 1 '{text}'"):
            parse_window(text, 4)
    assert parse_window("10, ?, 3,", 32).tolist() == [[10], [-1], [3]]
    with pytest.raises(WindowError, match="'f' is no symbol") as caught:
        parse_window("0f", 16)
    assert "commas" in caught.value.fix


LABELS = [
    ((2, 3), int, (1, 2, 3)), ((1, 1), bool, (1, 1, 1)), ((4, 2, 3), np.uint8, (4, 2, 3)),
    ((0, 2, 3), int, (0, 2, 3)),
    *((shape, int, None) for shape in ((0, 3), (3, 0), (3, 0, 2), (3, 2, 0), (2,), (1, 1, 1, 1))),
    ((2, 3), float, None), ((2,), float, None),
]  # fmt: skip
SCORES = [
    ((2, 3, 4), float, (1, 2, 3, 4)), ((5, 2, 3, 4), np.float32, (5, 2, 3, 4)),
    ((0, 2, 3, 4), float, (0, 2, 3, 4)), ((1, 1, 4), float, (1, 1, 1, 4)),
    *((shape, float, None) for shape in (
        (0, 2, 4), (2, 0, 4), (3, 0, 2, 4), (3, 2, 0, 4), (2, 3, 5), (2, 4), (1, 1, 1, 1, 4))),
    ((2, 3, 4), int, None), ((2, 4), int, None),
]  # fmt: skip


@pytest.mark.parametrize(
    ("checked", "shape", "kind", "whole"),
    [(checked_labels, *case) for case in LABELS] + [(checked_scores, *case) for case in SCORES],
)
def test_windows_have_two_dimensions_scores_and_batches_one_more(checked, shape, kind, whole):
    if whole is None:
        with pytest.raises(WindowError, match=r"a window is|scores are|at least one cell"):
            checked(np.zeros(shape, kind), 4)
    else:
        assert checked(np.zeros(shape, kind), 4).shape == whole
