"""Results of rows written by hand: statistics, shards on the disk, extremes, pictures."""

from __future__ import annotations

import json
import math
import re
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
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
from recognizer.validation.command import run
from recognizer.validation.compare import BETTER, SAME, WORSE, compare_shares, compare_sizes
from recognizer.validation.encoded_set import EXTRA, is_extra, refuse_without_specs
from recognizer.validation.errors import ValidationError
from recognizer.validation.extremes import press_scenes
from recognizer.validation.files import ADDED, columns_of, read_series, shard_file, write_shard
from recognizer.validation.flat_faces import draw_flat
from recognizer.validation.pictures import label_points
from recognizer.validation.pipeline import ValidationResult, bound_from, result_from
from recognizer.validation.results import results_of
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

NAN = float("nan")
UNTOLD = "too few touches to tell"


def row(number, verdict="right", **changed):
    right = verdict == "right"
    plain = {
        "number": number, "kind": "face", "surface": "face", "level": "mismatch",
        "object": "Cube", "face": "F1", "x_mm": 1.0, "y_mm": 2.0, "theta_deg": 30.0,
        "force_n": 50.0, "tilt_deg": 1.0, "edge_mm": 12.0, "symbols": 12, "enough": True,
        "verdict": verdict, "reason": "ambiguous" if verdict == "rejected" else "",
        "answer": {"right": "Cube/F1", "wrong": "Box-2/F2", "rejected": ""}[verdict],
        "error_mm": 0.05 if right else NAN, "error_deg": -0.2 if right else NAN,
        "chi2": 2.0 if right else NAN, "margin": 30.0, "noise": 0.1,
        "drawn_anew": "",
    }  # fmt: skip
    return plain | changed


def foreign(number, verdict="rejected", kind="blank", **changed):
    plain = {"kind": kind, "surface": kind, "object": "", "face": "", "enough": False}
    return row(number, verdict, **plain | {"symbols": 0, "edge_mm": NAN} | changed)


def write(folder, rows):
    """Write rows as a run does."""
    series = series_of(Campaign(len(rows)))[0]
    spent = [{"number": one["number"], "drawing": 0.1, "reading": 0.2} for one in rows]
    write_shard(folder, series.name, 0, rows, spent)
    return series


@pytest.fixture
def columns(tmp_path):
    """Write rows and read them."""

    def written(rows):
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        return columns_of(read_series(folder, write(folder, rows)))

    return written


def test_touches_until_answered_are_counted_by_kind(columns):
    made = [("right", 1), ("right", 2), ("right", 2), ("right", 3), ("rejected", 3), ("wrong", 2)]
    rows = [row(i, verdict, touches=n) for i, (verdict, n) in enumerate(made)]
    rows += [row(6, kind="edge", touches=2), foreign(7, touches=3)]
    held, asked = columns(rows), Campaign(policy="next").as_json()
    found = {line["kind"]: line for line in results_of(held, asked)["policy"]}
    for kind, of, counts in (("all faces", 7, [1, 4, 5]), ("face", 6, [1, 3, 4]),
                             ("edge", 1, [0, 1, 1])):  # fmt: skip
        assert [share["count"] for share in found[kind]["within"]] == counts
        assert {share["of"] for share in found[kind]["within"]} == {of}
    assert found["face"]["wrong"] == 1
    assert found["face"]["made"] == pytest.approx(13 / 6, abs=1e-4)
    assert "policy" not in results_of(held)


