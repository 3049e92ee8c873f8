"""Files of a run that appear under their names whole, or not at all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from encoded_objects.base.files import whole_file


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as file:
        file.write(text.encode())


def write_json(path: Path, values: Any) -> None:
    """Write values as JSON."""
    write_text(path, json.dumps(values, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
