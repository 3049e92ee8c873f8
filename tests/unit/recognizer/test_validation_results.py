"""Results of rows that are written by hand, shards on the disk, and the table of extremes."""

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from recognizer.validation.campaign import Campaign, series_of
from recognizer.validation.command import run
from recognizer.validation.errors import ValidationError
from recognizer.validation.extremes import press_scenes
from recognizer.validation.files import (
    ADDED,
    columns_of,
    done_shards,
    read_series,
    row_schema,
    shard_file,
    write_shard,
)
from recognizer.validation.result import ValidationResult, bound_from, result_from
from recognizer.validation.results import line_of, results_of, world_times
from recognizer.validation.trial import CpuTime

NAN = float("nan")


def row(number, verdict="right", **changed):
    right = verdict == "right"
    plain = {
        "number": number,
        "kind": "face",
        "surface": "face",
        "level": "mismatch",
        "object": "Cube",
        "face": "F1",
        "x_mm": 1.0,
        "y_mm": 2.0,
        "theta_deg": 30.0,
        "force_n": 50.0,
        "tilt_deg": 1.0,
        "edge_mm": 12.0,
        "symbols": 12,
        "enough": True,
        "verdict": verdict,
        "reason": "ambiguous" if verdict == "rejected" else "",
        "answer": {"right": "Cube/F1", "wrong": "Box/F2", "rejected": ""}[verdict],
        "error_mm": 0.05 if right else NAN,
        "error_deg": -0.2 if right else NAN,
        "chi2": 2.0 if right else NAN,
        "margin": 30.0,
        "noise": 0.1,
    }
    return plain | changed


def columns(rows, tmp_path):
    series = series_of(Campaign(len(rows)))[0]
    write_shard(tmp_path, series.name, 0, rows, [CpuTime(r["number"], 0.1, 0.2) for r in rows])
    return columns_of(read_series(tmp_path, series))


def test_touches_until_answered_are_counted_by_kind(tmp_path):
    made = [("right", 1), ("right", 2), ("right", 2), ("right", 3), ("rejected", 3), ("wrong", 2)]
    rows = [row(i, verdict, touches=n) for i, (verdict, n) in enumerate(made)]
    rows += [row(6, kind="edge", touches=2), foreign(7, touches=3)]
    held, asked = columns(rows, tmp_path), asdict(Campaign(policy="next"))
    found = {line["kind"]: line for line in results_of(held, asked)["policy"]}
    assert [share["count"] for share in found["all faces"]["within"]] == [1, 4, 5]
    assert [share["of"] for share in found["all faces"]["within"]] == [7, 7, 7]
    assert [share["count"] for share in found["face"]["within"]] == [1, 3, 4]
    assert [share["count"] for share in found["edge"]["within"]] == [0, 1, 1]
    assert found["face"]["wrong"] == 1
    assert found["face"]["made"] == pytest.approx(13 / 6, abs=1e-4)
    assert "policy" not in results_of(held)


