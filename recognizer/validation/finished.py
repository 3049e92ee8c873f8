"""Results of a run that is done, as other runs are set beside it.

Folder -> `results.json` and `times.json` of this version's form, or a refusal that says how to
make them anew.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from recognizer.validation.errors import ValidationError
from recognizer.validation.finish import RESULTS, TIMES_FILE
from recognizer.validation.results import FORMAT


@dataclass(frozen=True, slots=True)
class FinishedRun:
    """What a run left."""

    results: dict[str, Any]
    times: dict[str, Any]

    @property
    def command(self) -> str:
        """The command that makes the run again."""
        return str(self.results["provenance"]["command"])


def read_finished(folder: Path) -> FinishedRun:
    """Return what a run left.

    Raises
    ------
    ValidationError
        The folder holds no run that is done, or its results are of another version.
    """
    results, times = _read_json(folder, RESULTS), _read_json(folder, TIMES_FILE)
    if results.get("format") != FORMAT:
        raise ValidationError(
            f"results of format {results.get('format', 1)}, this version reads {FORMAT}",
            fix=f"make them anew: validate-set report {folder}",
            place=str(folder),
        )
    return FinishedRun(results, times)


def _read_json(folder: Path, name: str) -> dict[str, Any]:
    try:
        values: dict[str, Any] = json.loads((folder / name).read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise ValidationError(
            f"no {name} of a run that is done",
            fix="name the folder that -o named; go on with a run by --resume",
            place=str(folder),
        ) from error
    return values
