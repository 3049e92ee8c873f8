"""Whether a place is an answer, and why not: each bound from both sides."""

import math
from dataclasses import replace

import pytest

from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, NOT_ENCODED, TOO_FEW
from recognizer.touch.verdict import (
    CONTRADICTION,
    STRONG_CONTRADICTION,
    Evidence,
    is_encoded,
    least_explained,
    may_count_border,
    reject_chance,
    reject_few,
    reject_joined,
    reject_margin,
    reject_reason,
)

LIMITS = ReaderOptions()
GOOD = Evidence(log_likelihood_ratio=20.0, explained=0.9, inliers=12, contradictions=0)
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
        # 72 % where fewer than 11 cells agree, 58 % where more do
        ({"inliers": 10, "explained": 0.72}, True),
        ({"inliers": 10, "explained": 0.719}, False),
        ({"inliers": 11, "explained": 0.58}, True),
        ({"inliers": 11, "explained": 0.579}, False),
        ({"inliers": 0, "explained": 0.72}, True),  # too few symbols is another reason
        # one cell may speak clearly for another symbol, none plainly
        ({"contradictions": 1}, True),
        ({"contradictions": 2}, False),
        ({"contradictions": 1, "strong_contradictions": 1}, False),
    ],
)
def test_each_bound_of_belief_from_both_sides(changed, believed):
    assert is_encoded(replace(GOOD, **changed)) is believed


@pytest.mark.parametrize(
    ("changed", "margin", "reason"),
    [
        ({}, TEN, ""), ({}, 9.99, AMBIGUOUS), ({}, math.inf, ""),
        ({"inliers": 4}, TEN, ""), ({"inliers": 3}, TEN, TOO_FEW),
        # the first condition that fails is the reason
        ({"log_likelihood_ratio": 2.99}, 9.0, NOT_ENCODED),
        ({"log_likelihood_ratio": 2.99, "inliers": 2}, 9.0, NOT_ENCODED),
        ({"inliers": 3}, 9.0, TOO_FEW),
        # of a scan: half of the touches are too few
        ({"touches": 4, "agreeing": 3}, TEN, ""), ({"touches": 4, "agreeing": 2}, TEN, TOO_FEW),
        ({"touches": 4, "agreeing": 2, "contradictions": 2}, TEN, NOT_ENCODED),
    ],
)  # fmt: skip
def test_each_reason_in_its_order(changed, margin, reason):
    assert reject_reason(replace(GOOD, **changed), margin, LIMITS) == reason


def test_the_bounds_are_those_that_are_given():
    strict = ReaderOptions(margin=12.0, margin_by_few=16.0, least_inliers=6)
    few = replace(GOOD, inliers=6)
    assert [reject_reason(few, margin, strict) for margin in (12.0, 11.9)] == ["", AMBIGUOUS]
    assert reject_reason(replace(few, inliers=5), 12.0, strict) == TOO_FEW
    assert [reject_few(few, margin, 1.0, strict) for margin in (16.0, 15.9)] == ["", AMBIGUOUS]
    assert [may_count_border(few, margin, strict) for margin in (16.0, 15.9)] == [True, False]


@pytest.mark.parametrize(
    ("ratio", "best", "reason"),
    [(8.0, 8.0, ""), (7.9, 8.0, TOO_FEW), (2.9, 8.0, NOT_ENCODED), (2.9, 7.9, TOO_FEW)],
)
def test_more_nats_may_be_asked_for(ratio, best, reason):
    found = replace(GOOD, log_likelihood_ratio=ratio, best_ratio=best)
    assert reject_reason(found, TEN, LIMITS, least_ratio=8.0) == reason


@pytest.mark.parametrize(("wrong", "reason"), [(3, ""), (4, NOT_ENCODED)])
def test_of_many_cells_a_share_may_contradict(wrong, reason):
    found = replace(GOOD, inliers=60, contradictions=wrong)
    assert reject_reason(found, TEN, LIMITS, wrong_share=0.05) == reason
    assert reject_reason(found, TEN, LIMITS) == NOT_ENCODED


@pytest.mark.parametrize(
    ("inliers", "margin", "matches", "reason"),
    [
        (10, FOURTEEN, 1.0, ""), (10, 13.99, 1.0, AMBIGUOUS), (10, FOURTEEN, 1.01, TOO_FEW),
        (10, 13.99, 1.01, TOO_FEW), (11, 10.0, 1.01, ""),
    ],
)  # fmt: skip
def test_few_symbols_name_a_place_and_leave_others_behind(inliers, margin, matches, reason):
    assert reject_few(replace(GOOD, inliers=inliers), margin, matches, LIMITS) == reason


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


def test_limits_of_margins_are_reached_but_for_rounding():
    assert (TEN, FOURTEEN) == (10.0 - 1e-4, 14.0 - 1e-4)


def test_one_touch_alone_is_one_that_agrees():
    few = replace(GOOD, touches=2)
    assert reject_reason(few, TEN, LIMITS) == TOO_FEW  # one of two: no more than half
    assert reject_reason(replace(few, agreeing=2), TEN, LIMITS) == ""
    assert reject_reason(replace(GOOD, agreeing=0), TEN, LIMITS) == ""
    assert [reject_margin(margin, 3.0) for margin in (3.0, 2.99)] == ["", AMBIGUOUS]


def test_evidence_of_cells_alone_is_that_of_an_image_without_fault():
    """As a scan has it; cells contradict by 8 nats, strongly by 16."""
    assert Evidence(20.0, 12, 0) == Evidence(20.0, 12, 0, 0, 0, 1.0, 0.0, math.inf, 1, 1)
    assert (CONTRADICTION, STRONG_CONTRADICTION) == (8.0, 16.0)


def test_chance_and_what_an_image_must_explain():
    assert (reject_chance(1e-4, 1e-4), reject_chance(1.01e-4, 1e-4)) == ("", BY_CHANCE)
    assert (least_explained(10), least_explained(11)) == (0.72, 0.58)


@pytest.mark.parametrize(
    ("changed", "margin", "counts"),
    [
        ({}, FOURTEEN, True), ({}, 13.9, False), ({"worn": 1}, 40.0, True),
        ({"worn": 2}, 40.0, False), ({"contradictions": 1}, 40.0, False),
    ],
)  # fmt: skip
def test_the_border_counts_for_a_place_that_lacks_only_symbols(changed, margin, counts):
    assert may_count_border(replace(GOOD, **changed), margin, LIMITS) is counts
