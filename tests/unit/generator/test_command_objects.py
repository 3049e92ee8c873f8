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


def test_a_round_face_is_one_face(capsys):
    Path("round.yaml").write_text(
        "name: Round\noutput: {formats: stl}\n"
        "shape: {cone: {diameter: 60 mm, top_diameter: 30 mm, height: 40 mm}}\n"
    )
    assert run(["round.yaml", "--database", "round.db"]) == 0
    (entry,) = said(capsys, "list", "--database", "round.db")["objects"]
    value = said(capsys, "show", "Round", "--database", "round.db")
    kinds = {face["name"]: face["type"] for face in value["faces"]}
    assert kinds == {"F1": "polygon", "F2": "cone", "F3": "polygon"}
    round_area = math.pi * (30 + 15) * math.hypot(40, 15)
    assert value["faces"][1]["area_mm2"] == pytest.approx(round_area, rel=0.01)
    assert sum(face["symbols"] for face in value["faces"]) == value["symbols"] == entry["symbols"]


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
