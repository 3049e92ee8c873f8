"""Every example in a docstring runs and prints what it says.

Examples find a `lab.db` with a cube, a `touch.h5` of its face F1 and `fixtures/` where they run.
"""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("encoded_objects", "generator", "decoder", "probe", "recognizer")
WITH_EXAMPLES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for package in PACKAGES
    for path in (ROOT / package).rglob("*.py")
    if ">>> " in path.read_text()
)


@pytest.fixture(scope="session")
def bench(tmp_path_factory):
    """A folder with a registered cube and a touch of it."""
    from encoded_objects import encode, simulate

    folder = tmp_path_factory.mktemp("examples")
    cube = {"name": "Cube", "shape": {"cube": "60 mm"}}
    encode(cube, database=str(folder / "lab.db"), folder=folder / "out" / "cube")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        simulate("lab.db#Cube/F1", x=28, y=31, theta=25, force=80).save("touch.h5")
    (folder / "fixtures").symlink_to(ROOT / "fixtures")
    return folder


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_of(module, bench, monkeypatch):
    monkeypatch.chdir(bench)
    result = doctest.testmod(importlib.import_module(module), optionflags=doctest.ELLIPSIS)
    assert result.attempted, "all of its examples are skipped"
    assert result.failed == 0, "see the captured output"
