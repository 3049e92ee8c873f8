"""What will touch an object decides the pitch of its symbols and what its faces promise."""

from __future__ import annotations

import json

import pytest

from generator.command import run as encode_object
from generator.spec import SpecError, read_specs
from generator.spec.read import tree_from

CUBE = {"name": "Cube", "shape": {"cube": "60 mm"}}
MINE = "name: mine\nrows: 16\ncolumns: 16\npitch: 2.54 mm\n"


def pitch_of(**settings):
    (located,) = read_specs([tree_from(CUBE | settings)])
    return located.style.pitch_mm


def test_auto_takes_the_pitch_that_the_sensor_proposes():
    assert pitch_of() == 5.0
    assert pitch_of(sensor_type="flexitac-16x32") == 6.0
    assert pitch_of(sensor_type="gel-24x32", print={"printer": "resin"}) == 3.0
    assert pitch_of(sensor_type="gel-24x32") == 4.0  # the finest that a nozzle of .4 mm makes
    assert pitch_of(sensor_type="gel-24x32", symbols={"pitch": "7 mm"}) == 7.0
    assert pitch_of(sensor_type="gel-24x32", profile="one-touch") == 7.0


def test_what_touches_an_object_is_no_part_of_what_it_is():
    plain, same, finer = (
        read_specs([tree_from(CUBE | given)])[0]
        for given in (
            {},
            {"sensor_type": "gel-24x32", "symbols": {"pitch": "5 mm"}},
            {"sensor_type": "gel-24x32"},
        )
    )
    assert plain.meaning == same.meaning != finer.meaning


def test_a_file_stands_beside_the_spec_and_the_option_beside_the_caller(tmp_path, monkeypatch):
    place = tmp_path / "specs"
    place.mkdir()
    (place / "mine.yaml").write_text(MINE)
    (place / "cube.yaml").write_text("name: Cube\nshape: {cube: 60 mm}\nsensor_type: mine.yaml\n")
    (located,) = read_specs([place / "cube.yaml"])
    assert located.style.pitch_mm == 8.0  # 3.15 of 2.54 mm
    assert located.sensor.half_mm == pytest.approx((20.32, 20.32))
    (other,) = read_specs([place / "cube.yaml"], sensor_type="fsr-8x8")
    assert other.style.pitch_mm == 7.0


def test_an_unknown_type_is_told_at_its_line(tmp_path):
    path = tmp_path / "cube.yaml"
    path.write_text("name: Cube\nshape: {cube: 60 mm}\nsensor_type: gel-23x32\n")
    with pytest.raises(SpecError) as raised:
        read_specs([path])
    (problem,) = raised.value.problems
    assert (problem.mark.line, problem.mark.column) == (3, 14)
    assert "did you mean 'gel-24x32'" in problem.fix


def test_the_option_of_the_command(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cube.yaml").write_text("name: Cube\nshape: {cube: 60 mm}\n")
    (tmp_path / "mine.yaml").write_text(MINE)
    assert encode_object(["cube.yaml", "--dry-run", "--json", "--sensor-type", "mine.yaml"]) == 0
    (made,) = json.loads(capsys.readouterr().out)["objects"]
    assert made["symbols"] == 6 * 7**2  # of 8 mm on 60 mm
    assert encode_object(["cube.yaml", "--dry-run", "--sensor-type", "fsr-9"]) == 2
    assert "did you mean 'fsr-16'" in capsys.readouterr().err
