"""The JSON schema for editors, and the specs to begin with."""

import re
from pathlib import Path

import pytest

from generator.spec import SpecError, read_specs
from generator.spec.option import database_option, format_option
from generator.spec.schema import spec_schema
from generator.spec.settings import ObjectSettings
from generator.spec.shape import EXAMPLES, KINDS
from generator.spec.starter import starter, starter_named

CUBE = Path(__file__).parents[3] / "fixtures/cube.yaml"


def blocks(schema):
    yield from (schema["$defs"][name] for name in schema["$defs"])


def test_every_setting_is_described_and_typed():
    schema = spec_schema()
    assert {entry["$ref"] for entry in schema["anyOf"]} == {
        "#/$defs/ObjectSettings",
        "#/$defs/SetSettings",
    }
    for block in blocks(schema):
        assert block["additionalProperties"] is False
        assert block["description"]
        for name, setting in block["properties"].items():
            assert "$ref" in setting or setting["description"], name
            assert {"$ref", "type", "anyOf", "enum", "const"} & set(setting), name


def test_examples_cover_all_shapes():
    assert tuple(EXAMPLES) == KINDS
    assert list(spec_schema()["$defs"]["Shape"]["properties"]) == [*KINDS, "scale"]


@pytest.mark.parametrize("shape", [shape for shape in KINDS if shape != "file"])
def test_starters_can_be_made_as_they_are(shape, tmp_path):
    file = tmp_path / "c.yaml"
    file.write_text(starter(shape))
    (one,) = read_specs([file])
    assert one.shape.kind == shape


def test_starter_shows_the_values_that_hold_without_it(tmp_path):
    file = tmp_path / "c.yaml"
    file.write_text(re.sub(r"(?m)^# ( *[a-z_]+:)", r"\1", starter("cube")))
    (one,) = read_specs([file])
    (smallest,) = read_specs([CUBE])
    assert one == smallest
    written = set(re.findall(r"([a-z_]+):", file.read_text()))
    assert set(ObjectSettings.model_fields) - {"encoding"} <= written


def test_starter_names_the_file_that_it_is_in():
    assert starter("cube").startswith("# Cube: make it with  encode-object cube.yaml\n")
    kind, text = starter_named("cube", "mine.yaml")
    assert text == starter(kind).replace("cube.yaml", "mine.yaml")


def test_starter_by_other_names():
    assert starter_named("Parallelepiped")[0] == "box"
    assert starter_named("triangular-prism")[0] == "triangular_prism"
    with pytest.raises(SpecError) as caught:
        starter_named("prisma")
    assert str(caught.value) == "error: unknown shape 'prisma'\n  fix: did you mean 'prism'?"


def test_options():
    assert format_option("STEP, .stl,step") == ("step", "stl")
    assert database_option("lab.db") == "sqlite:///lab.db"
    with pytest.raises(SpecError) as caught:
        format_option("step,stel,dwg")
    assert str(caught.value) == (
        "--format: error: unknown format 'stel'\n  fix: did you mean 'stl'?\n\n"
        "--format: error: unknown format 'dwg'\n  fix: choose from step,stl,3mf,glb,stpz,mjcf,"
        "urdf,sdf,usd"
    )
    with pytest.raises(SpecError, match="no format is named"):
        format_option(" , ")
    with pytest.raises(SpecError, match="--database: error: objects cannot be kept in 'mysql'"):
        database_option("mysql://host/name")
    with pytest.raises(SpecError, match="--database: error: 'postgresql:/name' is half an address"):
        database_option("postgresql:/name")
