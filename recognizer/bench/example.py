"""An example object for a lab that is still empty: `encode-object` makes and registers it.

Run as the command that it is, since what makes objects and what reads them share the database
alone.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from recognizer.bench.errors import BenchError
from recognizer.bench.settings import EXAMPLE

NAME = "Example"
SPEC = f"""# An example, made by open-bench.
name: {NAME}
shape: {{cube: 60 mm}}
"""


def make_example(folder: Path, database: str) -> str:
    """Make the example in a folder and register it; returns the object's name.

    Parameters
    ----------
    folder
        Gets `example.yaml` and `out/`.
    database
        URL, or a file's name in the folder.

    Raises
    ------
    BenchError
        `encode-object` could not make it; says why.
    """
    spec = folder / "example.yaml"
    try:
        if not spec.exists():
            spec.write_text(SPEC, encoding="utf-8")
        done = subprocess.run(  # noqa: S603, our own command
            [sys.executable, "-c", "from generator.command import main; main()", spec.name,
             "--database", database, "--json"],
            cwd=folder, capture_output=True, text=True, timeout=EXAMPLE.longest_s, check=False,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BenchError(f"no example could be made: {error}", fix="see that the folder can be "
                         "written, or make one by encode-object") from error  # fmt: skip
    if done.returncode:
        told = _error(done.stdout)
        raise BenchError(told.get("cause", "no example could be made"),
                         fix=told.get("fix", "make one by encode-object"))  # fmt: skip
    return NAME


def _error(text: str) -> dict[str, str]:
    try:
        return dict(json.loads(text)["error"])
    except (ValueError, KeyError, TypeError):
        return {}