def test_counts_confusion_and_worst(tmp_path):
    rows = [row(i) for i in range(6)]
    rows += [
        row(6, "wrong"),
        row(7, "rejected"),
        row(8, "right", object="Box", face="F2", answer="Box/F2", error_mm=0.4, level="low"),
        row(9, "rejected", kind="foreign", surface="dots", object="", face="", enough=False,
            symbols=0, edge_mm=NAN),
    ]  # fmt: skip
    found = results_of(columns(rows, tmp_path))
    totals = found["totals"]
    assert [totals[n] for n in ("touches", "right", "wrong", "rejected")] == [10, 7, 1, 2]
    assert totals["rms_mm"] == pytest.approx(np.sqrt((6 * 0.05**2 + 0.4**2) / 7), rel=1e-5)
    assert found["enough"]["touches"] == 9
    assert found["objects"]["names"] == ["Box", "Cube"]
    assert found["objects"]["matrix"] == [[1, 0, 0], [1, 6, 1]]
    assert found["objects"]["confused"] == [
        {"touched": "Cube/F1", "answered": "Box/F2", "count": 1}
    ]
    assert [line["number"] for line in found["worst"][:3]] == [6, 7, 8]
    assert found["reasons"] == {"ambiguous": 2}
    wrong, answered, place, turn, inside = found["verdict"]
    assert not wrong["holds"]
    assert not answered["holds"]
    assert place["value"] == pytest.approx(0.05)
    assert place["holds"]
    assert turn["holds"]
    assert inside["state"] == "too few touches to tell"
    assert [str(bound_from(line)) for line in found["verdict"]] == [
        "wrong answers, all touches: 1 of 10, 10.000% (0.253% ... 44.502%), bound = 0.0%",
        (
            "answered, of touches that show enough symbols: 8 of 9, 88.889% "
            "(51.750% ... 99.719%), bound >= 99.5%"
        ),
        "pose, rms, under strong mismatch: 0.050 mm (0.050 ... 0.050), bound <= 0.1 mm",
        "turn, rms, under strong mismatch: 0.200 degrees (0.200 ... 0.200), bound <= 0.3 degrees",
        (
            "right answers inside their own 95 % ellipsoid: 7 of 7, 100.000% "
            "(59.038% ... 100.000%), bound within 90.0% ... 98.0%"
        ),
    ]
    result = result_from(found, 1.25, tmp_path)
    assert (result.holds, result.fair, result.fair_right) == (False, 9, 7)
    assert str(result).startswith("10 touches: 7 right, 1 wrong, 2 rejected; pose 0.15")
    assert str(result).count("\n  fails: ") == 1
    assert result.as_json()["folder"] == str(tmp_path)
    json.dumps(found, allow_nan=False)


def test_a_bound_is_told_by_enough_touches_alone(tmp_path):
    few = results_of(columns([row(i) for i in range(20)], tmp_path / "few"))
    many = results_of(columns([row(i) for i in range(800)], tmp_path / "many"))
    most = [row(i) for i in range(790)] + [row(i, "rejected") for i in range(790, 800)]
    below = results_of(columns(most, tmp_path / "below"))
    # the exact interval of n of n begins at .025 ** (1 / n): .995 takes 736 touches
    assert [found["verdict"][1]["state"] for found in (few, many, below)] == [
        "too few touches to tell", "holds", "fails",
    ]  # fmt: skip
    assert not few["verdict"][1]["holds"]


def foreign(number, verdict="rejected", kind="blank", **changed):
    plain = {"kind": kind, "surface": kind, "object": "", "face": "", "enough": False}
    return row(number, verdict, **plain | {"symbols": 0, "edge_mm": NAN} | changed)


def test_worlds_are_touches_of_faces_by_sensor_and_what_nobody_knows_by_kind(tmp_path):
    rows = [
        row(0, level="low"),
        row(1, "rejected", level="low"),
        row(2, level="mismatch", kind="edge", chi2=1.0),
        row(3, level="mismatch", kind="corner", chi2=9.0),
        row(4, level="half dead", kind="two parts"),  # a level and a kind of tomorrow
        foreign(5, level="low"),
        foreign(6, "wrong", kind="same_profile"),
    ]
    found = results_of(columns(rows, tmp_path))
    low, mismatch, dead, blank, other = found["worlds"]
    assert [line["engine"] for line in found["worlds"]] == ["own"] * 5
    assert (low["surface"], low["sensor"]) == ("written files", "low")
    assert (low["touches"], low["right"], low["rejected"]) == (2, 1, 1)
    assert (mismatch["touches"], mismatch["right"]) == (2, 2)
    assert mismatch["inside_95"]["count"] == 1  # of the chi2 with 3 degrees of freedom: 7.81
    assert (dead["sensor"], dead["touches"]) == ("half dead", 1)
    assert (blank["surface"], blank["sensor"], blank["registered"]) == (
        "blank",
        "all of them",
        False,
    )
    assert (other["surface"], other["wrong"], other["states"]["expected"]) == (
        "same_profile", 1, "fails",
    )  # fmt: skip
    assert [line["kind"] for line in found["kinds"]] == [
        "face", "edge", "corner", "blank", "same_profile", "two parts",
    ]  # fmt: skip


