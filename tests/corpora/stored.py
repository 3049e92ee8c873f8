"""Tests that what the code makes is what is stored: each corpus in a process of its own.

`make.py` sets what floating point and output depend on before anything is loaded. A corpus has a
file of tests of its own, as a process of pytest takes whole files. Parts that a corpus names `SLOW`
are left to the command.
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
        slow = getattr(make.module_of(corpus), "SLOW", ())
        parts = [one for one in make.parts_of(corpus) if one.partition("/")[2] not in slow]
        words = [sys.executable, make.__file__, "--check", *parts]
        run = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
        assert not run.returncode, run.stdout + run.stderr

    return test_is_as_stored
