"""Whether a place is an answer: evidence and chance by hand, each bound from both sides."""

import itertools
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import recognizer.touch.chance
import recognizer.touch.evidence
from recognizer.touch.chance import (
    chance_of_match,
    expected_by_border,
    expected_matches,
    place_bits,
)
from recognizer.touch.evidence import VerifiedHypothesis, symbols_to_name, weigh_cells
from recognizer.touch.hypothesis import Hypothesis, bounded_scores
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, NOT_ENCODED, TOO_FEW
from recognizer.touch.verdict import (
    Evidence,
    is_encoded,
    least_margin,
    may_count_border,
    reject_chance,
    reject_joined,
    reject_margin,
    reject_reason,
)

LIMITS = ReaderOptions()
GOOD = Evidence(20.0, inliers=12, bits=24.0, contradictions=0, explained=0.9)
#: Limits of margins, nats: 10 and 14 but for rounding.
TEN, FOURTEEN = LIMITS.margin, LIMITS.margin_by_few


@pytest.mark.parametrize(
    ("changed", "believed"),
    [
        ({}, True),
        # at least 3 nats over symbols of no registered place
        ({"log_likelihood_ratio": 3.0}, True),
        ({"log_likelihood_ratio": 2.99}, False),
        ({"log_likelihood_ratio": -5.0}, False),
        # below 7 nats at least four fifths are explained
        ({"log_likelihood_ratio": 6.99, "explained": 0.8}, True),
        ({"log_likelihood_ratio": 6.99, "explained": 0.799}, False),
        ({"log_likelihood_ratio": 7.0, "explained": 0.799}, True),
        # so where strokes are more than 0.09 mm wider than asked
        ({"stroke_excess": 0.9, "explained": 0.799}, True),
        ({"stroke_excess": 0.91, "explained": 0.799}, False),
        ({"stroke_excess": 0.91, "explained": 0.8}, True),
        ({"stroke_excess": -1.2, "explained": 0.799}, True),
        # 72 % where symbols say less than 22 bits, 58 % where they say more
        ({"bits": 21.9, "explained": 0.72}, True),
        ({"bits": 21.9, "explained": 0.719}, False),
        ({"bits": 22.0, "explained": 0.58}, True),
        ({"bits": 22.0, "explained": 0.579}, False),
        ({"bits": 0.0, "explained": 0.72}, True),  # chance is another reason
        # one cell may speak clearly for another symbol, none plainly
        ({"contradictions": 1}, True),
        ({"contradictions": 2}, False),
        ({"contradictions": 1, "strong_contradictions": 1}, False),
    ],
)
def test_each_bound_of_belief_from_both_sides(changed, believed):
    assert is_encoded(replace(GOOD, **changed)) is believed


@pytest.mark.parametrize(
    ("changed", "margin", "given", "reason"),
    [
        ({}, 13.0, {}, ""), ({}, 12.9, {}, AMBIGUOUS), ({}, math.inf, {}, ""),
        # the first condition that fails is the reason
        ({"log_likelihood_ratio": 2.99}, 9.0, {}, NOT_ENCODED),
        # of a scan: half of the touches are too few; one touch alone is one that agrees
        ({"touches": 4, "agreeing": 3}, FOURTEEN, {}, ""),
        ({"touches": 4, "agreeing": 2}, FOURTEEN, {}, TOO_FEW),
        ({"touches": 4, "agreeing": 2, "contradictions": 2}, FOURTEEN, {}, NOT_ENCODED),
        ({"touches": 2}, FOURTEEN, {}, TOO_FEW), ({"agreeing": 0}, FOURTEEN, {}, ""),
        # more nats may be asked for
        *(({"log_likelihood_ratio": ratio, "best_ratio": best}, FOURTEEN, {"least_ratio": 8.0}, why)
          for ratio, best, why in (
              (8.0, 8.0, ""), (7.9, 8.0, TOO_FEW), (2.9, 8.0, NOT_ENCODED), (2.9, 7.9, TOO_FEW))),
        # of many cells a share may contradict
        *(({"inliers": 60, "contradictions": wrong}, FOURTEEN, given, why)
          for wrong, given, why in (
              (3, {"wrong_share": 0.05}, ""), (4, {"wrong_share": 0.05}, NOT_ENCODED),
              (3, {}, NOT_ENCODED))),
    ],
)  # fmt: skip
def test_each_reason_in_its_order(changed, margin, given, reason):
    assert reject_reason(replace(GOOD, **changed), margin, 13.0, **given) == reason


