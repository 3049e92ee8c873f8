"""Where a spec may write, and what it may replace."""

import json

import pytest

from generator.command import run as encode_object

SPEC = "name: Cube\nshape: {cube: 40 mm}\nprint: {parts: whole}\noutput: {formats: [stl]%s}\n"


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """The current folder, with another one for specs beside it."""
    (tmp_path / "specs").mkdir()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path


def spec(bench, output=""):
    path = bench / "specs" / "cube.yaml"
    path.write_text(SPEC % output)
    return str(path)


def test_a_spec_writes_unasked_into_its_folder_and_the_current_one(bench, capsys):
    outputs = ("folder: ../specs/out", "database: ../specs/lab.db", "database: sqlite:///own.db")
    for output in (*outputs, "folder: ./a/../b"):
        assert encode_object([spec(bench, f", {output}")]) == 0, capsys.readouterr().err


@pytest.mark.parametrize(
    ("output", "said"),
    [
        (", folder: ../elsewhere", "output: folder writes to {}/elsewhere"),
        (", folder: {}/elsewhere", "output: folder writes to {}/elsewhere"),
        (", folder: link/cube", "output: folder writes to {}/elsewhere/cube"),
        (", database: ../elsewhere.db", "output: database writes to {}/elsewhere.db"),
        (", database: 'sqlite:///{}/e.db'", "output: database writes to {}/e.db"),
        (", database: 'postgresql://u:secret@127.0.0.1:1/lab'", "postgresql://u:***@127.0.0.1:1"),
    ],
)
def test_a_spec_that_writes_elsewhere_says_where_and_needs_a_yes(bench, output, said, capsys):
    (bench / "here" / "link").symlink_to(bench / "elsewhere")
    path = spec(bench, output.format(bench))
    before = sorted(bench.rglob("*"))
    for more in ([], ["--json"]):
        assert encode_object([path, *more]) == 2
        out, err = capsys.readouterr()
        told = str(json.loads(out)["error"]) if more else err
        assert said.format(bench) in told
        assert "--yes" in told
    assert sorted(bench.rglob("*")) == before
    if output == ", folder: ../elsewhere":
        assert encode_object([path, "--dry-run"]) == 0
        assert encode_object([path, "-o", "out", "--database", "lab.db"]) == 0
        assert encode_object([path, "--yes"]) == 0


@pytest.mark.parametrize(
    "setting",
    ["shape: {file: own.stl}", "sensor_type: own", "print: {printer: own.yaml}",
     "print: {printer: {file: own}}", "symbols: {alphabet: own.yaml}", "output: {folder: out}",
     "output: {database: own.db}", "objects: [own.yaml]"],
)  # fmt: skip
def test_specs_of_strangers_name_no_files(bench, setting, capsys):
    (bench / "here" / "own").write_text("rows: kept to itself\n")
    path = bench / "specs" / "cube.yaml"
    shape = "" if setting.startswith(("shape", "objects")) else "shape: {cube: 40 mm}\n"
    path.write_text(f"name: Cube\n{shape}{setting}\n")
    assert encode_object([str(path), "--no-files", "--dry-run"]) == 2
    said = capsys.readouterr().err
    assert "are not taken here" in said or "'own' is no sensor type" in said
    assert "kept" not in said


def test_specs_of_strangers_name_what_ships(bench):
    path = bench / "specs" / "cube.yaml"
    path.write_text("name: Cube\nshape: {cube: 40 mm}\nsensor_type: gel-24x32\n")
    assert encode_object([str(path), "--no-files", "--dry-run"]) == 0


def test_a_trial_takes_down_what_would_be_made_and_nothing_else(bench, capsys):
    path = spec(bench)
    assert encode_object([path, "--dry-run", "--trial", "trial.db", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["objects"][0]
    assert "answered at once, " in said["promise"][0]
    assert [one.name for one in bench.rglob("*.db")] == ["trial.db"]
    assert encode_object(["show", "Cube", "--database", "trial.db", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    counted = [face["symbols"] for face in shown["faces"]]
    assert [one for one in counted if one] == [face["symbols"] for face in said["face_reports"]]
    assert encode_object([path, "--trial", "other.db"]) == 2
    assert encode_object([path, "--dry-run", "--trial", "trial.db"]) == 4  # never a lab
    assert "name a new file" in capsys.readouterr().err


@pytest.mark.parametrize(("answer", "code"), [("n", 1), ("y", 0)])
def test_at_a_terminal_it_asks(bench, answer, code, answered):
    done = answered(answer, spec(bench, ", folder: ../elsewhere"))
    assert done.returncode == code, done.stderr
    assert f"cube.yaml:4:34: output: folder writes to {bench}/elsewhere" in done.stderr
    assert "Write there? [y/N]" in done.stderr
    assert (bench / "elsewhere").exists() == (code == 0)


def test_files_of_others_are_not_replaced_unasked(bench, capsys):
    path, out = spec(bench), bench / "here" / "out"
    out.mkdir()
    (out / "Cube.png").write_bytes(b"a holiday")
    assert encode_object([path, "-o", "out"]) == 2
    err = capsys.readouterr().err
    assert "Cube.png" in err
    assert "--replace" in err
    assert [file.name for file in out.iterdir()] == ["Cube.png"]
    assert not (bench / "here" / "lab.db").exists()  # nothing is registered
    assert encode_object([path, "-o", "out", "--format", ""]) == 2
    assert "no format is named" in capsys.readouterr().err
    assert encode_object([path, "-o", "out", "--replace"]) == 0
    assert (out / "Cube.png").read_bytes() != b"a holiday"
    (out / "Cube.png").write_bytes(b"an older picture")
    assert encode_object([path, "-o", "out"]) == 0  # a registered object has its parts there
    for name in ("Cube.stl", "Cube.png"):  # the same bytes, though nobody knows of them here
        (bench / name).write_bytes((out / name).read_bytes())
    assert encode_object([path, "-o", ".."]) == 0


def test_the_folders_of_killed_runs_go_with_the_next_run(bench):
    for name in ("out/cube", "out/other", "out/third"):
        (bench / "here" / name / ".encode-object-999999").mkdir(parents=True)
    assert encode_object([spec(bench)]) == 0
    assert list((bench / "here").rglob(".encode-object-*")) == []
