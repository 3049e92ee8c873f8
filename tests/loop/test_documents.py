"""What README, CONTRIBUTING and the guide show runs, beside a registered cube."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCKS = {
    f"{document.name}:{number}": code
    for document in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "docs/apriltag.md")
    for number, code in enumerate(
        re.findall(r"^```python\n(.*?)^```", document.read_text(), re.MULTILINE | re.DOTALL), 1
    )
}


@pytest.fixture
def lab(tmp_path):
    from generator import encode

    cube = ROOT / "fixtures" / "cube.yaml"
    encode(cube, database=str(tmp_path / "lab.db"), folder=tmp_path / "out", formats=())
    return tmp_path


@pytest.mark.parametrize("block", BLOCKS)
def test_python_of(block, lab):
    done = subprocess.run(
        [sys.executable, "-c", BLOCKS[block]], cwd=lab, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    for line, said in re.findall(r"^print\((.*)\)  # (.*)$", BLOCKS[block], re.MULTILINE):
        assert said in done.stdout.splitlines(), line


def test_the_touch_of_the_readme_is_recognised(lab):
    shown = (ROOT / "README.md").read_text().partition("## Touch it")[2]
    commands = re.findall(r"^```sh\n(.*?)^```", shown, re.MULTILINE | re.DOTALL)[0]
    here = commands.replace(".venv/bin/", f"{Path(sys.executable).parent}/")
    done = subprocess.run(here, shell=True, cwd=lab, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Cube/F1 at (28." in done.stdout or "Cube/F1 at (27.9" in done.stdout


def test_the_readme_is_two_screens_before_it_tests():
    before = (ROOT / "README.md").read_text().partition("## Test it")[0]
    assert before.count("\n") <= 100


def test_the_glossary_points_to_modules_that_are_there():
    places = re.findall(r"`(\w+/[\w/]+\.py)`", (ROOT / "docs" / "glossary.md").read_text())
    assert len(places) > 30
    assert [place for place in places if not (ROOT / place).is_file()] == []
