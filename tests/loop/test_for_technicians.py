"""What commands say and leave to a technician: waits, lists, scans, sensors that do not suit."""

import json
import re
import signal
import sqlite3
import time

import h5py
import manifold3d
import numpy as np
import pytest
from programs import PATIENCE_S, started

from encoded_objects import Reader, encode, open_lab
from encoded_objects.base.output import some_of
from generator.command import run as encode_object
from probe.command import run as probe_sensor
from probe.simulate.simulation import SimulatedProbe, TouchOptions
from recognizer.command import run as recognize_object


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A folder with a database of a cube, and nothing else."""
    folder = tmp_path_factory.mktemp("lab")
    cube = {"name": "Cube", "shape": {"cube": "40 mm"}}
    encode(cube, database=str(folder / "lab.db"), folder=folder / "out", formats=())
    return folder


@pytest.fixture
def here(lab, tmp_path, monkeypatch):
    """An empty folder, in which commands run, and the lab's database."""
    monkeypatch.chdir(tmp_path)
    return str(lab / "lab.db")


def write_stl(path, solid):
    """Write a solid of `manifold3d` as binary STL."""
    mesh = solid.to_mesh()
    rows = np.zeros(len(mesh.tri_verts), [("n", "<f4", 3), ("t", "<f4", (3, 3)), ("a", "<u2")])
    rows["t"] = mesh.vert_properties[:, :3][mesh.tri_verts]
    path.write_bytes(bytes(80) + len(rows).to_bytes(4, "little") + rows.tobytes())


def can(height, radius):
    """Return a cylinder of many facets."""
    return manifold3d.Manifold.cylinder(height, radius, radius, 120)


def test_a_set_without_formats_writes_nothing(tmp_path):
    cube = {"name": "C", "shape": {"cube": "30 mm"}, "copies": 2}
    for _ in range(2):  # made, then skipped
        made = encode(cube, database=str(tmp_path / "l.db"), folder=tmp_path / "out", formats=())
        assert made.symbols > 0
        assert [path.name for path in tmp_path.iterdir()] == ["l.db"]


def test_who_waits_for_a_locked_database_says_so_and_obeys_ctrl_c(here):
    with sqlite3.connect(here, isolation_level=None) as other:
        other.execute("BEGIN EXCLUSIVE")
        with started("generator", "list", "--database", here) as process:
            said = process.stderr.readline()
            began = time.monotonic()
            process.send_signal(signal.SIGINT)
            process.wait(PATIENCE_S)
        assert "another program keeps the database locked; waiting up to 60 s" in said
        assert time.monotonic() - began < 20  # not the minute that SQLite would wait
        other.execute("ROLLBACK")


def test_a_curved_region_is_one_line_and_long_lists_are_cut(tmp_path, monkeypatch, ask):
    monkeypatch.chdir(tmp_path)
    write_stl(tmp_path / "can.stl", can(50.0, 25.0).scale([1.0, 0.8, 1.0]))  # oval: no cylinder
    made = encode("can.stl", name="Can", database="lab.db", formats=())
    (note,) = [text for text in made.objects[0].warnings if "curved" in text]
    assert note.endswith("export the model as STEP: there cylinders and cones carry symbols")
    code, said, _ = ask(encode_object, "show", "Can")
    assert (code, len(re.findall(r"^ F\d", said, re.MULTILINE))) == (0, 3)
    assert some_of([f"F{n}" for n in range(1, 10)]) == "F1, F2, F3, F4, F5 and 4 more"


def test_a_random_touch_that_finds_no_rest_is_drawn_again(tmp_path):
    handle = manifold3d.Manifold.cube([30, 12, 50]).translate([30, -6, 15])
    mug = can(80.0, 36.0) - can(80.0, 31.0).translate([0, 0, 5]) + (handle - can(80.0, 33.0))
    write_stl(tmp_path / "mug.stl", mug)
    probe = SimulatedProbe(
        str(tmp_path / "mug.stl"), TouchOptions(touches=40, seed=1), accuracy="footprint"
    )
    assert len(list(probe.touches())) == 40
    assert probe.drawn_again > 0


