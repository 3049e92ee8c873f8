"""Whatever a file, a line or a page holds: it is read, or refused in words with its exit code.

The damage is that of `foreign`, by numbers; `tests/campaigns/fuzz.py` goes on where this ends.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import foreign
import pytest

CASES = {"step": 25, "database": 60, "import": 60, "command": 25, "spec": 250}  #: of a kind; others have `USUAL`
USUAL = 150


@pytest.fixture(scope="module")
def root():
    """A folder of cases; the page's session, if there is one, ends with it."""
    with tempfile.TemporaryDirectory(prefix="foreign-", dir=foreign.scratch()) as folder:
        yield Path(folder)
        while foreign._PAGE:
            foreign._PAGE.pop().close()


@pytest.mark.parametrize("kind", foreign.KINDS)
def test_what_comes_from_outside_is_read_or_refused(kind, root):
    foreign.prepare(kind, root)
    seen = set()
    for number in range(CASES.get(kind, USUAL)):
        outcome = foreign.attempt(kind, number, root)
        assert outcome.what not in foreign.FAULTS, (kind, number, outcome)
        seen.add(outcome.what)
    assert foreign.REFUSED in seen or kind in ("packets", "line")  # whose damage is counted
