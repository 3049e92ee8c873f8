"""Finished runs side by side: two compared, or the worlds of several on one page.

Folders -> lines, and a page. Shares differ if the difference exceeds what two samples of one
share show in 95 % of all cases (Newcombe's interval, from the exact ones of both); root mean
squares, if it exceeds twice its standard error, 1/sqrt(4 n) of each. Worlds are not counted
together: they differ, and their numbers of touches do.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from recognizer.validation.errors import ValidationError
from recognizer.validation.files import write_json, write_text
from recognizer.validation.pictures import accuracy, draw_answers, draw_errors
from recognizer.validation.report import RESULTS, TIMES_FILE, environment, require_report
from recognizer.validation.results import FORMAT

PAIR, WORLDS = "compare.html.j2", "worlds.html.j2"  #: templates
SAME, BETTER, WORSE = "same within chance", "better", "worse"


def read_finished(folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return results and times of a folder's run.

    Raises ValidationError: the folder holds no run that is done, or its results are of another
    version.
    """
    results, times = _read_json(folder, RESULTS), _read_json(folder, TIMES_FILE)
    if results.get("format") != FORMAT:
        raise ValidationError(
            f"results of format {results.get('format', 1)}, this version reads {FORMAT}",
            fix=f"make them anew: validate-set report {folder}",
            place=str(folder),
        )
    return results, times


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


def compare_runs(first: Path, second: Path, output: Path | None) -> dict[str, Any]:
    """Compare two runs by their folders, and write a page if `output` is given.

    Returns
    -------
    `lines`: name, value in A, value in B, word; `differ`: settings in which they differ.

    Raises
    ------
    ValidationError
        As `read_finished`.
    """
    (a, a_times), (b, b_times) = read_finished(first), read_finished(second)
    lines = _lines(a, b)
    one, two = (times["reading"]["median"] for times in (a_times, b_times))
    lines.append({"name": "CPU to read a touch, ms, median", "a": one, "b": two, "word": ""})
    found = {"lines": lines, "differ": _differing_settings(a["provenance"], b["provenance"])}
    if output is not None:
        page = environment().get_template(PAIR)
        text = page.render(a=a, b=b, found=found, pictures=(accuracy(a), accuracy(b)))
        write_text(output, text)
    return found


def _lines(a: dict[str, Any], b: dict[str, Any]) -> list[dict[str, Any]]:
    lines = [
        compare_shares("wrong, all touches", a["totals"]["wrongly"], b["totals"]["wrongly"],
                       least=True),
        compare_shares("answered, enough symbols", a["enough"]["answered"],
                       b["enough"]["answered"]),
    ]  # fmt: skip
    levels = {line["level"]: line for line in b["levels"]}
    for one in a["levels"]:
        name, two = one["level"], levels.get(one["level"])
        if two is not None:
            lines.append(compare_shares(f"answered, {name}", one["answered"], two["answered"]))
            of = one["right"], two["right"]
            for size, unit in (("rms_mm", "mm"), ("rms_deg", "degrees")):
                lines.append(compare_sizes(f"rms {unit}, {name}", one[size], two[size], of))
    kinds = {line["kind"]: line for line in b["kinds"] if not line["surface"]}
    for one in a["kinds"]:
        name, two = one["kind"], kinds.get(one["kind"])
        if not one["surface"] and two is not None and name not in ("blank", "foreign"):
            lines.append(compare_shares(f"answered, {name}", one["answered"], two["answered"]))
    return lines


def compare_shares(
    name: str, a: dict[str, Any], b: dict[str, Any], *, least: bool = False
) -> dict[str, Any]:
    """Return a line of two shares; `least`: less of it is better."""
    word = SAME
    if a["share"] is not None and b["share"] is not None:
        gap = b["share"] - a["share"]
        up = math.hypot(b["share"] - b["low"], a["high"] - a["share"])
        down = math.hypot(a["share"] - a["low"], b["high"] - b["share"])
        if gap > up or -gap > down:
            word = BETTER if (gap > 0) != least else WORSE
    return {"name": name, "a": a["share"], "b": b["share"], "word": word}


def compare_sizes(
    name: str, a: float | None, b: float | None, of: tuple[int, int]
) -> dict[str, Any]:
    """Return a line of two root mean squares over so many answers each."""
    word = SAME
    if a is not None and b is not None:
        chance = 2 * math.hypot(a / math.sqrt(4 * of[0]), b / math.sqrt(4 * of[1]))
        if abs(b - a) > chance:
            word = BETTER if b < a else WORSE
    return {"name": name, "a": a, "b": b, "word": word}


def _differing_settings(a: dict[str, Any], b: dict[str, Any]) -> list[dict[str, str]]:
    both = [
        (name, a[part].get(name), b[part].get(name))
        for part in ("campaign", "versions")
        for name in a[part] | b[part]
    ]
    both.append(("set", a["set"], b["set"]))
    return [
        {"name": name, "a": _text(one), "b": _text(two)} for name, one, two in both if one != two
    ]


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def join_runs(folders: Sequence[Path], page: Path | None) -> dict[str, Any]:
    """Return the worlds of several runs; `page` (HTML) and its JSON are written if it is given.

    Returns
    -------
    `runs`: name (a letter), command, versions; `worlds`: a line of `results.worlds_of` each, with
    the run's name and the CPU times of a touch (`drawing_ms`, `reading_ms`).

    Raises
    ------
    ValidationError
        As `read_finished`; or a folder is named twice.
    """
    if not folders:
        raise ValidationError("no run is named", fix="give the folders that -o named")
    places = [folder.resolve() for folder in folders]
    for place in places:
        if places.count(place) > 1:
            raise ValidationError("stands twice", fix="name every run once", place=place.name)
    listed, worlds = [], []
    for number, folder in enumerate(folders):
        (results, times), name = read_finished(folder), run_name(number)
        provenance = results["provenance"]
        listed.append({"run": name, "command": provenance["command"],
                       "touches": results["totals"]["touches"],
                       "versions": provenance["versions"], "set": provenance["set"]})  # fmt: skip
        for line, spent in zip(results["worlds"], times["worlds"], strict=True):
            ms = {f"{part}_ms": value for part, value in spent.items()}
            worlds.append({"run": name, **line, **ms})
    found = {"runs": listed, "worlds": worlds}
    if page is not None:
        require_report("validate-set worlds")
        text = (
            environment()
            .get_template(WORLDS)
            .render(**found, pictures=(draw_answers(worlds), draw_errors(worlds)))
        )
        write_text(page, text)
        write_json(page.with_suffix(".json"), found)
    return found


def run_name(number: int) -> str:
    """Return A, B ... Z, A2, B2 ...

    Examples
    --------
    >>> run_name(0), run_name(25), run_name(26)
    ('A', 'Z', 'A2')
    """
    again, letter = divmod(number, 26)
    return chr(ord("A") + letter) + (str(again + 1) if again else "")