def test_times_of_worlds_stand_in_their_order(tmp_path):
    rows = columns([row(0), row(1), row(2, level="low"), foreign(3)], tmp_path)
    spent = {"drawing": np.array([1e-3, 3e-3, 5e-3, 7e-3]), "reading": np.array([1, 1, 2, 4]) / 100}
    assert world_times(rows, spent, asdict(Campaign())) == [
        {"drawing": 5.0, "reading": 20.0},
        {"drawing": 2.0, "reading": 10.0},
        {"drawing": 7.0, "reading": 40.0},
    ]


def line(rows, tmp_path):
    held = columns(rows, tmp_path)
    return line_of(held, np.ones(len(rows), bool))


def test_lines_by_face_kind_and_level_fail_only_where_the_interval_does(tmp_path):
    missed = {"one of 24": 1, "three of 24": 3, "none of 24": 0}
    states = {}
    for name, count in missed.items():
        rows = [row(i, "rejected" if i < count else "right") for i in range(24)]
        found = results_of(columns(rows, tmp_path / name))
        lines = [found[part][0] for part in ("kinds", "worlds", "levels")]
        states[name] = {line["state"] for line in [*lines, *found["objects"]["faces"]]}
    # exact: 23 of 24 reaches 99.9 %, 21 of 24 only 97.3 %
    assert states == {
        "one of 24": {"too few touches to tell"},
        "three of 24": {"fails"},
        "none of 24": {"too few touches to tell"},
    }
    assert line([foreign(0)], tmp_path / "nobody")["state"] == ""
    assert line([row(0), row(1, "wrong")], tmp_path / "wrong")["state"] == "fails"


def test_a_face_is_bad_where_a_bound_fails_or_hardly_a_touch_is_answered(tmp_path):
    few = [row(i, "rejected" if i else "right", enough=False, kind="edge") for i in range(12)]
    none = [row(i, "rejected", enough=False, kind="worn") for i in range(12)]
    good = [row(i) for i in range(12)]
    wrong = [*good[:-1], row(11, "wrong")]
    assert [
        results_of(columns(rows, tmp_path / str(k)))["objects"]["faces"][0]["bad"]
        for k, rows in enumerate((few, none, good, wrong))
    ] == [True, False, False, True]


def test_errors_have_intervals_and_few_of_them_tell_nothing(tmp_path):
    one = line([row(0, error_mm=0.2)], tmp_path / "one")
    assert (one["rms_mm"], one["rms_mm_95"]) == (0.2, [0.0, None])
    rng = np.random.default_rng(1)
    errors = np.hypot(*rng.normal(0, 0.075, (2, 200)))  # .106 mm rms, bound .1
    for of, state in ((200, "too few touches to tell"), (20, "too few touches to tell")):
        rows = [row(i, error_mm=error) for i, error in enumerate(errors[:of])]
        place = results_of(columns(rows, tmp_path / str(of)))["verdict"][2]
        assert place["low"] < 0.1 < place["high"]
        assert place["state"] == state
    far = [row(i, error_mm=2 * error) for i, error in enumerate(errors)]
    assert results_of(columns(far, tmp_path / "far"))["verdict"][2]["state"] == "fails"


def test_touches_drawn_anew_are_counted_where_somebody_did(tmp_path):
    held = columns([row(i) for i in range(3)], tmp_path)
    everything = np.ones(3, bool)
    told = np.array(["", "slipped off | no rest", "no rest"], object)
    assert line_of(held | {"drawn_anew": told}, everything)["drawn_anew"] == 3
    assert line_of(held | {"drawn_anew": told}, np.array([True, False, True]))["drawn_anew"] == 1
    unknown = np.array([None, None, None], object)
    assert line_of(held | {"drawn_anew": unknown}, everything)["drawn_anew"] is None
    held.pop("drawn_anew", None)
    assert line_of(held, everything)["drawn_anew"] is None