def test_bounds_of_margins_and_of_chance():
    strict = ReaderOptions(margin=12.0, margin_by_few=16.0)
    assert [least_margin(bits, strict) for bits in (21.9, 22.0)] == [16.0, 12.0]
    assert [may_count_border(GOOD, margin, strict) for margin in (16.0, 15.9)] == [True, False]
    assert [reject_margin(margin, 3.0) for margin in (3.0, 2.99)] == ["", AMBIGUOUS]
    found = [reject_chance(doubt, 1e-4) for doubt in (1e-4, 1.01e-4, 1.0, 1.01)]
    assert found == ["", BY_CHANCE, BY_CHANCE, TOO_FEW]
    assert [reject_chance(doubt, 3.0) for doubt in (3.0, 3.01)] == ["", TOO_FEW]


CUBE = ("Cube", "F1")


@pytest.mark.parametrize(
    ("confirmed", "outliers", "sd_mm", "reason"),
    [
        (None, 0, 0.6, ""), (CUBE, 0, 0.6, ""), (CUBE, 0, 0.601, TOO_FEW),
        (("Cube", "F2"), 0, 0.1, AMBIGUOUS), (("Box", "F1"), 9, 9.0, AMBIGUOUS),
        # a touch that disagrees is answered by the others, while it is one of few
        (CUBE, 3, 0.1, ""), (CUBE, 4, 0.1, NOT_ENCODED), (None, 1, 0.1, NOT_ENCODED),
        (CUBE, 4, 9.0, NOT_ENCODED),
    ],
)  # fmt: skip
def test_the_answer_of_several_touches(confirmed, outliers, sd_mm, reason):
    assert reject_joined(CUBE, confirmed, outliers, 3, sd_mm) == reason


@pytest.mark.parametrize(
    ("scores", "seen", "held", "truth"),
    [
        ([-9, -9, 0, -9, -9], 20, 2, (False, True, True, 0.0)),
        ([-9, -9, 0, -9, -9], 6.0, 2, (False, True, True, 0.0)),
        ([-9, -9, 0, -9, -9], 5.99, 2, (False, False, False, 0.0)),
        # none is likelier than the symbol: it is worn, unless another one is likelier still
        ([-2, -9, -3, -9, 0], 20, 2, (True, True, False, -2.0)),
        ([-9, -9, 0, -9, 0], 20, 2, (False, True, False, 0.0)),
        ([-1000, -1000, 0, -1000, 0], 20, 2, (False, True, False, 0.0)),  # as likely as all else
        # but not where rounding alone tells the two apart
        ([-9, -9, 0, -9, 0.9e-4], 20, 2, (False, True, False, 0.0)),
        ([-9, -9, 0, -9, 1e-4], 20, 2, (False, True, False, 0.0)),
        ([-9, -9, 0, -9, 1.1e-4], 20, 2, (True, True, False, -1.1e-4)),
        # another symbol is likelier
        ([0, -9, -4.5, -9, -9], 20, 2, (False, True, False, 4.5)),
        ([0, -9, -4.5, -9, -4.4], 20, 2, (True, True, False, 4.4)),  # sharing no stroke
        # no symbol is registered: what speaks against it is the likeliest one
        ([-1, -9, -2, -9, 0], 20, None, (False, True, False, -1.0)),
        ([0, -9, -2, -9, -7.5], 20, None, (False, True, False, 7.5)),
    ],
)
def test_what_one_cell_says(small, scores, seen, held, truth):
    lab = small.Lab({(5, 5): (0, held)} if held is not None else {(0, 0): (0, 1)})
    fit = small.fit_of([(0, 0)], [scores], seen)
    found = weigh_cells(lab.embossed, fit, Hypothesis(0, 5, 5, 0, 0.0))
    assert (found.worn[0], found.seen[0], found.agree[0]) == truth[:3]
    assert found.against[0] == pytest.approx(truth[3])


@pytest.mark.parametrize(
    ("keys", "order", "symbols"),
    [(1, 4, 0), (2, 4, 1), (4, 4, 1), (5, 4, 2), (16, 4, 2), (17, 4, 3), (64, 2, 6), (65, 2, 7)],
)
def test_how_many_symbols_name_one_of_so_many_cells(small, keys, order, symbols):
    held = {(r, c): (0, 0) for r in range(9) for c in range(10)}
    lab = small.Lab(dict(list(held.items())[:keys]), order=order)
    assert symbols_to_name(lab.embossed) == symbols


