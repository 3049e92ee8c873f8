"""Every shipped sensor type: symbols of the pitch it proposes, touched and read by the commands."""

import json
import math

import pytest

from encoded_objects import encode
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from probe.command import run as probe_sensor
from recognizer.command import run as recognize_object

CLOTH = """name: cloth
rows: 14
columns: 20
pitch: 1.5 mm
row_pitch: 2.1 mm
overlay: {tip: 1.2 mm}
"""


@pytest.mark.parametrize("name", [*shipped_names(), "cloth.yaml"])
def test_a_type_reads_its_symbols(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cloth.yaml").write_text(CLOTH)
    sensor = sensor_type_named(name)
    spec = {
        "name": "Box",
        "shape": {"box": ["90 mm", "80 mm", "70 mm"]},
        "sensor_type": name,
        "print": {"printer": "resin"},
    }
    encode(spec, database="lab.db", formats=())
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
