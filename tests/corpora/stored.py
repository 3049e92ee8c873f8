"""Tests that what the code makes is what is stored: each part in a process of its own.

`make.py` sets what floating point and output depend on before anything is loaded. A corpus has a
file of tests of its own, as a process of pytest takes whole files.
"""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from corpora import make


def as_stored(*corpora: str) -> Callable[[str, Path], None]:
    """Return the test of all parts of some corpora."""

    @pytest.mark.parametrize("part", [part for name in corpora for part in make.parts_of(name)])
    def test_is_as_stored(part: str, tmp_path: Path) -> None:
        words = [sys.executable, make.__file__, "--check", part]
        run = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
        assert not run.returncode, run.stdout + run.stderr

    return test_is_as_stored
