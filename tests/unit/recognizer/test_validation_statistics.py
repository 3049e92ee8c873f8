"""Intervals, calibration, shares of options, and how touches are drawn and split."""

import math

import numpy as np
import pytest
from scipy.stats import binomtest, chi2

from recognizer.validation.campaign import (
    KIND_NAMES,
    KINDS,
    PRINTED,
    Campaign,
    Work,
    campaign_of,
    series_of,
    shares_of,
)
from recognizer.validation.compare import BETTER, SAME, WORSE, compare_shares, compare_sizes
from recognizer.validation.encoded_set import EXTRA, is_extra, refuse_without_specs
from recognizer.validation.errors import ValidationError
from recognizer.validation.statistics import (
    calibration,
    chi2_quantile,
    clopper_pearson,
    normalised_errors,
    rms_interval,
    share_of,
    state_of,
)
from recognizer.validation.workers import workers_of


@pytest.mark.parametrize(("hits", "of"), [(0, 10), (1, 10), (9, 10), (10, 10), (995, 1000), (3, 7)])
def test_interval_of_a_share_is_the_exact_one_of_scipy(hits, of):
    expected = binomtest(hits, of).proportion_ci(0.95, method="exact")
    assert clopper_pearson(hits, of) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_interval_of_a_root_mean_square_by_hand():
    # squares 1, 4, 9: mean 14/3, standard error sqrt(49/3)/sqrt(3) = 2.333, t(2 dof) = 4.3027
    half = 4.302653 * math.sqrt(49 / 3) / math.sqrt(3) / (14 / 3) / 2
    wanted = math.sqrt(14 / 3) * math.exp(-half), math.sqrt(14 / 3) * math.exp(half)
    assert rms_interval(np.array([1.0, -2.0, 3.0])) == pytest.approx(wanted, rel=1e-5)
    assert rms_interval(np.array([0.1])) == (0.0, math.inf)
    assert rms_interval(np.zeros(4)) == (0.0, 0.0)


def test_interval_of_a_root_mean_square_holds_the_true_one_as_often_as_it_says():
    rng = np.random.default_rng(2)
    held = [
        low <= math.sqrt(2) <= high
        for low, high in (
            rms_interval(np.hypot(*rng.standard_normal((2, 100)))) for _ in range(600)
        )
    ]
    assert 0.92 < np.mean(held) < 0.97


@pytest.mark.parametrize("p", [0.01, 0.5, 0.95, 0.999])
def test_chi2_quantile(p):
    assert chi2_quantile(p) == pytest.approx(chi2.ppf(p, 3), rel=1e-9)


def test_an_honest_covariance_is_calibrated_and_a_proud_one_is_not():
    errors = (np.random.default_rng(1).standard_normal((4000, 3)) ** 2).sum(axis=1)
    for line in calibration(errors):
        assert line["low"] - 0.01 < line["expected"] < line["high"] + 0.01
    assert calibration(4 * errors)[2]["share"] < 0.7
    honest, proud = normalised_errors(errors), normalised_errors(4 * errors)
    assert honest["low"] < 1 < honest["high"]
    assert (honest["median"], honest["q95"]) == pytest.approx((0.789, 2.605), rel=0.05)
    assert proud["mean"] == pytest.approx(4 * honest["mean"], rel=1e-5)
    none = normalised_errors(errors[:0])
    assert (none["of"], none["mean"], none["high"]) == (0, None, None)


@pytest.mark.parametrize(
    ("low", "high", "sign", "bounds", "state"),
    [
        (0.91, 0.97, "within", (0.90, 0.98), "holds"),
        (0.89, 0.97, "within", (0.90, 0.98), "too few touches to tell"),
        (0.981, 0.999, "within", (0.90, 0.98), "fails"),
        (0.0, None, "<=", (0.1,), "too few touches to tell"),
        (0.11, None, "<=", (0.1,), "fails"),
        (0.02, 0.1, "<=", (0.1,), "holds"),
        (0.95, 1.0, ">=", (0.95,), "holds"),
    ],
)
def test_bounds_are_judged_by_the_whole_interval(low, high, sign, bounds, state):
    assert state_of({"of": 9, "low": low, "high": high}, sign, *bounds) == state


