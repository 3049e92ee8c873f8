"""Results of rows that are written by hand, shards on the disk, and the table of extremes."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from recognizer.validation.campaign import Campaign, series_of
from recognizer.validation.command import run
from recognizer.validation.extremes import press_scenes
from recognizer.validation.result import ValidationResult, bound_from, result_from
from recognizer.validation.results import results_of
from recognizer.validation.rows import CpuTime
from recognizer.validation.shards import (
    columns_of,
    done_shards,
    read_series,
    row_schema,
    shard_file,
    write_shard,
)

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
    wrong, answered, place, turn = found["verdict"]
    assert not wrong["holds"]
    assert not answered["holds"]
    assert place["value"] == pytest.approx(0.05)
    assert place["holds"]
    assert turn["holds"]
    assert [str(bound_from(line)) for line in found["verdict"]] == [
        "wrong answers, all touches: 1 of 10, 10.000% (1.788% ... 40.415%), bound = 0.0%",
        (
            "answered, of touches that show enough symbols: 8 of 9, 88.889% "
            "(56.500% ... 98.011%), bound >= 99.5%"
        ),
        "pose, rms, under strong mismatch: 0.050 mm, bound <= 0.1 mm",
        "turn, rms, under strong mismatch: 0.200 degrees, bound <= 0.3 degrees",
    ]
    result = result_from(found, 1.25, tmp_path)
    assert (result.holds, result.fair, result.fair_right) == (False, 9, 7)
    assert str(result).startswith("10 touches: 7 right, 1 wrong, 2 rejected; pose 0.15")
    assert str(result).count("\n  fails: ") == 2
    assert result.as_json()["folder"] == str(tmp_path)
    json.dumps(found, allow_nan=False)


def test_a_bound_is_told_by_enough_touches_alone(tmp_path):
    few = results_of(columns([row(i) for i in range(20)], tmp_path / "few"))
    many = results_of(columns([row(i) for i in range(800)], tmp_path / "many"))
    most = [row(i) for i in range(790)] + [row(i, "rejected") for i in range(790, 800)]
    below = results_of(columns(most, tmp_path / "below"))
    # Wilson's interval of n of n begins at n / (n + 3.84): .995 takes 765 touches
    assert [found["verdict"][1]["state"] for found in (few, many, below)] == [
        "too few touches to tell", "holds", "fails",
    ]  # fmt: skip
    assert not few["verdict"][1]["holds"]


def test_worlds_are_the_touches_of_faces_by_sensor(tmp_path):
    rows = [
        row(0, level="low"),
        row(1, "rejected", level="low"),
        row(2, level="mismatch", kind="edge", chi2=1.0),
        row(3, level="mismatch", kind="corner", chi2=9.0),
        row(4, "rejected", kind="blank", surface="blank", object="", face="", enough=False),
    ]
    low, mismatch = results_of(columns(rows, tmp_path))["worlds"]
    assert (low["level"], low["touches"], low["right"], low["rejected"]) == ("low", 2, 1, 1)
    assert (mismatch["touches"], mismatch["right"]) == (2, 2)
    assert mismatch["inside_95"]["count"] == 1  # of the chi2 with 3 degrees of freedom: 7.81


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
