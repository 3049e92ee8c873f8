"""Tests that what the code makes is what is stored: each corpus in a process of its own.

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
    """Return the test of some corpora."""

    @pytest.mark.parametrize("corpus", corpora)
    def test_is_as_stored(corpus: str, tmp_path: Path) -> None:
        words = [sys.executable, make.__file__, "--check", corpus]
        run = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
        assert not run.returncode, run.stdout + run.stderr

    return test_is_as_stored