def test_comparison_calls_chance_chance():
    for a, b, least, word in ((990, 993, False, SAME), (900, 990, False, BETTER),
                              (0, 30, True, WORSE)):  # fmt: skip
        found = compare_shares("", share_of(a, 1000), share_of(b, 1000), least=least)
        assert found["word"] == word
    assert compare_sizes("", 0.050, 0.051, (100, 100))["word"] == SAME
    assert compare_sizes("", 0.050, 0.100, (100, 100))["word"] == WORSE
    assert compare_sizes("", None, 0.1, (0, 10))["word"] == SAME


@pytest.mark.parametrize(
    ("text", "shares"),
    [
        ("face=3, edge", (("face", 0.75), ("edge", 0.25))),
        ("face=1,edge=0", (("face", 1.0),)),
        ("face,face", "stands twice"),
        ("face=-1", "'-1'"),
        ("face=nan", "'nan'"),
        ("face=0", "nothing is left"),
    ],
)
def test_shares_are_read_from_options(text, shares):
    if isinstance(shares, tuple):
        assert shares_of(text, KIND_NAMES, "--kinds") == shares
    else:
        with pytest.raises(ValidationError, match=shares):
            shares_of(text, KIND_NAMES, "--kinds")


def test_kinds_come_in_their_shares_and_from_the_number_alone():
    work = Work(Campaign(2000, seed=3), "lab.db")
    (series,) = series_of(work.campaign)
    drawn = [work.plan(series, number) for number in range(2000)]
    for kind, share in KINDS:
        count = sum(plan.counted_as == kind for plan in drawn)
        assert count / 2000 == pytest.approx(share, abs=0.04)
    strange = {plan.kind for plan in drawn if plan.counted_as == "foreign"}
    assert len(strange) >= 5
    assert "blank" not in strange
    other = Work(Campaign(80, seed=3), "lab.db")
    assert other.plan(series_of(other.campaign)[0], 77) == drawn[77]
    assert [campaign_of({"touches": n}, None).study for n in (199, 200)] == [0, 200]


def test_prints_are_parts_of_the_set():
    kept = dict(campaign_of({"surfaces": PRINTED}, None).kinds)
    assert sum(kept.values()) == pytest.approx(1.0)
    assert kept["face"] / kept["edge"] == pytest.approx(5.5)
    assert not {"blank", "foreign"} & set(kept)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"surfaces": PRINTED, "kinds": "face,blank,foreign"}, "not blank, foreign"),
        ({"engine": "mujoco", "overlay": "pad"}, "mujoco does not know the overlay pad"),
        ({"touches": 0}, "--touches: 0; give a whole number of 1"),
        ({"touches": "10"}, "--touches: '10'"),
        ({"shard": 1.5}, "--shard: 1.5"),
        ({"study": -1}, "--study: -1; give a whole number of 0"),
    ],
)
def test_what_cannot_be_touched_is_refused(asked, said):
    with pytest.raises(ValidationError, match=said):
        campaign_of(asked, None)
    for wrong in (0, 1.5):
        with pytest.raises(ValidationError, match=f"{wrong}") as refused:
            workers_of(wrong)
        assert refused.value.fix == "give a whole number of 1 or more"
    with pytest.raises(ValidationError, match="copy, small need objects of their own"):
        refuse_without_specs(["face", "copy", "small"])


@pytest.mark.parametrize("touches", [1, 24, 25, 999, 1000, 1001, 2530])
def test_batches_cover_every_touch_once(touches):
    for series in series_of(Campaign(touches, study=30, shard=70)):
        numbers = [
            n
            for shard in range(series.shards)
            for batch in series.batches(shard)
            for n in range(batch.first, batch.last)
        ]
        assert numbers == list(range(series.touches))


def test_members_of_a_kind_are_touched_by_their_kind_alone():
    names = {"Cube-1": "face"} | {f"{name}-3": kind for kind, name in EXTRA.items()}
    for name, own in names.items():
        assert [kind for kind in ("face", *EXTRA) if is_extra(name, kind)] == [own]
