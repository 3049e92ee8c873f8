"""What commands say and leave to a technician: waits, lists, scans, sensors that do not suit."""

from __future__ import annotations

import json
import re
import signal
import sqlite3
import subprocess
import sys
import time

import manifold3d
import numpy as np
import pytest

from encoded_objects import Reader, encode, open_lab
from encoded_objects.base.output import some_of
from generator.command import run as encode_object
from probe.command import run as probe_sensor
from probe.simulate.simulation import SimulatedProbe, TouchOptions
from recognizer.command import run as recognize_object

PATIENCE_S = 60.0  #: for anything, on a busy machine


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A folder with a database of a cube, and nothing else."""
    folder = tmp_path_factory.mktemp("lab")
    cube = {"name": "Cube", "shape": {"cube": "40 mm"}}
    made = encode(cube, database=str(folder / "lab.db"), folder=folder / "out", formats=())
    assert made.files == ()
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


def can(height, radius, sides=120):
    """Return a cylinder of many facets."""
    return manifold3d.Manifold.cylinder(height, radius, radius, sides)


def test_without_formats_nothing_is_written(lab):
    assert [path.name for path in lab.iterdir()] == ["lab.db"]


def test_a_set_without_formats_writes_nothing(tmp_path):
    cube = {"name": "C", "shape": {"cube": "30 mm"}, "copies": 2}
    for _ in range(2):  # made, then skipped
        made = encode(cube, database=str(tmp_path / "l.db"), folder=tmp_path / "out", formats=())
        assert made.symbols > 0
        assert [path.name for path in tmp_path.iterdir()] == ["l.db"]


def test_who_waits_for_a_locked_database_says_so_and_obeys_ctrl_c(here):
    with sqlite3.connect(here, isolation_level=None) as other:
        other.execute("BEGIN EXCLUSIVE")
        command = [sys.executable, "-m", "generator.command", "list", "--database", here]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            said = process.stderr.readline()
            began = time.monotonic()
            process.send_signal(signal.SIGINT)
            process.wait(PATIENCE_S)
        assert "another program keeps the database locked; waiting up to 60 s" in said
        assert time.monotonic() - began < 20  # not the minute that SQLite would wait
        other.execute("ROLLBACK")


def test_a_curved_region_is_one_line_and_long_lists_are_cut(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_stl(tmp_path / "can.stl", can(50.0, 25.0).scale([1.0, 0.8, 1.0]))  # oval: no cylinder
    made = encode("can.stl", name="Can", database="lab.db", formats=())
    (note,) = [text for text in made.objects[0].warnings if "curved" in text]
    assert note.endswith("export the model as STEP: there cylinders and cones carry symbols")
    capsys.readouterr()
    assert encode_object(["show", "Can"]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if re.match(r" F\d", line)]
    assert [row.split()[:3] for row in rows] == [
        ["F1", "polygon", "1963"], ["F2", "polygon", "1963"], ["F3", "120", "facets"]
    ] or len(rows) == 3  # fmt: skip
    assert encode_object(["retire", "Can"]) == 0
    assert "undo: encode-object retire --undo Can" in capsys.readouterr().out
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


def test_a_touch_that_meets_a_wall_in_front_of_its_face_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    base = manifold3d.Manifold.cube([60, 60, 10])
    write_stl(tmp_path / "corner.stl", base + manifold3d.Manifold.cube([10, 60, 60]))
    encode("corner.stl", name="Corner", database="lab.db", formats=("stl",))
    for y, met in (("20", False), ("46", True)):
        assert probe_sensor(["simulate", "lab.db#Corner/F3", "--x", "30", "--y", y]) == 0
        said = capsys.readouterr().err
        assert ("1 touch met another face of the part, 48" in said) == met


def test_a_scan_of_a_recording_says_its_news_and_its_answer(here, capsys):
    touches = ["simulate", f"{here}#Cube/F1", "--scan", "raster", "--touches", "6", "-o", "s.h5"]
    assert probe_sensor(touches) == 0
    capsys.readouterr()
    assert recognize_object(["s.h5", "--database", here, "--scan"]) == 0
    said = capsys.readouterr()
    lines = said.out.splitlines()
    assert len(lines) == 2
    assert lines[-1].startswith("a scan of 6 touches: Cube/F1 at (")
    assert "mounted" not in said.err  # a simulated sensor is not
    assert recognize_object(["s.h5", "--database", here, "--scan", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)) == 6


def test_a_type_too_coarse_is_told_which_symbols_it_reads(here, capsys):
    kinds = ["--sensor-type", "fsr-8x8", "--touches", "3", "-o", "c.h5"]
    assert probe_sensor(["simulate", f"{here}#Cube/F1", *kinds]) == 0
    capsys.readouterr()
    recognize_object(["c.h5", "--database", here])
    refused = [line for line in capsys.readouterr().out.splitlines() if "not recognised" in line]
    assert refused
    for line in refused:
        assert "symbols of 5 mm are too fine for this type of sensor, which reads 7 mm best" in line
        assert "next:" not in line


def test_a_gel_pressed_through_is_told_a_force(here, capsys):
    gel = ["--sensor-type", "gel-24x32", "--force", "80", "-o", "g.h5"]
    assert probe_sensor(["simulate", f"{here}#Cube/F1", *gel]) == 2
    assert re.search(r"press with \d+(\.\d+)? N or less", capsys.readouterr().err)


def test_an_export_is_named_by_its_ending(here, capsys):
    assert probe_sensor(["simulate", "washer", "-o", "w.h5"]) == 0
    assert probe_sensor(["export", "w.h5", "-o", "w.npy"]) == 0
    assert np.load("w.npy").shape == (1, 16, 16)
    assert probe_sensor(["export", "w.h5", "-o", "w.txt"]) == 2
    assert "end it in .csv, .npy, .png or .mcap" in capsys.readouterr().err


def test_a_lab_may_be_closed(here):
    with open_lab(here) as lab:
        assert Reader(lab).lab is lab
