"""What `encode-object show` says of an object's promise is what was said when it was made."""

from __future__ import annotations

import pytest

from encoded_objects.base.sensor_type_file import sensor_type_named
from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.pipeline import encode
from generator.pipeline.registered_promise import registered_promises
from generator.spec import read_specs

SPECS = {
    "Bar": "{box: [60 mm, 30 mm, 12 mm]}, symbols: {pitch: 7 mm}",
    "Can": "{cylinder: {diameter: 40 mm, height: 30 mm}}",
    "Old": "{cube: 90 mm}, profile: thesis",
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return what was reported of each object, and what is registered."""
    folder = tmp_path_factory.mktemp("promises")
    found = {}
    for name, words in SPECS.items():
        (folder / f"{name}.yaml").write_text(f"{{name: {name}, shape: {words}}}")
        report = encode(
            read_specs([folder / f"{name}.yaml"]), folder=folder, formats=(),
            database=f"{folder}/{name}.db",
        )  # fmt: skip
        with read_transaction(open_database(f"{folder}/{name}.db", writable=False)) as connection:
            found[name] = report, read_object(connection, name)
    return found


@pytest.mark.parametrize("name", SPECS)
def test_the_database_tells_the_promise_that_was_made(made, name):
    report, held = made[name]
    told = {face.name: face.promise for face in report.objects[0].face_reports}
    numbers = {face.face_id: face.name for face in held.faces}
    found = {
        numbers[number]: (one.at_once, one.within_three)
        for number, one in registered_promises(held).items()
    }
    made = {face: (one.at_once, one.within_three) for face, one in told.items() if one}
    assert found == {face: both for face, both in made.items() if both[0]}
    assert bool(found) == (name != "Old")


def test_another_sensor_is_promised_what_it_would_have_been_promised_when_made(made, tmp_path):
    _, held = made["Bar"]
    spec = tmp_path / "bar.yaml"
    spec.write_text(f"{{name: Bar, shape: {SPECS['Bar']}}}")
    report = encode(
        read_specs([spec], sensor_type="mat-32x32"), folder=tmp_path, formats=(),
        database=f"{tmp_path}/lab.db",
    )  # fmt: skip
    told = [face.promise.at_once for face in report.objects[0].face_reports if face.symbols]
    mat = sensor_type_named("mat-32x32")
    found = [one.at_once for one in registered_promises(held, mat).values()]
    assert sorted(found) == sorted(told)
    usual = {one.at_once for one in registered_promises(held).values()}
    assert usual.isdisjoint(found)
    assert registered_promises(held, sensor_type_named("gel-24x32")) == {}  # sees too few at once
