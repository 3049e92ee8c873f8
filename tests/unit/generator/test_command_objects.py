"""`encode-object list | show | retire | export | import` as people run them."""

import contextlib
import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from generator.command import run
from generator.database.registered import spec_hash

CUBE = "name: {name}\nshape: {{cube: {edge} mm}}\noutput: {{formats: stl}}\n"
ENTRY = "import sys; from generator.command import main; main()"


def make(name, database="lab.db", edge=30):
    spec = Path(f"{name}.yaml")
    spec.write_text(CUBE.format(name=name, edge=edge))
    assert run([str(spec), "--database", database, "-o", f"out/{name}"]) == 0


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a database of one object, and its files."""
    folder = tmp_path_factory.mktemp("made")
    with contextlib.chdir(folder):
        make("Cube")
    return folder


@pytest.fixture(autouse=True)
def _in_folder(made, tmp_path, monkeypatch):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")


def said(capsys, *arguments, code=0):
    """Run a command and return its JSON."""
    capsys.readouterr()
    assert run([*arguments, "--json"]) == code
    text, messages = capsys.readouterr()
    assert messages == ""
    return json.loads(text)


def test_show_names_faces_cells_files_and_origin(capsys):
    value = said(capsys, "show", "Cube")
    assert (value["name"], value["shape"], value["symbols"]) == ("Cube", "cube", 150)
    assert [face["name"] for face in value["faces"]] == ["F1", "F2", "F3", "F4", "F5", "F6"]
    cells = {tuple(cell[:2]) for face in value["faces"] for cell in face["cells"]}
    assert len(cells) == 150
    assert value["faces"][0]["placement"]["row"] == value["faces"][0]["cells"][0][0]
    assert {file["state"] for file in value["files"]} == {"ok"}
    assert spec_hash(value["provenance"]["spec"]) == value["spec_hash"]
    assert value["provenance"]["imported_from"] is None
    assert value["database"] == "sqlite:///lab.db"
    assert run(["show", "Cube"]) == 0
    text = capsys.readouterr().out
    for word in ("large 51x1285", "dense-4", "square", "900 mm2", "Cube-F1", "ok"):
        assert word in text


@pytest.mark.parametrize(
    ("shape", "round_area"),
    [
        ("cylinder: {diameter: 40 mm, height: 30 mm}", 2 * math.pi * 20 * 30),
        ("cone: {diameter: 60 mm, top_diameter: 30 mm, height: 40 mm}",
         math.pi * (30 + 15) * math.hypot(40, 15)),
    ],
    ids=["cylinder", "cone"],
)  # fmt: skip
def test_a_round_face_is_one_face(capsys, shape, round_area):
    Path("round.yaml").write_text(f"name: Round\nshape: {{{shape}}}\noutput: {{formats: stl}}\n")
    assert run(["round.yaml", "--database", "round.db"]) == 0
    (entry,) = said(capsys, "list", "--database", "round.db")["objects"]
    assert entry["faces"] == 3
    value = said(capsys, "show", "Round", "--database", "round.db")
    faces = {face["name"]: face for face in value["faces"]}
    assert list(faces) == ["F1", "F2", "F3"]
    kind = shape.partition(":")[0]
    assert [face["type"] for face in faces.values()] == ["polygon", kind, "polygon"]
    assert faces["F2"]["area_mm2"] == pytest.approx(round_area, rel=0.01)
    assert sum(face["symbols"] for face in faces.values()) == value["symbols"] == entry["symbols"]
    assert run(["show", "Round", "--database", "round.db"]) == 0
    text = capsys.readouterr().out
    assert f"Round: {kind}, 3 faces" in text
    assert "F2.2" not in text
    assert run(["list", "--database", "round.db"]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "Round" in line]
    assert line.split()[:3] == ["Round", kind, "3"]


def test_show_tells_missing_and_changed_files(capsys):
    first, second, third, *_ = sorted(Path("out/Cube").glob("*.stl"))
    first.unlink()
    second.write_bytes(second.read_bytes() + b"x")
    third.unlink()
    third.mkdir()
    value = said(capsys, "show", "Cube")
    states = {Path(file["file"]).name: file["state"] for file in value["files"]}
    assert states[first.name] == "missing"
    assert states[second.name] == "changed"
    assert states[third.name] == "unreadable"
    assert list(states.values()).count("ok") == 3
    assert run(["show", "Cube"]) == 0
    assert "make them again" in capsys.readouterr().out
    third.rmdir()
    make("Cube")
    assert {file["state"] for file in said(capsys, "show", "Cube")["files"]} == {"ok"}


def test_retired_objects_are_listed_as_such_and_keep_their_cells(capsys):
    assert run(["list"]) == 0
    assert "retired" not in capsys.readouterr().out
    assert said(capsys, "retire", "Cube")["retired"][0]["retired_utc"]
    assert run(["list"]) == 0
    assert "retired (UTC)" in capsys.readouterr().out
    for options in ([], ["--replace"], ["--dry-run"]):
        assert run(["Cube.yaml", *options]) == 4
        assert "'Cube' was retired" in capsys.readouterr().err
    make("Another")
    faces = [said(capsys, "show", name)["faces"] for name in ("Cube", "Another")]
    old, new = ({tuple(cell[:2]) for face in each for cell in face["cells"]} for each in faces)
    assert not old & new
    listed = said(capsys, "list")["objects"]
    assert [entry["retired_utc"] is not None for entry in listed] == [False, True]
    capsys.readouterr()
    assert run(["retire", "Cube", "--undo"]) == 0
    assert capsys.readouterr().out == "Cube: restored; its 150 cells were taken all the time\n"
    assert run(["Cube.yaml"]) == 0
    assert said(capsys, "show", "Cube")["retired_utc"] is None


def test_cells_are_freed_only_when_that_is_confirmed(capsys):
    capsys.readouterr()
    assert run(["retire", "Cube", "--free"]) == 2  # stdin is no terminal here
    assert "confirm it with --yes" in capsys.readouterr().err
    assert run(["retire", "Cube", "--free", "--undo"]) == 2
    assert len(said(capsys, "list")["objects"]) == 1
    assert run(["retire", "Cube", "--free", "--yes"]) == 0
    assert capsys.readouterr().out == "Cube: removed; its 150 cells are free again\n"
    assert said(capsys, "list")["objects"] == []


@pytest.mark.parametrize(("answer", "left"), [("n", 1), ("y", 0)])
def test_a_person_is_asked_before_cells_are_freed(answer, left, capsys):
    ours, theirs = os.openpty()
    os.write(ours, answer.encode() + b"\n")
    done = subprocess.run(
        [sys.executable, "-c", ENTRY, "retire", "Cube", "--free"],
        stdin=theirs, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    os.close(ours)
    os.close(theirs)
    assert "will be taken for other objects" in done.stderr
    assert done.returncode == left
    assert len(said(capsys, "list")["objects"]) == left


def test_all_named_objects_are_retired_or_none(capsys):
    assert run(["retire", "Cube", "Ball"]) == 4
    assert "no object is called 'Ball'" in capsys.readouterr().err
    assert said(capsys, "list")["objects"][0]["retired_utc"] is None
    for command in ("show", "retire", "export"):
        assert run([command, "Ball", "--database", "no.db"]) == 4
        assert "no.db" in capsys.readouterr().err
    assert not Path("no.db").exists()


def test_labs_exchange_objects(capsys):
    Path("lab.db").rename("a.db")
    make("Other", "b.db", edge=32)
    value = said(capsys, "export", "for-b.db", "--database", "a.db")
    assert value == {"exported": ["Cube"], "file": "for-b.db", "database": "sqlite:///a.db"}
    assert run(["export", "for-b.db", "--database", "a.db"]) == 4
    assert "--force" in capsys.readouterr().err
    error = said(capsys, "import", "for-b.db", "--database", "b.db", code=4)["error"]
    assert "'Cube' needs" in error["cause"]
    assert "'Other' holds here" in error["cause"]
    value = said(capsys, "import", "for-b.db", "--database", "b.db", "--skip-refused")
    assert [refused["name"] for refused in value["refused"]] == ["Cube"]
    assert run(["import", "for-b.db", "--database", "b.db", "--skip-refused"]) == 0
    text, messages = capsys.readouterr()
    assert text == "0 objects imported into sqlite:///b.db\n"
    assert messages.startswith("refused: 'Cube' needs ")
    value = said(capsys, "import", "for-b.db", "--database", "c.db", "--dry-run")
    assert (value["imported"], value["dry_run"]) == (["Cube"], True)
    assert not Path("c.db").exists()
    command = ["import", "for-b.db", "--database", "c.db", "--rename", "Cube=Cube of A"]
    assert run(command) == 0
    assert capsys.readouterr().out == "1 object imported into sqlite:///c.db\n  Cube of A\n"
    value = said(capsys, "show", "Cube of A", "--database", "c.db")
    assert value["provenance"]["imported_from"] == "for-b.db"
    assert {file["state"] for file in value["files"]} == {"ok"}  # found beside, where a.db is
    assert run(command) == 0
    assert "1 object known already" in capsys.readouterr().out
    assert run([*command[:-1], "Cube"]) == 2
    assert "--rename takes OLD=NEW" in capsys.readouterr().err


def test_the_commands_run_on_a_server(capsys, database_on):
    with database_on("postgresql") as url:
        assert run(["export", "x.db"]) == 0
        assert said(capsys, "import", "x.db", "--database", url)["imported"] == ["Cube"]
        make("Cube", url)  # the same cells again
        assert said(capsys, "show", "Cube", "--database", url)["files"][0]["state"] == "ok"
        assert run(["retire", "Cube", "--free", "--yes", "--database", url]) == 0
        assert said(capsys, "list", "--database", url)["objects"] == []


@pytest.mark.parametrize(
    "command",
    [["Cube.yaml"], ["list"], ["show", "Cube"], ["retire", "Cube"], ["export", "x.db"],
     ["import", "lab.db"]],
    ids=lambda command: command[0],
)  # fmt: skip
def test_every_command_says_in_one_message_that_no_server_runs(capsys, command):
    capsys.readouterr()
    assert run([*command, "--database", "postgresql://lab:secret@127.0.0.1:9/x"]) == 4
    text, messages = capsys.readouterr()
    assert text == ""
    assert messages == (
        "postgresql://lab:***@127.0.0.1:9/x: error: no PostgreSQL server runs on 127.0.0.1:9\n"
        "  fix: start it, or correct host and port in the URL\n"
    )


def test_passwords_are_not_shown(capsys, database_on):
    with database_on("postgresql") as url:
        url = url.replace("postgres@", "postgres:secret@", 1)  # the server asks for none
        assert run(["export", "x.db"]) == 0
        for command in (["import", "x.db"], ["list"], ["show", "Cube"], ["retire", "Cube"]):
            assert run([*command, "--database", url]) == 0
            assert run([*command, "--database", url, "--json"]) == 0
        assert run(["import", url, "--database", url]) == 4
        text, messages = capsys.readouterr()
        assert "postgres:***@" in text
        assert "secret" not in text + messages