def test_counts_confusion_and_worst(columns, tmp_path):
    rows = [row(i) for i in range(6)]
    rows += [
        row(6, "wrong"),
        row(7, "rejected", drawn_anew="slipped off | no rest"),
        row(8, object="Box-2", face="F2", answer="Box-2/F2", error_mm=0.4, level="low"),
        foreign(9, "wrong", kind="foreign", surface="dots"),
        row(10, "rejected", object="Box-10", face="F10", enough=False),
        row(11, "rejected", object="Box-10", face="F9", enough=False),
    ]
    found = results_of(columns(rows))
    totals = found["totals"]
    assert [totals[n] for n in ("touches", "right", "wrong", "rejected")] == [12, 7, 2, 3]
    assert totals["rms_mm"] == pytest.approx(np.sqrt((6 * 0.05**2 + 0.4**2) / 7), rel=1e-5)
    assert (found["enough"]["touches"], totals["expected"]["count"]) == (9, 8)
    assert totals["drawn_anew"] == 2
    objects = found["objects"]
    assert objects["names"] == ["Box-2", "Box-10", "Cube"]  # by number, as are their faces
    assert [line["face"] for line in objects["faces"]] == ["F2", "F9", "F10", "F1"]
    assert objects["matrix"] == [[1, 0, 0, 0], [0, 0, 0, 2], [1, 0, 6, 1]]
    assert objects["confused"] == [
        {"touched": touched, "answered": "Box-2/F2", "count": 1} for touched in ("Cube/F1", "dots")
    ]
    assert [line["number"] for line in found["worst"][:3]] == [6, 9, 7]
    assert found["reasons"] == {"ambiguous": 3}
    states = [line["state"] for line in found["verdict"]]
    assert states == ["fails", UNTOLD, "holds", "holds", UNTOLD]
    bounds = [str(bound_from(line)) for line in found["verdict"]]
    assert bounds[2].endswith("mismatch: 0.050 mm (0.050 ... 0.050), bound <= 0.1 mm")
    assert bounds[4].endswith("(59.038% ... 100.000%), bound within 90.0% ... 98.0%")
    result = result_from(found, 1.25, tmp_path)
    assert (result.holds, result.fair, result.fair_right) == (False, 9, 7)
    assert str(result).startswith("12 touches: 7 right, 2 wrong, 3 refused; pose 0.15")
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize(
    ("of", "missed", "state"),
    [(20, 0, UNTOLD), (800, 0, "holds"), (800, 10, "fails"), (24, 1, UNTOLD), (24, 3, "fails")],
)
def test_a_bound_is_told_by_enough_touches_alone(columns, of, missed, state):
    # the exact interval of n of n begins at .025 ** (1 / n): .995 takes 736 touches
    found = results_of(columns([row(i, "rejected" if i < missed else "right") for i in range(of)]))
    lines = [*(found[part][0] for part in ("kinds", "worlds", "levels"))]
    assert found["verdict"][1]["state"] == state
    assert {line["state"] for line in [*lines, *found["objects"]["faces"]]} == {state}


@pytest.mark.parametrize(
    ("of", "factor", "state"), [(200, 1, UNTOLD), (20, 1, UNTOLD), (200, 2, "fails")]
)
def test_a_bound_of_errors_is_judged_by_their_interval(columns, of, factor, state):
    errors = np.hypot(*np.random.default_rng(1).normal(0, 0.075, (2, 200)))  # .106 mm rms
    rows = [row(i, error_mm=factor * error) for i, error in enumerate(errors[:of])]
    place = results_of(columns(rows))["verdict"][2]
    assert (place["low"] < 0.1 < place["high"]) == (state == UNTOLD)
    assert place["state"] == state


def test_a_face_is_bad_where_a_bound_fails_or_hardly_a_touch_is_answered(columns):
    few = [row(i, "rejected" if i else "right", enough=False, kind="edge") for i in range(12)]
    none = [row(i, "rejected", enough=False, kind="worn") for i in range(12)]
    good = [row(i) for i in range(12)]
    wrong = [*good[:-1], row(11, "wrong")]
    assert [
        results_of(columns(rows))["objects"]["faces"][0]["bad"] for rows in (few, none, good, wrong)
    ] == [True, False, False, True]


def test_touches_of_a_version_that_counted_less_are_read_and_others_refused(tmp_path):
    series = write(tmp_path, [row(0), row(1)])
    file = shard_file(tmp_path, series.name, 0)
    whole = pq.read_table(file)
    for name in ADDED:
        pq.write_table(whole.drop_columns([name]), file)
        assert read_series(tmp_path, series).column(name).to_pylist() == [None, None]
    pq.write_table(whole.drop_columns(["edge_mm"]), file)
    with pytest.raises(ValidationError, match="another version: they lack edge_mm"):
        read_series(tmp_path, series)


