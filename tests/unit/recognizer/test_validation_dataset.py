"""Data sets of touches: the run's own truth and answers, and LeRobot's published form."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.validation.dataset import baseline
from recognizer.validation.errors import ValidationError
from recognizer.validation.pipeline import validate

CUBE = Path(__file__).parents[3] / "fixtures" / "cube.yaml"
TOUCHES = 10


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    options = {"kinds": "face=4,blank", "surfaces": "database", "seed": 7, "study": 0}
    validate(CUBE, folder=folder, touches=TOUCHES, export="npz", **options)
    validate(folder=folder, resume=True, export="lerobot")
    return folder


def test_counts_and_truth_are_those_of_the_run(run):
    data = np.load(run / "dataset.npz")
    rows = pq.read_table(run / "trials.parquet").to_pylist()
    assert data["counts"].shape == (TOUCHES, 16, 16)
    names = data["names"].tolist()
    for i, row in enumerate(rows):
        name = f"{row['object']}/{row['face']}" if row["object"] else ""
        assert data["label"][i] == (names.index(name) if name else -1)
        assert (data["answer"][i] >= 0) == (row["verdict"] != "rejected")
        if name:
            assert data["x_mm"][i] == pytest.approx(row["x_mm"], abs=1e-6)
            assert np.degrees(data["theta_rad"][i]) == pytest.approx(row["theta_deg"], abs=1e-5)
        else:
            assert np.isnan(data["x_mm"][i])
    assert {row["kind"] for row in rows} == {"face", "blank"}
    assert np.flatnonzero(data["test"]).tolist() == [4, 9]


def test_a_reader_gets_the_same_answers_from_the_counts_alone(run):
    data = np.load(run / "dataset.npz")
    reader = Reader(open_lab(str(run / "lab.db")))
    for i in range(4):
        found = reader.read(data["counts"][i])
        label = data["names"].tolist().index(f"{found.object}/{found.face}") if found else -1
        assert label == data["answer"][i]
        if found:
            assert found.x_mm == pytest.approx(data["answer_x_mm"][i], abs=1e-9)


def test_the_baseline_counts_as_the_report_does(run):
    data = dict(np.load(run / "dataset.npz"))
    counted = baseline(data, np.ones(TOUCHES, bool))
    rows = pq.read_table(run / "trials.parquet").to_pylist()
    for verdict, key in (("right", "right"), ("wrong", "wrong"), ("rejected", "refused")):
        assert counted[key] == sum(row["verdict"] == verdict for row in rows)
    right = [row["error_mm"] for row in rows if row["verdict"] == "right"]
    assert counted["rms_mm"] == pytest.approx(np.sqrt(np.mean(np.square(right))), abs=1e-4)
    said = json.loads(str(data["description"]))
    assert said["baseline"] == baseline(data, data["test"])


def test_a_wrong_face_and_a_far_place_are_wrong():
    arrays = {
        "label": np.array([0, 0, 1, -1, 0]),
        "answer": np.array([0, 1, 1, 0, -1]),
        "x_mm": np.array([1.0, 1, 1, np.nan, 1]),
        "y_mm": np.array([0.0, 0, 0, np.nan, 0]),
        "theta_rad": np.array([3.1, 0, 0, np.nan, 0]),
        "answer_x_mm": np.array([1.3, 1, 4.5, 0, np.nan]),
        "answer_y_mm": np.array([0.4, 0, 0, 0, np.nan]),
        "answer_theta_rad": np.array([-3.1, 0, 0, 0, np.nan]),
    }
    found = baseline(arrays, np.ones(5, bool))
    assert (found["right"], found["wrong"], found["refused"], found["of_the_set"]) == (1, 3, 1, 4)
    assert found["rms_mm"] == 0.5
    assert found["rms_deg"] == pytest.approx(np.degrees(2 * np.pi - 6.2), abs=1e-4)


def test_the_form_is_lerobots(run):
    """The layout of LeRobotDataset v3.0: what its loader reads, column by column."""
    folder = run / "lerobot"
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert info["codebase_version"] == "v3.0"
    assert info["splits"] == {"train": "0:8", "test": "8:10"}
    at = {"chunk_index": 0, "file_index": 0}
    table = pq.read_table(folder / info["data_path"].format(**at))
    assert set(table.column_names) == set(info["features"])
    defaults = {"timestamp": "float32"} | dict.fromkeys(
        ("frame_index", "episode_index", "index", "task_index"), "int64"
    )
    for name, kind in defaults.items():
        assert info["features"][name] == {"dtype": kind, "shape": [1], "names": None}
    for name, feature in info["features"].items():
        field = table.schema.field(name).type
        if feature["shape"] == [1]:
            assert np.dtype(str(field).replace("float", "float32")) == np.dtype(feature["dtype"])
        else:
            assert field.list_size == feature["shape"][0] == len(feature["names"])
    episodes = pq.read_table(folder / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [e["dataset_from_index"] for e in episodes] == list(range(TOUCHES))
    assert all(e["dataset_to_index"] - e["dataset_from_index"] == e["length"] for e in episodes)
    tasks = pq.read_table(folder / "meta" / "tasks.parquet")
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == [tasks.column_names[1]]
    assert episodes[0]["tasks"] == tasks.column(1).to_pylist()
    stats = json.loads((folder / "meta" / "stats.json").read_text())
    assert set(stats) == set(info["features"])
    data = np.load(run / "dataset.npz")
    order = table.column("touch").to_numpy()
    tactile = np.array(table.column("observation.tactile").to_pylist()).reshape(-1, 16, 16)
    assert np.array_equal(tactile, data["counts"][order])
    assert np.allclose(stats["observation.tactile"]["max"], tactile.reshape(10, -1).max(axis=0))


def test_the_same_run_gives_the_same_bytes(run):
    before = hashlib.sha256((run / "dataset.npz").read_bytes()).digest()
    validate(folder=run, resume=True, export="npz")
    assert hashlib.sha256((run / "dataset.npz").read_bytes()).digest() == before


def test_an_unknown_form_is_refused_before_anything_is_made(tmp_path):
    with pytest.raises(ValidationError, match="'csv' is not known"):
        validate(CUBE, folder=tmp_path / "run", touches=2, export="csv")
    assert not (tmp_path / "run").exists()
