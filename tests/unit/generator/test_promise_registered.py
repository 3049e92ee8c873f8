"""What `encode-object show` says of an object's faces is what was said when it was made."""

from __future__ import annotations

import json

import pytest

from generator.command import run
from generator.pipeline import encode
from generator.spec import read_specs

SPECS = {
    "Bar": "{box: [60 mm, 30 mm, 12 mm]}, symbols: {pitch: 7 mm}",
    "Can": "{cylinder: {diameter: 40 mm, height: 30 mm}}",
    "Old": "{cube: 90 mm}, profile: thesis",
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return the folder, and what was reported of each object."""
    folder = tmp_path_factory.mktemp("rates")
    found = {}
    for name, words in SPECS.items():
        (folder / f"{name}.yaml").write_text(f"{{name: {name}, shape: {words}}}")
        found[name] = encode(
            read_specs([folder / f"{name}.yaml"]), folder=folder, formats=(),
            database=f"{folder}/{name}.db",
        )  # fmt: skip
    return folder, found


def shown(folder, name, capsys, *options):
    """Return both shares of each face that has some, as `show` prints them."""
    assert run(["show", name, "--database", f"{folder}/{name}.db", "--json", *options]) == 0
    faces = json.loads(capsys.readouterr().out)["faces"]
    return {one["name"]: one["promise"] for one in faces if one["promise"] is not None}


@pytest.mark.parametrize("name", SPECS)
def test_the_database_gives_the_rates_that_were_reported(made, name, capsys):
    folder, reports = made
    reported = {
        face.name: {"at_once": face.promise.at_once, "within_three": face.promise.within_three}
        for face in reports[name].objects[0].face_reports
        if face.promise is not None and face.promise.at_once
    }
    assert shown(folder, name, capsys) == reported
    assert bool(reported) == (name != "Old")


def test_another_sensor_has_the_rates_it_would_have_had_when_made(made, tmp_path, capsys):
    folder, _ = made
    spec = tmp_path / "bar.yaml"
    spec.write_text(f"{{name: Bar, shape: {SPECS['Bar']}}}")
    report = encode(
        read_specs([spec], sensor_type="mat-32x32"), folder=tmp_path, formats=(),
        database=f"{tmp_path}/lab.db",
    )  # fmt: skip
    reported = [face.promise.at_once for face in report.objects[0].face_reports if face.symbols]
    found = shown(folder, "Bar", capsys, "--sensor-type", "mat-32x32")
    assert sorted(one["at_once"] for one in found.values()) == sorted(reported)
    usual = {one["at_once"] for one in shown(folder, "Bar", capsys).values()}
    assert usual.isdisjoint(one["at_once"] for one in found.values())
    # it sees too few symbols at once
    assert shown(folder, "Bar", capsys, "--sensor-type", "gel-24x32") == {}
