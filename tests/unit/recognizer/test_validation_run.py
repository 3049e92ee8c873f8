"""A small run: its touches as a data set, and what a touch can say at best."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from recognizer.touch.hypothesis import labels_at
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.symbols.linearize import force_jacobian, prior_precision, project_symbols
from recognizer.validation.campaign import LIMIT_CLASSES, series_of
from recognizer.validation.dataset import baseline
from recognizer.validation.draw import draw_touch
from recognizer.validation.errors import ValidationError
from recognizer.validation.files import LIMITS, columns_of, read_series
from recognizer.validation.limits import (
    PLACES,
    ReadingErrors,
    least_covariance,
    limit_of,
    line_of_limits,
    true_lattice,
)
from recognizer.validation.pipeline import report_again, validate
from recognizer.validation.run import read_record

CUBE = Path(__file__).parents[3] / "fixtures" / "cube.yaml"
TOUCHES = 5
GAIN = np.array([math.log(4000.0), 0.3, 0.02, -0.01])  #: of a plate that stands on symbols alone


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    options = {"kinds": "face=4,blank", "surfaces": "database", "seed": 7, "study": 0, "limits": 3}
    with pytest.MonkeyPatch.context() as patched:  # the page is drawn once
        patched.setattr("recognizer.validation.report.page_of", lambda *_: "")
        validate(CUBE, folder=folder, touches=TOUCHES, export="npz", **options)
    validate(folder=folder, resume=True, export="lerobot")
    return folder


@pytest.fixture(scope="module")
def work(made):
    return read_record(made)


@pytest.fixture(scope="module")
def reader(work):
    return Reader(open_lab(work.database))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"specs": 5}, "5 names no set"),
        ({"specs": {"name": "Cube"}}, "names no set"),
        ({"folder": 5}, "5 is no folder"),
        ({"folder": "a-file"}, "the folder cannot be made or written"),
        ({"jobs": 0}, "--jobs: 0"),
    ],
)
def test_a_call_that_is_refused_begins_no_run(given, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a-file").touch()
    with pytest.raises(ValidationError, match=said):
        validate(**{"specs": CUBE, "folder": "run"} | given)
    assert [path.name for path in tmp_path.iterdir()] == ["a-file"]


def test_a_data_set_holds_the_touches_of_the_run(made, reader):
    data = dict(np.load(made / "dataset.npz"))
    rows = pq.read_table(made / "trials.parquet").to_pylist()
    assert {row["kind"] for row in rows} == {"face", "blank"}
    assert data["counts"].shape == (TOUCHES, 16, 16)
    names = [*data["names"].tolist(), ""]
    for i, row in enumerate(rows):
        name = f"{row['object']}/{row['face']}" if row["object"] else ""
        assert names[data["label"][i]] == name
        theta_deg = np.degrees(data["theta_rad"][i])
        assert (data["x_mm"][i], theta_deg) == pytest.approx(
            (row["x_mm"], row["theta_deg"]) if name else (math.nan, math.nan), abs=1e-5, nan_ok=True
        )
        found = reader.read(data["counts"][i])  # from the counts alone
        assert bool(found) == (data["answer"][i] >= 0) == (row["verdict"] != "rejected")
        if found:
            assert names[data["answer"][i]] == f"{found.object}/{found.face}"
            assert found.x_mm == pytest.approx(data["answer_x_mm"][i], abs=1e-9)
    assert np.flatnonzero(data["test"]).tolist() == [4]
    counted = baseline(data, np.ones(TOUCHES, bool))
    verdicts = [row["verdict"] for row in rows]
    assert [counted[key] for key in ("right", "wrong", "refused")] == [
        verdicts.count(verdict) for verdict in ("right", "wrong", "rejected")
    ]
    right = [row["error_mm"] for row in rows if row["verdict"] == "right"]
    # the report's reader knows which parts are as designed, that of the data set has counts alone
    assert counted["rms_mm"] == pytest.approx(np.sqrt(np.mean(np.square(right))), abs=0.02)
    assert json.loads(str(data["description"]))["baseline"] == baseline(data, data["test"])


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


def test_the_form_is_lerobots(made):
    """The layout of LeRobotDataset v3.0: what its loader reads, column by column."""
    folder = made / "lerobot"
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert info["codebase_version"] == "v3.0"
    assert info["splits"] == {"train": "0:4", "test": "4:5"}
    table = pq.read_table(folder / info["data_path"].format(chunk_index=0, file_index=0))
    stats = json.loads((folder / "meta" / "stats.json").read_text())
    assert set(table.column_names) == set(info["features"]) == set(stats)
    for name, feature in info["features"].items():
        field = table.schema.field(name).type
        if feature["shape"] == [1]:
            assert np.dtype(str(field).replace("float", "float32")) == np.dtype(feature["dtype"])
        else:
            assert field.list_size == feature["shape"][0] == len(feature["names"])
    known = dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64")
    for name, kind in (known | {"timestamp": "float32"}).items():
        assert info["features"][name] == {"dtype": kind, "shape": [1], "names": None}
    tactile = np.load(made / "dataset.npz")["counts"].reshape(TOUCHES, -1)
    assert np.allclose(stats["observation.tactile"]["max"], tactile.max(axis=0))
    episodes = pq.read_table(folder / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [e["dataset_from_index"] for e in episodes] == list(range(TOUCHES))
    assert all(e["dataset_to_index"] - e["dataset_from_index"] == e["length"] for e in episodes)
    tasks = pq.read_table(folder / "meta" / "tasks.parquet")
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == [tasks.column_names[1]]
    assert episodes[0]["tasks"] == tasks.column(1).to_pylist()


@pytest.fixture
def known(work, reader):
    """An image amid a face, the true pose, and the labels there."""
    touch = draw_touch(work.plan(series_of(work.campaign)[1], 0), 0, reader)
    prepared = reader.prepared[0]
    names = [prepared.embossed.face(n).face for n in range(6)]
    face = names.index(touch.contact.scene.face)
    place, pose = true_lattice(prepared.embossed, face, touch.touch)
    image = reader.image(reader.signal(touch.counts), prepared)
    return image, np.append(pose, np.zeros(4)), labels_at(prepared.embossed, [place])


def forces_at(image, unknowns, labels):
    pose, gain = unknowns[None, :7], unknowns[None, 7:]
    measured, _, values = project_symbols(image, pose, gain, labels)
    return force_jacobian(image, pose, gain, values, measured)[1][0]


def test_the_bound_is_that_of_finite_differences(known):
    image, pose, labels = known
    true = np.concatenate([pose, GAIN])
    # templates are tables of .05 mm: steps of place, turn and scale span some of them
    steps = np.array([0.1, 0.1, 0.01, *[1e-2] * 3, 0.01, *[1e-4] * 4])
    by = np.stack(
        [
            (forces_at(image, true + step, labels) - forces_at(image, true - step, labels))
            / (2 * step.max())
            for step in np.diag(steps)
        ],
        axis=1,
    )
    noise = 20.0
    information = by.T @ (by * image.trust[:, None]) / noise**2 + np.diag(prior_precision(image))
    found = least_covariance(image, pose, GAIN, labels, ReadingErrors(noise, 0.0))
    wanted = np.linalg.inv(information)[:3, :3]
    assert np.sqrt(np.diag(found)) == pytest.approx(np.sqrt(np.diag(wanted)), rel=0.1)


def test_variances_of_a_tactel_by_hand():
    errors = ReadingErrors(noise=2.0, gain=0.1, depth=0.05, shift_mm=0.1)
    found = errors.variance(np.array([100.0]), np.array([[30.0, 40.0]]), np.array([200.0]))
    assert found == pytest.approx([2**2 + 10**2 + 10**2 + 5**2])
    square = ReadingErrors(noise=2.0, gain=0.1, exponent=2.0)  # readings are squares of forces
    found = square.variance(np.array([10.0]), np.zeros((1, 2)), np.zeros(1))
    assert found == pytest.approx([(2 / 20) ** 2 + 0.5**2])


def test_a_line_counts_what_can_be_named_and_what_is_answered():
    nan = float("nan")
    rows = {
        "number": np.arange(4),
        "likeliest": np.array([True, True, True, False]),
        "doubt": np.array([1e-6, 1e-4, 2e-4, nan]),
        "bits": np.array([30.0, 24.0, 23.0, nan]),
        "bound_mm": np.array([0.03, 0.04, 1.0, nan]),
        "bound_deg": np.array([0.1, 0.1, 1.0, nan]),
    }
    trials = {
        "verdict": np.array(["right", "right", "rejected", "wrong"], object),
        "error_mm": np.array([0.06, 0.08, nan, nan]),
        "error_deg": np.array([0.1, -0.1, nan, nan]),
    }
    line = line_of_limits("edge", rows, trials, 1e-4)
    assert (line["bits"], line["wrong"]) == (23.5, 1)
    assert [line[name]["count"] for name in ("likeliest", "best", "right")] == [3, 2, 2]
    # 10^3 places take 23.25 bits, 10^4 26.6, 10^5 29.9
    assert [one["count"] for one in line["named"]] == [2, 1, 1, 0, 0]
    assert [one["places"] for one in line["named"]] == list(PLACES)
    assert (line["ratio_mm"], line["ratio_deg"]) == (pytest.approx(2.0), pytest.approx(1.0))


def test_a_run_shows_limits_and_its_rows_repeat(made, work, reader, monkeypatch):
    before = (made / "results.json").read_bytes()
    found = json.loads(before)["limits"]
    assert [line["class"] for line in found["classes"]] == list(LIMIT_CLASSES)
    assert found["arrays"][0]["places"] == len(reader.lab.arrays[0].keys)
    face = found["classes"][0]
    assert (face["touches"], face["likeliest"]["count"], face["wrong"]) == (3, 3, 0)
    assert face["ratio_mm"] > 0.3
    assert "What a touch can say at best" in (made / "report.html").read_text()
    series = series_of(work.campaign)[2]
    rows = columns_of(read_series(made, series, LIMITS))
    again = limit_of(work.plan(series, 1), 1, reader)
    assert {name: rows[name][1] for name in again} == pytest.approx(again, nan_ok=True)
    monkeypatch.setattr("recognizer.validation.report.page_of", lambda *_: "")
    report_again(made)
    assert (made / "results.json").read_bytes() == before