def test_a_wrong_answer_on_a_foreign_surface_is_named(tmp_path):
    strange = row(1, "wrong", kind="foreign", surface="dots", object="", face="", enough=False)
    found = results_of(columns([row(0), strange], tmp_path))
    assert found["objects"]["confused"] == [{"touched": "dots", "answered": "Box/F2", "count": 1}]
    assert found["totals"]["wrong"] == 1


def test_copies_stand_in_the_order_of_their_numbers(tmp_path):
    copies = [("Box-10", "F2"), ("Box-2", "F10"), ("Box-2", "F9"), ("Box-1", "F1")]
    rows = [row(i, object=name, face=face) for i, (name, face) in enumerate(copies)]
    found = results_of(columns(rows, tmp_path))["objects"]
    assert found["names"] == ["Box-1", "Box-2", "Box-10"]
    faces = [(line["object"], line["face"]) for line in found["faces"]]
    assert faces == [("Box-1", "F1"), ("Box-2", "F9"), ("Box-2", "F10"), ("Box-10", "F2")]


def test_touches_of_nothing_but_foreign_surfaces(tmp_path):
    rows = [
        row(i, "rejected", kind="blank", surface="blank", object="", face="", enough=False,
            symbols=0, margin=NAN)
        for i in range(3)
    ]  # fmt: skip
    found = results_of(columns(rows, tmp_path))
    assert found["enough"]["answered"]["share"] is None
    json.dumps(found, allow_nan=False)


def test_a_shard_is_there_when_it_is_whole(tmp_path):
    series = series_of(Campaign(5, shard=3))[0]
    write_shard(tmp_path, series.name, 1, [row(4), row(3)], [CpuTime(4, 1, 1), CpuTime(3, 1, 1)])
    assert done_shards(tmp_path, series) == {1}
    table = pq.read_table(shard_file(tmp_path, series.name, 1))
    assert table.schema.equals(row_schema())
    assert table.column("number").to_pylist() == [3, 4]
    assert not [path for path in tmp_path.rglob("*") if path.suffix == ".writing"]


def test_touches_of_a_version_that_counted_less_are_read_and_others_refused(tmp_path):
    series = series_of(Campaign(2))[0]
    write_shard(tmp_path, series.name, 0, [row(0), row(1)], [CpuTime(k, 1, 1) for k in (0, 1)])
    file = shard_file(tmp_path, series.name, 0)
    whole = pq.read_table(file)
    for name in ADDED:
        if name in whole.column_names:
            pq.write_table(whole.drop_columns([name]), file)
            assert read_series(tmp_path, series).column(name).to_pylist() == [None, None]
    pq.write_table(whole.drop_columns(["edge_mm"]), file)
    with pytest.raises(ValidationError, match="another version: they lack edge_mm"):
        read_series(tmp_path, series)


def test_fail_under():
    def ended(wrong, fair_right):
        return ValidationResult(
            100, 98 - wrong, wrong, 2, 0.1, 0.1, 1.0, 50, fair_right, (), Path("x")
        )

    assert ended(0, 49).exit_code(None) == 0
    assert ended(0, 49).exit_code(98.0) == 0
    assert ended(0, 49).exit_code(98.5) == 1
    assert ended(1, 50).exit_code(10.0) == 1


def test_what_a_plain_install_lacks_is_said_in_one_line(monkeypatch, capsys):
    for library in ("pyarrow", "matplotlib", "jinja2"):
        with monkeypatch.context() as without:
            without.setitem(sys.modules, library, None)
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


def test_help_loads_nothing_heavy():
    code = (
        "import sys\n"
        "from recognizer.validation.command import run\n"
        "for arguments in (['--help'], ['repeat', '--help'], ['--version']):\n"
        "    assert run(arguments) == 0\n"
        "heavy = {'numpy', 'scipy', 'sqlalchemy', 'pyarrow', 'matplotlib', 'jinja2', 'distributed'}"
        " & set(sys.modules)\n"
        "sys.exit(str(heavy) if heavy else 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