@pytest.mark.parametrize(
    ("wrong", "fair_right", "fail_under", "code"),
    [(0, 49, None, 0), (0, 49, 98.0, 0), (0, 49, 98.5, 1), (1, 50, 10.0, 1)],
)
def test_fail_under(wrong, fair_right, fail_under, code):
    counts = 100, 98 - wrong, wrong, 2
    found = ValidationResult(*counts, 0.1, 0.1, 1.0, 50, fair_right, (), Path("x"))
    assert found.exit_code(fail_under) == code


@pytest.mark.parametrize("library", ["pyarrow", "matplotlib", "jinja2"])
def test_what_a_plain_install_lacks_is_said_in_one_line(library, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, library, None)
    assert run(["--touches", "5", "-o", "nowhere"]) == 2
    said = capsys.readouterr().err
    assert f"validate-set needs {library}" in said
    assert "pip install 'encoded-objects[report]'" in said
    assert not Path("nowhere").exists()


def test_stiff_and_extreme_scenes_are_finite_or_refused():
    lines = list(press_scenes())
    assert {line["outcome"] for line in lines} == {"finite", "refused"}
    failed = [line["case"] for line in lines if not line["passes"]]
    assert set(failed) <= {"place that is no number"}


def test_names_of_crowded_points_do_not_overlap():
    rng = np.random.default_rng(1)
    figure = Figure(figsize=(5.5, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    places = rng.normal(0, 1, (14, 2)).tolist()
    points = [(x, y, f"more of {k}") for k, (x, y) in enumerate(places)]
    points += [(0.0, 0.0, "one"), (0.0, 0.0, "its double"), (np.nan, 1.0, "no number")]
    axes.plot(*zip(*[point[:2] for point in points], strict=True), "o")
    axes.margins(0.3)
    texts = label_points(axes, points)
    assert {text.get_text() for text in texts} == {name for *_, name in points} - {"no number"}
    figure.draw_without_rendering()
    boxes, frame = [text.get_window_extent() for text in texts], axes.get_window_extent()
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    assert all(frame.padded(1).containsx(x) for box in boxes for x in box.intervalx)
    assert all(frame.padded(1).containsy(y) for box in boxes for y in box.intervaly)


def drawn(**touches):
    """A face of 40 x 40 mm with touches by their verdicts, at 2 px a mm."""
    by = {verdict: np.array(at, float).reshape(-1, 2) for verdict, at in touches.items()}
    corners = np.array([[0, 0], [40, 0], [40, 40], [0, 40]], float)
    return draw_flat((corners,), np.array([[20.0, 20.0]]), by, 2.0)


def test_a_face_drawn_flat_has_a_dot_for_each_touch_where_it_was():
    svg = drawn(right=[(10, 30)], rejected=[(0, 0), (40, 40)])
    dots = re.findall(r'd="((?:M[\d.]+ [\d.]+h.01)+)" fill="none" stroke="(#\w+)"', svg)
    at = {colour: re.findall(r"M([\d.]+) ([\d.]+)", path) for path, colour in dots}
    assert at["#c9ced6"] == [("40.0", "40.0")]
    assert at["#2a7f62"] == [("20.0", "20.0")]  # y up
    assert at["#d98c00"] == [("0.0", "80.0"), ("80.0", "0.0")]


def test_many_right_touches_are_thinned_and_no_refused_one():
    many = np.random.default_rng(1).uniform(0, 40, (2000, 2))
    svg = drawn(right=many, rejected=many[:400])
    assert svg.count("h.01") == 1 + 150 + 400


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
    draws = (np.hypot(*rng.standard_normal((2, 100))) for _ in range(600))
    held = [low <= math.sqrt(2) <= high for low, high in map(rms_interval, draws)]
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
        batches = [one for shard in range(series.shards) for one in series.batches(shard)]
        numbers = [n for one in batches for n in range(one.first, one.last)]
        assert numbers == list(range(series.touches))


def test_members_of_a_kind_are_touched_by_their_kind_alone():
    names = {"Cube-1": "face"} | {f"{name}-3": kind for kind, name in EXTRA.items()}
    for name, own in names.items():
        assert [kind for kind in ("face", *EXTRA) if is_extra(name, kind)] == [own]