def test_a_touch_that_meets_a_wall_in_front_of_its_face_says_so(tmp_path, monkeypatch, ask):
    monkeypatch.chdir(tmp_path)
    base = manifold3d.Manifold.cube([60, 60, 10])
    write_stl(tmp_path / "corner.stl", base + manifold3d.Manifold.cube([10, 60, 60]))
    encode("corner.stl", name="Corner", database="lab.db", formats=("stl",))
    for y, met in ((20, False), (46, True)):
        place = ("--x", 30, "--y", y, "--truth", f"{y}.json")
        code, _, said = ask(probe_sensor, "simulate", "lab.db#Corner/F3", *place)
        assert code == 0
        (truth,) = json.loads((tmp_path / f"{y}.json").read_text("utf-8"))["touches"]
        assert truth.get("met_another_face", False) == met
        assert ("1 touch met another face of the part, 48" in said) == met


def test_a_scan_of_a_recording_says_its_news_and_its_answer(here, ask):
    touches = ("simulate", f"{here}#Cube/F1", "--scan", "raster", "--touches", 6, "-o", "s.h5")
    assert ask(probe_sensor, *touches)[0] == 0
    code, said, notes = ask(recognize_object, "s.h5", "--database", here, "--scan")
    assert (code, len(said.splitlines())) == (0, 2)
    assert said.splitlines()[-1].startswith("a scan of 6 touches: Cube/F1 at (")
    assert "mounted" not in notes  # a simulated sensor is not


def test_the_frames_of_faces_are_those_of_answers(here, tmp_path, ask):
    touch = ("simulate", f"{here}#Cube/F3", "-o", "f.h5", "--truth", "f.json", "--replace")
    assert ask(probe_sensor, *touch)[0] == 0
    (truth,) = json.loads((tmp_path / "f.json").read_text("utf-8"))["touches"]
    _, said, _ = ask(encode_object, "show", "Cube", "--database", here, "--json")
    (shown,) = (face for face in json.loads(said)["faces"] if face["name"] == "F3")
    held = np.array(shown["T_object_face"]) @ truth["T_face_probe"]
    assert held == pytest.approx(np.array(truth["T_object_probe"]))


def test_poses_that_contradict_a_scan_are_named(tmp_path, monkeypatch, ask):
    monkeypatch.chdir(tmp_path)
    plate = {"name": "Plate", "shape": {"box": "90 x 90 x 40 mm"}, "profile": "thesis"}
    encode(plate, database="lab.db", formats=("stl",))
    touches = ("simulate", "lab.db#Plate/F1", "--scan", "raster", "--touches", 8)
    assert ask(probe_sensor, *touches, "-o", "s.h5")[0] == 0
    read = ("s.h5", "--database", "lab.db", "--scan")
    code, _, notes = ask(recognize_object, *read)
    assert (code, "contradict" in notes) == (0, False)
    with h5py.File("s.h5", "r+") as recording:
        recording["pose"][:, :3, 3] /= 1000  # metres
    code, _, notes = ask(recognize_object, *read)
    assert code == 1
    assert "the poses contradict the touches, which without them say Plate/F1; poses are T" in notes


def test_a_type_too_coarse_is_told_which_symbols_it_reads(here, ask):
    ask(probe_sensor, "simulate", f"{here}#Cube/F1", "--sensor-type", "fsr-8x8", "-o", "c.h5")
    _, said, _ = ask(recognize_object, "c.h5", "--database", here)
    assert "symbols of 5 mm are too fine for this type of sensor, which reads 7 mm best" in said
    assert "next:" not in said


def test_a_gel_pressed_through_is_told_a_force(here, ask):
    gel = ("--sensor-type", "gel-24x32", "--force", 80, "-o", "g.h5")
    code, _, error = ask(probe_sensor, "simulate", f"{here}#Cube/F1", *gel)
    assert code == 2
    assert re.search(r"press with \d+(\.\d+)? N or less", error)


def test_an_export_is_named_by_its_ending(here, ask):
    assert ask(probe_sensor, "simulate", "washer", "-o", "w.h5")[0] == 0
    assert ask(probe_sensor, "export", "w.h5", "-o", "w.npy")[0] == 0
    assert np.load("w.npy").shape == (1, 16, 16)
    code, _, error = ask(probe_sensor, "export", "w.h5", "-o", "w.txt")
    assert code == 2
    assert "end it in .csv, .npy, .png or .mcap" in error


def test_a_lab_may_be_closed(here):
    with open_lab(here) as lab:
        assert Reader(lab).lab is lab
