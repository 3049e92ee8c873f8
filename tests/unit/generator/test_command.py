"""The command `encode-object` as people run it: interruption, what is registered, the lab's key."""

import asyncio
import json
import shutil
import signal
import sqlite3
import subprocess
import sys
from contextlib import chdir, closing
from importlib import import_module
from pathlib import Path

import httpx
import pytest
from programs import wait_for

from encoded_objects.base.errors import EncodedObjectsError, without_password
from encoded_objects.base.sensor_type import SensorType
from generator.array import profile
from generator.array.lab_key import lab_key_of
from generator.command import run
from generator.database.exchange import import_objects
from generator.database.lab import lab_arrays, lab_key
from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from probe.command import run as probe_sensor
from recognizer.bench.app import application
from recognizer.bench.broker import Broker
from recognizer.bench.session import Session
from recognizer.touch.lab import open_lab
from recognizer.validation.campaign import Campaign
from recognizer.validation.run import prepare_run, read_record

KEY, OTHER = "0123-4567-89AB-CDER", "F1XT-VRES-0000-000Q"
V2 = Path(__file__).parents[3] / "fixtures" / "database" / "v2.db"
ENTRY = "import sys; from generator.command import main; main()"


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")


def make(name="Cube", database="lab.db", *options, more="", top="", code=0):
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


