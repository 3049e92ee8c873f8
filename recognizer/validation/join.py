"""Finished runs of different worlds on one page, and in one JSON file beside it.

Folders -> lines, a line for each world: engine, surface, sensor; and the command that made each
run. Nothing is counted together: worlds differ, and so do the numbers of their touches.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from recognizer.validation.errors import ValidationError
from recognizer.validation.files import write_json, write_text
from recognizer.validation.finished import FinishedRun, read_finished
from recognizer.validation.report import environment, require_report
from recognizer.validation.world_pictures import draw_answers, draw_errors

PAGE = "worlds.html.j2"


def join_runs(folders: Sequence[Path], page: Path | None) -> dict[str, Any]:
    """Return the worlds of several runs.

    Parameters
    ----------
    folders
        Of runs that are done.
    page
        HTML to write; JSON goes beside it under the same name. None: nothing is written.

    Returns
    -------
    `runs`: name (a letter), command, versions; `worlds`: a line of `worlds.worlds_of` each, with
    the run's name and the CPU times of a touch (`drawing_ms`, `reading_ms`).

    Raises
    ------
    ValidationError
        A folder holds no run that is done, or one of another version; or one stands twice.
    """
    if not folders:
        raise ValidationError("no run is named", fix="give the folders that -o named")
    places = [folder.resolve() for folder in folders]
    for place in places:
        if places.count(place) > 1:
            raise ValidationError("stands twice", fix="name every run once", place=place.name)
    found = join_finished([read_finished(folder) for folder in folders])
    if page is not None:
        require_report("validate-set worlds")
        pictures = draw_answers(found["worlds"]), draw_errors(found["worlds"])
        text = environment().get_template(PAGE).render(**found, pictures=pictures)
        write_text(page, text)
        write_json(page.with_suffix(".json"), found)
    return found


def join_finished(runs: Sequence[FinishedRun]) -> dict[str, Any]:
    """Return the worlds of runs, in their order."""
    told, worlds = [], []
    for number, run in enumerate(runs):
        name = run_name(number)
        provenance = run.results["provenance"]
        touches = run.results["totals"]["touches"]
        told.append({"run": name, "command": run.command, "touches": touches,
                     "versions": provenance["versions"], "set": provenance["set"]})  # fmt: skip
        for line, spent in zip(run.results["worlds"], run.times["worlds"], strict=True):
            ms = {f"{part}_ms": value for part, value in spent.items()}
            worlds.append({"run": name, **line, **ms})
    return {"runs": told, "worlds": worlds}


def run_name(number: int) -> str:
    """Return A, B ... Z, A2, B2 ...

    Examples
    --------
    >>> run_name(0), run_name(25), run_name(26)
    ('A', 'Z', 'A2')
    """
    again, letter = divmod(number, 26)
    return chr(ord("A") + letter) + (str(again + 1) if again else "")
