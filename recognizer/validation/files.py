"""Files of a run that appear under their names whole, or not at all."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any


@contextmanager
def whole_file(path: Path) -> Iterator[IO[bytes]]:
    """Yield a file that gets its name when all of it is on the disk."""
    path.parent.mkdir(parents=True, exist_ok=True)
    undone = path.with_name(path.name + ".writing")
    with undone.open("wb") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())
    undone.replace(path)


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    with whole_file(path) as file:
        file.write(text.encode())


def write_json(path: Path, values: Any) -> None:
    """Write values as JSON."""
    write_text(path, json.dumps(values, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
