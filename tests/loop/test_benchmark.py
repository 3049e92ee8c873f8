"""Small campaigns: the benchmark, as frozen, in three forms; faulty sensors, objects to mistake."""

import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest

from encoded_objects.base.errors import EncodedObjectsError
from encoded_objects.base.sensor_type_file import sensor_type_named
from generator.command import run as encode_object
from probe.recording.imported import import_array
from recognizer.validation import encoded_set
from recognizer.validation.benchmark import (
    FIRST,
    FROZEN,
    _figures_of,
    _read_all,
    digest_of,
    run_benchmark,
)
from recognizer.validation.benchmark_readers import ReaderWorld, network
from recognizer.validation.campaign import Campaign, series_of
from recognizer.validation.command import run
from recognizer.validation.encoded_set import is_extra
from recognizer.validation.files import columns_of, read_series
from recognizer.validation.pipeline import validate
from recognizer.validation.run import TouchProgress

PAGE = Path(__file__).parents[2] / "docs" / "benchmark.md"
WORLD = "fsr-8x8"
HERE = SimpleNamespace(  # in this process, where others are started for each object
    run=lambda command, **_: SimpleNamespace(returncode=encode_object(command[3:]))
)
KINDS = ("copy", "near", "small", "side", "same_profile", "decoy")
SET = """objects:
  - {name: Block, shape: {box: [60 mm, 50 mm, 40 mm]}, profile: one-touch}
  - {name: Prism, shape: {triangular_prism: {side: 50 mm, height: 40 mm}}, profile: one-touch}
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("benchmark")
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    (folder / "my_reader.py").write_text(code)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(encoded_set, "subprocess", HERE)
        patch.setattr("generator.pipeline.plates.overview_pdf", lambda *_: b"")  # drawn elsewhere
        patch.setattr(sys, "path", [one for one in sys.path if one])  # as of an installed command
        patch.chdir(folder)
        found = run_benchmark(folder, touches=8, worlds=[WORLD], seed=5,
                              readers=["ours", "chance", "my_reader:reader"])  # fmt: skip
    sys.modules.pop("my_reader", None)
    return folder, found


def test_the_public_half_is_as_frozen_the_hidden_one_is_other_and_forms_agree(made, tmp_path):
    folder, found = made
    assert found["frozen"] == {WORLD: True}
    assert json.loads(FROZEN.read_text())[WORLD][str(FIRST)]
    public, hidden = (
        dict(np.load(folder / half / f"{WORLD}.npz")) for half in ("public", "hidden")
    )
    counts = public["counts"].copy()
    assert found["sha256"]["public"][WORLD] == digest_of(public, 8)
    assert digest_of(public, FIRST) != digest_of(hidden, FIRST)
    public["counts"][0, 0, 0] += 1
    assert found["sha256"]["public"][WORLD] != digest_of(public, 8)
    store = import_array(
        folder / "public" / f"{WORLD}.zarr", tmp_path / "t.h5", sensor_type=WORLD,
        dataset="right_tactile_data_finger/0",
    )  # fmt: skip
    assert np.array_equal([frame.counts for frame in store.frames()], counts)
    table = pq.read_table(folder / "public" / WORLD / "lerobot/data/chunk-000/file-000.parquet")
    tactile = np.array(table.column("observation.tactile").to_pylist())
    assert np.array_equal(tactile, counts.reshape(8, -1))
    card = json.loads((folder / "public" / "card.json").read_text())
    assert card["worlds"][WORLD]["touches"] == 8


def test_readers_are_judged_alike(made):
    folder, found = made
    ours, chance, own = (found["readers"][n] for n in ("ours", "chance", "my_reader:reader"))
    assert ours["hidden"]["wrong"]["count"] == 0
    assert ours["hidden"]["right"]["count"] > 0
    assert ours["hidden"]["bound_mm"] > 0
    assert chance["hidden"]["wrong"]["count"] == 8  # it never refuses
    seen = (np.load(folder / "public" / f"{WORLD}.npz")["label"] >= 0).sum()
    assert own["public"]["right"]["count"] == seen > 0
    assert own["hidden"]["right"]["count"] == 0


def test_the_network_knows_the_touches_that_it_learned(made):
    folder, _ = made
    touches = dict(np.load(folder / "public" / f"{WORLD}.npz"))
    lab = str(folder / "labs" / WORLD / "lab.db")
    often = {name: np.repeat(one, 50, axis=0) for name, one in touches.items()}
    read = network(ReaderWorld(WORLD, lab, sensor_type_named(WORLD), often))
    known = np.flatnonzero(touches["label"] >= 0)
    assert len(known)
    for n in known:
        answer = read(touches["counts"][n])
        assert answer.name == touches["names"][touches["label"][n]]
        off = answer.x_mm - touches["x_mm"][n], answer.y_mm - touches["y_mm"][n]
        assert np.hypot(*off) < 2


def test_a_rate_of_wrong_answers_sets_the_score():
    count = 20_000
    zeros, ones = np.zeros(count, int), np.ones(count)
    whole = {
        "right": np.arange(count) >= 4, "answer": zeros, "score": np.linspace(1, 0, count),
        "label": zeros, "also_label": zeros - 1, "bound_mm": ones, "bound_deg": ones,
        "off": 2 * ones, "turn": ones, "chi2": 3 * ones, "ms": ones,
    }  # fmt: skip
    line = _figures_of(whole, ones == 1)
    assert line["at_rate"]["wrong"]["count"] <= 2  # of 20,000
    assert line["at_rate"]["count"] == 0  # the wrong ones are the surest
    line = _figures_of(whole | {"score": whole["score"][::-1]}, ones == 1)
    assert line["at_rate"]["count"] == count - 4
    assert (line["ratio_mm"], line["normalised"]) == (2.0, 1.0)


def test_what_is_not_known_is_refused(tmp_path, capsys):
    assert run(["benchmark", "-o", str(tmp_path), "--worlds", "mars"]) == 2
    assert run(["benchmark", "-o", str(tmp_path), "--reader", "no_such:reader"]) == 2
    assert "module:function" in capsys.readouterr().err
    with pytest.raises(EncodedObjectsError):
        run_benchmark(tmp_path, readers=["json:none"])


def test_answers_of_a_reader_are_tuples_whose_covariance_is_one(made):
    folder, _ = made
    touches = dict(np.load(folder / "public" / f"{WORLD}.npz"))

    def read(*answer):
        return _read_all(lambda counts: answer, WORLD, touches, TouchProgress(), "mine")

    name = str(touches["names"][0])
    assert (read(name, 1.0, 2.0, 0.0)["answer"] == 0).all()
    for spread in (np.eye(2), np.zeros((3, 3))):
        with pytest.raises(EncodedObjectsError, match="covariance"):
            read(name, 1.0, 2.0, 0.0, 1.0, spread)
    with pytest.raises(EncodedObjectsError, match="names 'Ball'"):
        read("Ball", 1.0, 2.0, 0.0)


def test_a_campaign_over_worlds(tmp_path, monkeypatch):
    few = {"COPIES": 2, "SMALL_PITCHES": (3.3,), "LAB_OBJECTS": 1, "OTHER_LABS": 1}
    for name, count in few.items():  # each object takes time to make, as does each process
        monkeypatch.setattr(encoded_set, name, count)
    monkeypatch.setattr(encoded_set, "subprocess", HERE)
    monkeypatch.setattr("recognizer.validation.report.page_of", lambda *_: "")
    monkeypatch.setattr("generator.pipeline.plates.overview_pdf", lambda *_: b"")
    (tmp_path / "set.yaml").write_text(SET)
    folder = tmp_path / "run"
    result = validate(
        tmp_path / "set.yaml", folder=folder, touches=22, seed=3, kinds=",".join(KINDS),
        levels="typical,dead-10,slide-2", sensor_per="run", study=0,
    )  # fmt: skip
    assert result.touches == 22
    rows = columns_of(read_series(folder, series_of(Campaign(22))[0]))
    assert set(rows["kind"]) <= set(KINDS)
    for kind, name in zip(rows["kind"], rows["object"], strict=True):
        if kind == "same_profile":
            assert name == ""  # nobody's, to this lab: every answer is wrong
        elif kind == "decoy":
            assert name in ("", "Block", "Prism")  # exchanged symbols are nobody's
        elif kind == "side":
            assert name in ("Block", "Prism")
        else:
            assert is_extra(name, kind)
    kept = rows["kind"] != "same_profile"
    assert not (rows["verdict"][kept] == "wrong").any()
    assert (rows["verdict"][kept] == "right").any()