def test_interruption_has_exit_code_130():
    Path("c.yaml").write_text("name: Cube\nshape: {cube: 300 mm}\noutput: {formats: [stl]}\n")
    process = subprocess.Popen(
        [sys.executable, "-c", ENTRY, "c.yaml"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    made = Path("out")  # files are being made there, or it ended too early
    wait_for(lambda: [*made.glob("*/.encode-object-*")] or process.poll() is not None, 30)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    text, messages = process.communicate(timeout=30)
    assert process.returncode == 130
    assert text == b""
    assert messages == b"\nencode-object: interrupted\n"
    assert not [*Path("out").glob("**/*")]


def test_output_into_a_closed_pipe_is_no_traceback():
    process = subprocess.Popen(
        [sys.executable, "-c", ENTRY, "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    process.stdout.close()
    messages = process.stderr.read()
    process.stderr.close()
    assert process.wait(timeout=30) == 1
    assert messages == b""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    with chdir(folder):
        make()
    return folder


@pytest.fixture
def cube(made):
    """A cube that is registered in lab.db, with its files."""
    shutil.copytree(made, ".", dirs_exist_ok=True)


def test_show_tells_missing_and_changed_files(cube, capsys):
    first, second, third, *_ = sorted(Path("lab.db-Cube").glob("*.stl"))
    first.unlink()
    second.write_bytes(second.read_bytes() + b"x")
    third.unlink()
    third.mkdir()
    states = {
        Path(file["file"]).name: file["state"] for file in said(capsys, "show", "Cube")["files"]
    }
    told = [states.pop(path.name) for path in (first, second, third)]
    assert told == ["missing", "changed", "unreadable"]
    assert set(states.values()) == {"ok"}
    assert run(["show", "Cube"]) == 0
    assert "make them again" in capsys.readouterr().out
    third.rmdir()
    make()
    assert {file["state"] for file in said(capsys, "show", "Cube")["files"]} == {"ok"}


@pytest.mark.parametrize("name", ["a?b.db", "l%41b.db", "w%41?#x/lab.db?x=1"])
def test_a_database_is_the_file_that_is_named(name, tmp_path, capsys):
    home = (tmp_path / name).parent
    home.mkdir(exist_ok=True)
    named = str(tmp_path / name) if "/" in name else name
    Path("c.yaml").write_text("name: Cube\nshape: {cube: 60 mm}\noutput: {formats: [stl]}\n")
    assert run(["c.yaml", "--database", named, "--dry-run", "--trial", f"{named}.trial"]) == 0
    assert run(["c.yaml", "--database", named]) == 0
    assert f"registered in {named}" in capsys.readouterr().out.replace("\n", "")
    assert len(open_lab(named).arrays[0].faces) == 6
    assert said(capsys, "export", f"{named}.out", "--database", named)["exported"] == ["Cube"]
    assert run(["import", f"{named}.out", "--database", f"{named}.new"]) == 0
    made = {path.name for path in home.iterdir()} - {"c.yaml", "out", "w%41?#x"}
    assert made == {Path(name + more).name for more in ("", ".trial", ".out", ".new")}


def test_an_object_of_a_pitch_that_no_face_bears_is_called_damaged(cube, capsys):
    with closing(sqlite3.connect("lab.db")) as base, base:
        base.execute("update objects set pitch_mm = 1e-9")
    for command in (["show", "Cube"], ["list"]):
        assert run(command) == 4
        assert "what was never written: a pitch of 1e-09 mm" in capsys.readouterr().err
    with closing(sqlite3.connect("lab.db")) as base, base:
        base.execute("update objects set pitch_mm = 1")
    assert run(["list"]) == 0
    assert "places by chance never" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(("answer", "left"), [("n", 1), ("y", 0)])
def test_a_person_is_asked_before_cells_are_freed(cube, answer, left, answered, capsys):
    done = answered(answer, "retire", "Cube", "--free")
    assert "will be taken for other objects" in done.stderr
    assert done.returncode == left
    assert len(said(capsys, "list")["objects"]) == left


def test_all_named_objects_are_retired_or_none(cube, capsys):
    assert run(["retire", "Cube", "Ball"]) == 4
    assert "no object is called 'Ball'" in capsys.readouterr().err
    assert said(capsys, "list")["objects"][0]["retired_utc"] is None


async def open_at_bench(url, face):
    """Return what open-bench says of a database, and of its first port once that is open."""
    broker = Broker()
    with closing(Session(url, Path.cwd(), SensorType(), broker)) as session:
        app = application(session, broker, ((f"sim:{face}", "face"),), None)
        bench = httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://bench")
        async with bench:
            offered = (await bench.get("/api/bench")).json()
            port = {"url": offered["ports"][0]["url"]}
            return offered, (await bench.post("/api/port", json=port)).json()


def test_no_password_is_shown_or_kept(cube, capsys, database_on):
    with database_on("postgresql") as url:
        url = url.replace("postgres@", "postgres:secret@", 1)  # the server asks for none
        assert run(["export", "x.db"]) == 0
        for command in (["import", "x.db"], ["list"], ["show", "Cube"], ["retire", "Cube"],
                        ["retire", "Cube", "--undo"]):  # fmt: skip
            for more in ([], ["--json"]):
                assert run([*command, "--database", url, *more]) == 0
        assert run(["import", url, "--database", url]) == 4
        face = f"{url}#Cube/F1"
        assert probe_sensor(["simulate", face, "-o", "a.h5", "--truth", "a.json"]) == 0
        assert probe_sensor(["record", f"sim:{face}", "-o", "b.h5", "--frames", "2"]) == 0
        assert probe_sensor(["info", f"sim:{face}", "--seconds", "0.1"]) == 0
        assert probe_sensor(["simulate", f"{url}#Nope/F1"]) == 2
        for again in (False, True):  # the record has no password: it is given again
            campaign = Campaign(kinds=(("face", 1.0),))
            work = prepare_run(Path.cwd(), campaign, [], url, resume=again)
            assert work.database == url
        assert read_record(Path.cwd()).database == url.replace(":secret", "")
        offered, opened = asyncio.run(open_at_bench(url, face))
        assert offered["database"] == url.replace("secret", "***")
        assert opened["port"] == offered["ports"][0]["url"]
        assert "secret" not in json.dumps([offered, opened])
    said_of_it = "".join(capsys.readouterr())
    assert "postgres:***@" in said_of_it
    assert "secret" not in said_of_it
    kept = {path.name: path.read_bytes() for path in Path.cwd().glob("*.*") if path.is_file()}
    assert {"a.h5", "a.json", "b.h5", "asked.json"} <= kept.keys()
    assert not [name for name, content in kept.items() if b"secret" in content]


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("lab.db", "lab.db"),
        ("sqlite:///a:b@c.db", "sqlite:///a:b@c.db"),
        ("postgresql://u@h:5432/d#A/F1", "postgresql://u@h:5432/d#A/F1"),
        ("sim:postgresql+psycopg://u:p%20/ q@h/d#A/F1", "sim:postgresql+psycopg://u:***@h/d#A/F1"),
        ("no postgres://:p@ss@h/d, or", "no postgres://:***@h/d, or"),
        ("postgresql://h/d?user=u&password=p&a=b#A", "postgresql://h/d?user=u&password=***&a=b#A"),
    ],
)
def test_only_passwords_are_hidden(given, shown):
    assert without_password(given) == shown
    assert str(EncodedObjectsError(given)) == shown


def test_a_new_lab_draws_a_key_and_keeps_it(capsys, monkeypatch):
    drawn = iter([b"first" * 4, b"other" * 4])
    monkeypatch.setattr("generator.array.lab_key.token_bytes", lambda _: next(drawn))
    for name, database in (("Cube", "a.db"), ("Second", "a.db"), ("Cube", "b.db")):
        make(name, database)
    keys = [said(capsys, "lab", "--database", one)["lab_key"] for one in ("a.db", "b.db")]
    assert keys == [lab_key_of(b"first" * 4), lab_key_of(b"other" * 4)]
    assert held("a.db").array == held("a.db", "Second").array
    own = profile("tactel-8").array_of_lab(keys[0])
    assert held("a.db").array.definition == own.definition()
    assert held("a.db").layout.faces[0].placement.row == own.first[0]
    assert files("a.db")["Cube-F1.stl"] != files("b.db")["Cube-F1.stl"]


def test_the_same_key_gives_the_same_bytes(capsys):
    make("Cube", "a.db", "--lab-key", KEY, more=f", lab_key: {OTHER}")  # the option counts
    make("Cube", "b.db", more=f", lab_key: {KEY.lower()}")
    assert files("a.db") == files("b.db")
    make("Cube", "b.db", "--lab-key", KEY)  # again: the same key is no conflict
    assert "registered before" in capsys.readouterr().out


def test_another_key_than_the_databases_is_one_message(capsys):
    make("Cube", "a.db", "--lab-key", KEY)
    before = Path("a.db").read_bytes()
    for options, more in ((("--lab-key", OTHER), ""), ((), f", lab_key: {OTHER}")):
        capsys.readouterr()
        make("Second", "a.db", *options, more=more, code=2)
        text = " ".join(capsys.readouterr().err.split())
        assert f"{OTHER} was given, but the database has the lab key {KEY}" in text
        assert text.count("error:") == 1
    assert "spec.yaml:3:" in text
    assert Path("a.db").read_bytes() == before
    assert not Path("a.db-Second").exists()


def test_objects_of_one_run_agree_on_a_key(capsys):
    for name, key in (("A", KEY), ("B", OTHER)):
        text = f"name: {name}\nshape: {{cube: 30}}\noutput: {{lab_key: {key}}}\n"
        Path(f"{name}.yaml").write_text(text)
    assert run(["A.yaml", "B.yaml"]) == 2
    text = " ".join(capsys.readouterr().err.split())
    assert f"another lab key ({OTHER}) than 'A' ({KEY})" in text


def test_a_lab_from_before_there_were_keys_goes_on_as_it_was(capsys):
    shutil.copy(V2, "old.db")
    before = held("old.db").array
    assert before.definition == profile("one-touch").array().definition()
    make("Second", "old.db")
    brick = held("old.db", "Brick").array  # profile large was 255x257 then
    assert held("old.db", "Second").array == brick
    assert (brick.rows, brick.lab_key) == (255, "")
    make("Same", "old.db", top="profile: one-touch\n")
    assert held("old.db", "Same").array == before
    make("Third", "old.db", "--lab-key", KEY, code=2)
    assert "before there were lab keys" in capsys.readouterr().err


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
        assert lab_arrays(connection).made["tactel-8"].lab_key == OTHER
    assert held("a.db").array.lab_key == OTHER


def test_labs_that_were_made_apart_merge():
    make("Cube 0", "0.db", "--lab-key", KEY)
    make("Cube 1", "1.db", "--lab-key", OTHER)
    done = import_objects("0.db", "1.db")
    assert (done.copied, done.refused) == (("Cube 1",), ())
    ours, theirs = (held("0.db", f"Cube {k}").array for k in range(2))
    assert (ours.lab_key, theirs.lab_key) == (KEY, OTHER)
    assert ours.array_id != theirs.array_id
    make("New", "0.db")
    assert held("0.db", "New").array == ours
    # an imported object, asked for again, keeps its cells and its bytes
    make("Cube 1", "0.db")
    assert held("0.db", "Cube 1").array == theirs
    assert files("0.db", "Cube 1") == files("1.db", "Cube 1")
