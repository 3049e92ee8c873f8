"""Whether the files that the database names are there, and still what was written."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import URL

from generator.database.registered import RegisteredPart
from generator.database.url import part_path


@dataclass(frozen=True, slots=True)
class PartState:
    """A part's file, as it is now."""

    part: RegisteredPart
    path: Path
    state: str  #: ok, missing, changed, or unreadable


def part_state(url: URL, part: RegisteredPart) -> PartState:
    """Compare a part's file with the SHA-256 under which it is registered."""
    path = part_path(url, part.file)
    try:
        with open(path, "rb") as file:
            same = hashlib.file_digest(file, "sha256").hexdigest() == part.sha256
        state = "ok" if same else "changed"
    except (FileNotFoundError, NotADirectoryError):
        state = "missing"
    except OSError:
        state = "unreadable"
    return PartState(part, path, state)
