"""Symbols for every sensor type, and letters made for tactels: embossed, touched and read."""

import json
import math

import numpy as np
import pytest

from encoded_objects import Reader, Scan, encode, open_lab, simulate
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from generator.alphabet import alphabet_named
from probe.command import run as probe_sensor
from recognizer.command import run as recognize_object

CLOTH = "name: cloth\nrows: 14\ncolumns: 20\npitch: 1.5 mm\nrow_pitch: 2.1 mm\n"


@pytest.mark.parametrize("name", [*shipped_names(), "cloth.yaml"])
def test_a_type_reads_its_symbols(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cloth.yaml").write_text(CLOTH + "overlay: {tip: 1.2 mm}\n")
    sensor = sensor_type_named(name)
    spec = {"name": "Box", "shape": {"box": ["90 mm", "80 mm", "70 mm"]}, "sensor_type": name}
    encode(spec | {"print": {"printer": "resin"}}, database="lab.db", formats=())
    force = 80 * math.prod(sensor.half_mm) / 12.7**2 / (4 if sensor.value == "depth" else 1)
    touch = ["simulate", "lab.db#Box/F1", "--x", "42", "--y", "38", "--theta", "31"]
    given = ["--force", str(force), "--sensor-type", name, "-o", "touch.h5"]
    assert probe_sensor([*touch, *given]) == 0
    capsys.readouterr()
    assert recognize_object(["touch.h5", "--json"]) == 0
    (answer,) = json.loads(capsys.readouterr().out)
    assert (answer["object"], answer["face"]) == ("Box", "F1")
    T = answer["T_face_probe"]
    assert math.hypot(T[0][3] - 42, T[1][3] - 38) < 0.15
    assert math.degrees(math.atan2(T[1][0], T[0][0])) == pytest.approx(31, abs=0.6)


MIRRORED = [
    [[[-x, y] for x, y in stroke] for stroke in glyph.strokes]
    for glyph in alphabet_named("tactel-8").glyphs
]
OWN = {"alphabet": {"name": "mirrored", "reach": 0.28, "glyphs": MIRRORED}}


@pytest.mark.parametrize(("profile", "symbols", "name"), [
    ("tactel-16", {}, "tactel-16"), ("tactel-8", OWN, "mirrored"),
])  # fmt: skip
def test_touches_of_a_cube_are_read(tmp_path, profile, symbols, name):
    url = str(tmp_path / "lab.db")
    cube = {"name": "Cube", "shape": {"cube": "60 mm"}, "profile": profile, "symbols": symbols}
    encode(cube, database=url, folder=tmp_path / "out", formats=())
    reader = Reader(open_lab(url))
    assert [one.alphabet.name for one in reader.lab.arrays] == [name]
    rng = np.random.default_rng(12)
    for face in ("F1", "F1", "F3", "F3", "F6", "F6"):
        x, y, theta = *rng.uniform(17, 43, 2), rng.uniform(-180, 180)
        touch = simulate(f"{url}#Cube/{face}", x=x, y=y, theta=theta, force=60)
        answer = reader.read(touch.counts)
        assert (answer.object, answer.face) == ("Cube", face), answer
        assert np.hypot(*(answer.T_face_probe[:2, 3] - (x, y))) < 0.15
        turn = np.degrees(np.arctan2(*answer.T_face_probe[[1, 0], 0])) - theta
        assert abs((turn + 180) % 360 - 180) < 1.0
    scan = Scan(reader)
    for x in (9, 15):  # over an edge
        touch = simulate(f"{url}#Cube/F2", x=x, y=31, theta=20, force=60)
        answer = scan.add(touch.counts)
    assert (scan.touches, answer.object, answer.face) == (2, "Cube", "F2")
