"""The commands as people run them: those that `pyproject.toml` names, of this tree."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
SCRIPTS: dict[str, str] = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]


def run(
    program: str, *arguments: object, folder: Path, variables: Mapping[str, str] | None = None
) -> str:
    """Run a command in a folder and return its stdout; exit code 1 is an answer, too.

    Raises
    ------
    RuntimeError
        Another exit code than 0 and 1.
    """
    module, _, function = SCRIPTS[program].partition(":")
    code = f"import sys; from {module} import {function}; sys.exit({function}())"
    words = [sys.executable, "-c", code, *map(str, arguments)]
    environment = os.environ | (variables or {})
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{program} {arguments}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout
