"""The key of a lab as people meet it: drawn, printed, given, refused; and labs that merge."""

import json
import shutil
from importlib import import_module
from pathlib import Path

import pytest

from generator.array import profile
from generator.array.lab_key import lab_key_of
from generator.command import run
from generator.database.exchange import import_objects
from generator.database.lab import lab_arrays, lab_key
from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction

KEY, OTHER = "0123-4567-89AB-CDER", "F1XT-VRES-0000-000Q"
V2 = Path(__file__).parents[3] / "fixtures" / "database" / "v2.db"


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")


def make(name, database, *options, more="", top="", code=0):
    Path("spec.yaml").write_text(
        f"name: {name}\nshape: {{cube: 30 mm}}\noutput: {{formats: stl{more}}}\n{top}"
    )
    assert run(["spec.yaml", "--database", database, "-o", f"{database}-{name}", *options]) == code


def said(capsys, *arguments, code=0):
    capsys.readouterr()
    assert run([*arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def held(database, name="Cube"):
    with read_transaction(open_database(database, writable=False)) as connection:
        return read_object(connection, name)


def files(database, name="Cube"):
    folder = Path(f"{database}-{name}")
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_new_lab_draws_a_key_and_keeps_it(capsys, monkeypatch):
    drawn = iter([b"first" * 4, b"other" * 4])
    monkeypatch.setattr("generator.array.lab_key.token_bytes", lambda _: next(drawn))
    make("Cube", "a.db")
    make("Second", "a.db")
    make("Cube", "b.db")
    a, b = said(capsys, "lab", "--database", "a.db"), said(capsys, "lab", "--database", "b.db")
    assert a["lab_key"] == lab_key_of(b"first" * 4)
    assert b["lab_key"] == lab_key_of(b"other" * 4)
    assert held("a.db").array == held("a.db", "Second").array
    assert held("a.db").array.lab_key == a["lab_key"]
    own = profile("large").array_of_lab(a["lab_key"])
    assert held("a.db").array.definition == own.definition()
    assert held("a.db").layout.faces[0].placement.row == own.first[0]
    assert files("a.db")["Cube-F1.stl"] != files("b.db")["Cube-F1.stl"]


def test_the_same_key_gives_the_same_bytes(capsys):
    make("Cube", "a.db", "--lab-key", KEY)
    make("Cube", "b.db", more=f", lab_key: {KEY.lower()}")
    make("Cube", "c.db", "--lab-key", KEY, more=f", lab_key: {OTHER}")  # the option counts
    assert files("a.db") == files("b.db") == files("c.db")
    make("Cube", "a.db", "--lab-key", KEY)  # again: the same key is no conflict
    assert "registered before" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "said_of_it"),
    [
        (OTHER, f"the lab key {OTHER} was given, but the database has the lab key {KEY}"),
        ("0123-4567-89AB-CDEQ", "its last character does not fit"),
        ("hello", "it has 5 characters"),
    ],
)
def test_a_wrong_key_is_one_message(capsys, given, said_of_it):
    make("Cube", "a.db", "--lab-key", KEY)
    before = Path("a.db").read_bytes()
    capsys.readouterr()
    make("Second", "a.db", "--lab-key", given, code=2)
    from_option = capsys.readouterr().err
    make("Second", "a.db", more=f", lab_key: {given}", code=2)
    from_spec = capsys.readouterr().err
    for text in (from_option, from_spec):
        assert said_of_it in " ".join(text.split())
        assert text.count("error:") == 1
        assert "fix:" in text
    assert "spec.yaml:3:" in from_spec
    assert Path("a.db").read_bytes() == before
    assert not Path("a.db-Second").exists()


def test_objects_of_one_run_agree_on_a_key(capsys):
    for name, key in (("A", KEY), ("B", OTHER)):
        Path(f"{name}.yaml").write_text(
            f"name: {name}\nshape: {{cube: 30}}\noutput: {{lab_key: {key}}}\n"
        )
    assert run(["A.yaml", "B.yaml"]) == 2
    assert f"another lab key ({OTHER}) than 'A' ({KEY})" in " ".join(
        capsys.readouterr().err.split()
    )


def test_a_lab_from_before_there_were_keys_goes_on_as_it_was(capsys):
    shutil.copy(V2, "old.db")
    before = held("old.db")
    assert said(capsys, "lab", "--database", "old.db")["lab_key"] is None
    make("Second", "old.db")
    brick = held("old.db", "Brick").array  # profile large was 255x257 then
    assert held("old.db", "Second").array == brick
    assert (brick.rows, brick.lab_key) == (255, "")
    make("Same", "old.db", top="profile: one-touch\n")
    assert held("old.db", "Same").array == before.array
    assert before.array.definition == profile("one-touch").array().definition()
    make("Third", "old.db", "--lab-key", KEY, code=2)
    assert "before there were lab keys" in capsys.readouterr().err
    assert run(["lab", "--database", "old.db"]) == 0
    assert "no lab key" in capsys.readouterr().out


def test_published_arrays_are_the_same_in_every_lab():
    text = "name: T\nshape: {cube: 120 mm}\nprofile: thesis\noutput: {formats: stl}\n"
    Path("t.yaml").write_text(text)
    for database, key in (("a.db", KEY), ("b.db", OTHER)):
        assert run(["t.yaml", "--database", database, "--lab-key", key, "-o", f"{database}-T"]) == 0
        assert held(database, "T").array.lab_key == ""
    assert files("a.db", "T") == files("b.db", "T")


def test_another_program_may_make_the_database_meanwhile(monkeypatch):
    """What was planned on a key of our own is planned anew on the one that is there."""

    def slower(url, **options):
        open_database(url, lab_key=OTHER)
        return open_database(url, **options)

    module = import_module("generator.pipeline.encode")
    monkeypatch.setattr(module, "open_database", slower)
    make("Cube", "a.db")
    with read_transaction(open_database("a.db")) as connection:
        assert lab_key(connection) == OTHER
        assert lab_arrays(connection).made["large"].lab_key == OTHER
    assert held("a.db").array.lab_key == OTHER


def test_labs_that_were_made_apart_merge():
    keys = [lab_key_of(bytes([k] * 16)) for k in range(4)]
    for k, key in enumerate(keys):
        make(f"Cube {k}", f"{k}.db", "--lab-key", key)
    for k in range(1, 4):
        done = import_objects("0.db", f"{k}.db")
        assert (done.copied, done.refused) == ((f"Cube {k}",), ())
    arrays = [held("0.db", f"Cube {k}").array for k in range(4)]
    assert [array.lab_key for array in arrays] == keys
    assert len({array.array_id for array in arrays}) == 4
    make("New", "0.db")
    assert held("0.db", "New").array == arrays[0]  # on the lab's own
    # an imported object, asked for again, keeps its cells and its bytes
    make("Cube 2", "0.db")
    assert held("0.db", "Cube 2").array == arrays[2]
    assert files("0.db", "Cube 2") == files("2.db", "Cube 2")
