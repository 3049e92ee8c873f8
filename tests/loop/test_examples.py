"""The scripts of docs/examples run, in a folder of their own, and say what they made."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


def said_by(script: str, folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / script)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_build123d_bracket(tmp_path):
    said = said_by("build123d_bracket.py", tmp_path)
    before, after = map(int, re.findall(r"(?:volume|drilled) (\d+)", said))
    assert 60 * 30 * 12 + 12 * 30 * 24 < before < 1.15 * (60 * 30 * 12 + 12 * 30 * 24)
    # A hole of 3 mm through 12 mm, and through symbols of 1 mm where it meets them.
    assert 84 < before - after < 100
    assert {path.suffix for path in (tmp_path / "out" / "bracket").iterdir()} == {
        ".png", ".stl", ".svg",
    }  # fmt: skip


def test_cadquery_wedge(tmp_path):
    said = said_by("cadquery_wedge.py", tmp_path)
    assert " on 6 panels" in said
    extents = [float(n) for n in re.findall(r"([\d.]+) x ([\d.]+) x ([\d.]+) mm", said)[0]]
    # Symbols on both sides; on the slanted top they end below its highest edge.
    assert extents[0] == 51.6
    assert extents[1] == 41.6
    assert 40.0 < extents[2] < 41.6