def verified(small, fit, place, score=0.0, lab=None):
    lab = lab or small.two_faces()
    return VerifiedHypothesis(lab.embossed, place, fit, score, None)


def test_what_speaks_for_a_place(small, monkeypatch):
    lab = small.two_faces()
    place = Hypothesis(0, 5, 3, 0, 0.0)
    cells = [(i, j) for j in range(4) for i in range(4)]
    labels = lab.shows(5, 3, 0, cells)
    assert 4 not in labels
    scores = small.sure_of(labels)
    for n, against in ((0, 7.9), (1, 8.0), (2, 8.1), (3, 9.9), (4, 10.0), (5, 10.1), (6, 30.0)):
        scores[n] = -40.0
        scores[n, labels[n]], scores[n, (labels[n] + 1) % 4] = -against, 0.0
    scores[7] = [-20.0] * 4 + [0.0]  # worn
    seen = np.full(16, 20.0)
    seen[[6, 15]] = 5.0  # hardly in view
    fit = small.fit_of(cells, scores, seen, nuisance=np.array([0.7, 0.1, 0.2, 0.3]), value=-5.0)
    asked = []

    def share(image, pose, gain, labels_at):
        asked.append(labels_at(np.array([cells])))
        return 0.77

    monkeypatch.setattr(recognizer.touch.evidence, "explained_share", share)
    one = verified(small, fit, place, score=-4.0, lab=lab)
    found = one.evidence
    assert found.explained == 0.77
    assert found.contradictions == 4  # 8.1, 9.9, 10.0 and 10.1
    assert found.strong_contradictions == 1  # 10.1
    # of sixteen one is worn, seven speak otherwise, one is hardly seen
    assert (found.inliers, found.bits) == (7, 14.0)
    assert found.worn == 1
    assert found.stroke_excess == 0.7
    each = np.log(np.exp(scores).sum(axis=1) / 5)
    assert found.log_likelihood_ratio == pytest.approx(-4.0 - (each.sum() - 5.0 + math.log(48)))
    assert asked[0][0].tolist() == [-1 if n == 7 else label for n, label in enumerate(labels)]


def test_two_hypotheses_are_one_place_up_to_a_cell(small):
    lab, here = small.two_faces(), Hypothesis(0, 5, 4, 0, 0.0)  # of 11 x 13 cells

    def of(lab=lab, x_mm=0.0, y_mm=0.0, **moved):
        fit = small.fit_of([(0, 0)], [[0.0] * 5], x_mm=x_mm, y_mm=y_mm)
        return verified(small, fit, replace(here, **moved), lab=lab)

    for a, b, near in (
        ((5, 5), (6, 6), True), ((5, 5), (4, 6), True), ((5, 5), (7, 5), False),
        ((5, 5), (3, 5), False), ((5, 5), (5, 7), False), ((5, 5), (5, 3), False),
        ((0, 0), (10, 12), True), ((10, 12), (0, 0), True), ((2, 9), (4, 9), False),
        ((2, 9), (2, 7), False), ((0, 0), (9, 0), False), ((0, 0), (0, 11), False),
    ):  # fmt: skip
        first, other = (of(row=row, column=column) for row, column in (a, b))
        assert first.same_place(other) is near
    one = of()
    assert one.index == (5, 4)
    assert one.same_place(of(row=7, y_mm=8.0))  # (5, 4) is still under the centre
    for other in (of(face=1), of(lab=small.two_faces()), of(x_mm=15.0)):
        assert not one.same_place(other)
    assert one.coincides(of(fit=3, score=-9.0))
    assert one.coincides(of(row=6, y_mm=7.0))
    for other in (of(row=6), of(face=1), of(lab=small.two_faces())):
        assert not one.coincides(other)


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


def square(small, side):
    labels = np.random.default_rng(3).integers(4, size=(side, side))
    held = {(r, c): (0, int(labels[r, c])) for r in range(side) for c in range(side)}
    return small.Lab(held, rows=side + 4, columns=side + 5)


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
        each = np.full(len(fit.cells), pressed)
        for name, value in (("share_of_borders", share), ("_pressed_share", each)):
            monkeypatch.setattr(recognizer.touch.chance, name, lambda *_, value=value: value)
        found = SimpleNamespace(embossed=lab.embossed, fit=fit, hypothesis=place)
        return expected_by_border(arrays or [lab.embossed], found, 1.3)

    return doubt


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("row", "column"), [(3, 4), (0, 4), (1, 0), (4, 2)])
def test_places_are_counted_by_their_outlines(small, by_border, seed, row, column, monkeypatch):
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
