"""`validate-set --surfaces printed` with the real PrusaSlicer: printed once, touched, read.

Needs the Debian package `prusa-slicer`; without it these tests fail.
"""

import json
import math

import pyarrow.parquet as pq
import pytest

from generator.printed import slicer
from recognizer.validation.command import run

TOUCHES = 8


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    """A tile: its two large faces bear symbols, and are sliced."""
    path = tmp_path_factory.mktemp("specs") / "tile.yaml"
    path.write_text("name: Tile\nshape: {box: [28 mm, 28 mm, 10 mm]}\nsymbols: {pitch: 5 mm}\n")
    return path


def touch(spec, folder, *more):
    return run([str(spec), "--surfaces", "printed", "--faults", "usual", "--touches", str(TOUCHES),
                "--kinds", "face", "--levels", "typical", "--study", "0", "-o", str(folder),
                *more])  # fmt: skip


@pytest.fixture(scope="module")
def printed(spec, tmp_path_factory):
    folder = tmp_path_factory.mktemp("printed")
    assert touch(spec, folder) == 0
    return folder


def test_what_the_beads_leave_is_read(printed):
    results = json.loads((printed / "results.json").read_text())
    said = results["printed"]
    assert (said["profile"], said["faults"], said["faces"]) == ("fdm-0.4-0.2", "usual", 2)
    assert said["not_simulated"] == []
    assert 0.0 < said["moved_rms_mm"] < 0.1
    rows = pq.read_table(printed / "trials.parquet").to_pylist()
    assert len(rows) == TOUCHES
    assert "wrong" not in {row["verdict"] for row in rows}
    errors = [row["error_mm"] for row in rows if row["verdict"] == "right"]
    assert len(errors) >= TOUCHES - 2
    assert math.sqrt(sum(error**2 for error in errors) / len(errors)) < 0.12
    assert "printed, faults usual" in (printed / "report.html").read_text()


def test_prints_are_shared_and_a_run_goes_on_where_one_is_missing(
    spec, printed, tmp_path, monkeypatch
):
    before = (printed / "trials.parquet").read_bytes()
    gone = sorted((printed / "printed" / "surfaces").glob("*.npy"))[0]
    content = gone.read_bytes()
    gone.unlink()
    assert touch(spec, printed, "--resume") == 0
    assert gone.read_bytes() == content
    monkeypatch.setattr(slicer, "_run", lambda *_: pytest.fail("nothing is left to slice"))
    assert touch(spec, tmp_path / "run", "--prints", str(printed / "printed")) == 0
    for name in ("trials.parquet", "results.json"):
        assert (tmp_path / "run" / name).read_bytes() == (printed / name).read_bytes()
    assert (printed / "trials.parquet").read_bytes() == before
    assert not (tmp_path / "run" / "printed").exists()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--print-profile", "fdm"), "unknown print profile 'fdm'"),
        (("--faults", "worse"), "unknown fault 'worse'"),
        ((), "apt-get install prusa-slicer"),
    ],
)
def test_what_is_wrong_is_said_before_anything_is_made(
    spec, tmp_path, more, said, capsys, monkeypatch
):
    if not more:
        monkeypatch.setattr(slicer.shutil, "which", lambda _name: None)
    assert run([str(spec), "--surfaces", "printed", "-o", str(tmp_path / "run"), *more]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
