"""Intervals, calibration, shares of options, and how touches are drawn and split."""

import math

import numpy as np
import pytest
from scipy.stats import binomtest, chi2

from recognizer.validation.campaign import (
    KIND_NAMES,
    KINDS,
    PRINTED,
    REGISTERED,
    Campaign,
    batches_of,
    kinds_of,
    levels_of,
    plan_of,
    series_of,
    shards_of,
    touchable,
)
from recognizer.validation.compare import BETTER, SAME, WORSE, _share, _size
from recognizer.validation.encoded_set import (
    EXTRA,
    OTHER_LABS,
    is_extra,
    labs_of,
    refuse_without_specs,
)
from recognizer.validation.errors import ValidationError
from recognizer.validation.statistics import (
    calibration,
    chi2_quantile,
    clopper_pearson,
    rms_interval,
    round_digits,
    share_of,
)


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


def test_nothing_counted_says_nothing():
    assert clopper_pearson(0, 0) == (0.0, 1.0)
    assert share_of(0, 0)["share"] is None


@pytest.mark.parametrize("p", [0.01, 0.5, 0.95, 0.999])
def test_chi2_quantile(p):
    assert chi2_quantile(p) == pytest.approx(chi2.ppf(p, 3), rel=1e-9)


def test_an_honest_covariance_is_calibrated_and_a_proud_one_is_not():
    errors = (np.random.default_rng(1).standard_normal((4000, 3)) ** 2).sum(axis=1)
    for line in calibration(errors):
        assert line["low"] - 0.01 < line["expected"] < line["high"] + 0.01
    assert calibration(4 * errors)[2]["share"] < 0.7


def test_rounded_keeps_what_it_must():
    assert round_digits(1234567.0) == 1234570.0
    assert round_digits(-0.0) == 0.0
    assert math.copysign(1, round_digits(-0.0)) == 1
    assert math.isnan(round_digits(math.nan))


def test_shares_are_read_from_options():
    assert kinds_of("face=3, edge") == (("face", 0.75), ("edge", 0.25))
    assert levels_of("mismatch") == (("mismatch", 1.0),)
    assert kinds_of("face=1,edge=0") == (("face", 1.0),)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("faces", "'faces' is not known"),
        ("face,face", "stands twice"),
        ("face=-1", "'-1'"),
        ("face=much", "'much'"),
        ("face=nan", "'nan'"),
        ("face=0", "nothing is left"),
        ("", "nothing is left"),
    ],
)
def test_shares_that_are_none_are_refused(text, said):
    with pytest.raises(ValidationError, match=said):
        kinds_of(text)


def test_kinds_come_in_their_shares_and_from_the_number_alone():
    campaign = Campaign(2000, seed=3)
    (series,) = series_of(campaign)
    drawn = [plan_of(campaign, series, "lab.db", number) for number in range(2000)]
    counts = {kind: sum(k == kind for k, _ in drawn) for kind, _ in KINDS}
    for kind, share in KINDS:
        assert counts[kind] / 2000 == pytest.approx(share, abs=0.04)
    strange = {plan.kind for kind, plan in drawn if kind == "foreign"}
    assert len(strange) >= 5
    assert "blank" not in strange
    assert plan_of(campaign, series, "lab.db", 77) == drawn[77]
    other = Campaign(80, seed=3)
    assert plan_of(other, series_of(other)[0], "lab.db", 77) == drawn[77]


@pytest.mark.parametrize("engine", ["own", "mujoco"])
def test_prints_are_parts_of_the_set(engine):
    campaign = Campaign(surfaces=PRINTED, engine=engine)
    kept = dict(touchable(campaign, named=False).kinds)
    assert sum(kept.values()) == pytest.approx(1.0)
    assert kept["face"] / kept["edge"] == pytest.approx(5.5)
    assert not {"blank", "foreign"} & set(kept)
    with pytest.raises(ValidationError, match="not blank, foreign"):
        touchable(campaign, named=True)
    named = Campaign(surfaces=PRINTED, engine=engine, kinds=(("edge", 1.0),))
    assert touchable(named, named=True) == named


def test_an_engine_touches_everything_by_the_overlays_it_knows():
    for surfaces in ("files", REGISTERED):
        asked = Campaign(surfaces=surfaces, engine="mujoco")
        assert touchable(asked, named=False) == asked
    with pytest.raises(ValidationError, match="mujoco does not know the overlay pad"):
        touchable(Campaign(overlay="pad", engine="mujoco"), named=False)
    assert touchable(Campaign(overlay="pad"), named=True).overlay == "pad"


@pytest.mark.parametrize("touches", [1, 24, 25, 999, 1000, 1001, 2530])
def test_pieces_cover_every_touch_once(touches):
    for series in series_of(Campaign(touches, study=30, shard=70)):
        numbers = [
            n
            for shard in range(shards_of(series))
            for piece in batches_of(series, shard)
            for n in range(piece.first, piece.last)
        ]
        assert numbers == list(range(series.touches))


def test_comparison_calls_chance_chance():
    assert _share("", share_of(990, 1000), share_of(993, 1000))["word"] == SAME
    assert _share("", share_of(900, 1000), share_of(990, 1000))["word"] == BETTER
    assert _share("", share_of(0, 1000), share_of(30, 1000), least=True)["word"] == WORSE
    assert _size("", 0.050, 0.051, (100, 100))["word"] == SAME
    assert _size("", 0.050, 0.100, (100, 100))["word"] == WORSE
    assert _size("", None, 0.1, (0, 10))["word"] == SAME


def test_every_kind_can_be_named():
    assert [name for name, _ in kinds_of(",".join(KIND_NAMES))] == list(KIND_NAMES)


def test_members_of_a_kind_are_not_touched_as_members_of_the_set():
    for kind, name in EXTRA.items():
        assert is_extra(f"{name}-3", kind)
        assert not is_extra(f"{name}-3", "face")
        assert not is_extra("Cube-1", kind)
        assert not any(is_extra(f"{name}-3", other) for other in EXTRA if other != kind)
    assert is_extra("Cube-1", "face")


def test_nothing_is_registered_in_a_database_that_is_only_named():
    refuse_without_specs(["face", "side", "same_profile"])
    with pytest.raises(ValidationError, match="copy, small need objects of their own"):
        refuse_without_specs(["face", "copy", "small"])


def test_other_labs_are_touched_by_their_kind_alone(tmp_path):
    assert labs_of(tmp_path, ["face", "copy"]) == ()
    labs = labs_of(tmp_path, ["same_profile"])
    assert len(set(labs)) == OTHER_LABS
    assert all(lab.startswith(str(tmp_path)) for lab in labs)
