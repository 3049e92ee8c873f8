"""The public names: pinned, lazy, seen by type checkers, each with an example."""

from __future__ import annotations

import ast
import doctest
import importlib
import tomllib
from pathlib import Path

import pytest

import encoded_objects

ROOT = Path(__file__).parents[3]
NAMES = {
    "EncodedObjectsError", "Frame", "Reader", "Recognition", "Recording", "Scan", "SensorType",
    "decode", "encode", "open_lab", "simulate", "validate",
}  # fmt: skip


def test_the_public_names_are_these():
    assert set(encoded_objects.__all__) == NAMES | {"__version__"}
    assert dir(encoded_objects) == sorted(encoded_objects.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'utils'"):
        encoded_objects.utils  # noqa: B018


@pytest.mark.parametrize("name", sorted(NAMES))
def test_each_name_is_documented_by_an_example_that_runs(name):
    module = importlib.import_module(encoded_objects.HOMES[name])
    value = getattr(encoded_objects, name)
    assert value is getattr(module, name)
    (found,) = (one for one in doctest.DocTestFinder(recurse=False).find(value, name, module))
    assert found.examples, f"{name} has no example"
    # The examples themselves run with those of all modules, see test_docstrings.


def test_type_checkers_see_the_same_names_in_the_same_places():
    stub = Path(encoded_objects.__file__).with_suffix(".pyi")
    told = {
        alias.asname: (node.module, alias.name)
        for node in ast.parse(stub.read_text()).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert told == {name: (home, name) for name, home in encoded_objects.HOMES.items()}


def test_the_version_is_said_once():
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert build["project"]["dynamic"] == ["version"]
    assert build["tool"]["hatch"]["version"] == {"path": "encoded_objects/__init__.py"}
    assert f"## [{encoded_objects.__version__}] - " in (ROOT / "CHANGELOG.md").read_text()
