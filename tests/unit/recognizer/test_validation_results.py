"""Results of rows that are written by hand, shards on the disk, extremes, pictures of them."""

from __future__ import annotations

import json
import re
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from recognizer.validation.campaign import Campaign, series_of
from recognizer.validation.command import run
from recognizer.validation.errors import ValidationError
from recognizer.validation.extremes import press_scenes
from recognizer.validation.files import ADDED, columns_of, read_series, shard_file, write_shard
from recognizer.validation.flat_faces import draw_flat
from recognizer.validation.pictures import label_points
from recognizer.validation.pipeline import ValidationResult, bound_from, result_from
from recognizer.validation.results import results_of

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
