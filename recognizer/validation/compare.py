"""Two runs side by side: what became better or worse, and what is the same within chance.

Folders -> lines, and a page. Shares differ if the difference exceeds what two samples of the
same share show in 95 % of all cases (Newcombe's interval, from the exact ones of both); root mean
squares, if it exceeds twice its standard error, 1/sqrt(4 n) of each.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from recognizer.validation.files import write_text
from recognizer.validation.finished import read_finished
from recognizer.validation.pictures import accuracy
from recognizer.validation.report import PAIR, environment

SAME, BETTER, WORSE = "same within chance", "better", "worse"


def compare_runs(first: Path, second: Path, output: Path | None) -> dict[str, Any]:
    """Compare two runs.

    Parameters
    ----------
    first, second
        Folders of runs that are done.
    output
        Page to write; None: none.

    Returns
    -------
    `lines`: name, value in A, value in B, word; `differ`: settings in which they differ.

    Raises
    ------
    ValidationError
        A folder holds no run that is done, or one of another version.
    """
    one, other = read_finished(first), read_finished(second)
    a, b, times = one.results, other.results, (one.times, other.times)
    found = {
        "lines": _lines(a, b, times),
        "differ": _differing_settings(a["provenance"], b["provenance"]),
    }
    if output is not None:
        page = environment().get_template(PAIR)
        text = page.render(a=a, b=b, found=found, pictures=(accuracy(a), accuracy(b)))
        write_text(output, text)
    return found


def _lines(
    a: dict[str, Any], b: dict[str, Any], times: tuple[dict[str, Any], dict[str, Any]]
) -> list[dict[str, Any]]:
    lines = [
        _share("wrong, all touches", a["totals"]["wrongly"], b["totals"]["wrongly"], least=True),
        _share("answered, enough symbols", a["enough"]["answered"], b["enough"]["answered"]),
    ]
    levels = {line["level"]: line for line in b["levels"]}
    for line in a["levels"]:
        other = levels.get(line["level"])
        if other is None:
            continue
        name = line["level"]
        lines.append(_share(f"answered, {name}", line["answered"], other["answered"]))
        for size, unit in (("rms_mm", "mm"), ("rms_deg", "degrees")):
            of = line["right"], other["right"]
            lines.append(_size(f"rms {unit}, {name}", line[size], other[size], of))
    kinds = {line["kind"]: line for line in b["kinds"] if not line["surface"]}
    for line in a["kinds"]:
        other = kinds.get(line["kind"])
        if not line["surface"] and other is not None and line["kind"] not in ("blank", "foreign"):
            lines.append(_share(f"answered, {line['kind']}", line["answered"], other["answered"]))
    one, two = (each["reading"]["median"] for each in times)
    lines.append({"name": "CPU to read a touch, ms, median", "a": one, "b": two, "word": ""})
    return lines


def _share(
    name: str, a: dict[str, Any], b: dict[str, Any], *, least: bool = False
) -> dict[str, Any]:
    """Return a line of two shares."""
    word = SAME
    if a["share"] is not None and b["share"] is not None:
        gap = b["share"] - a["share"]
        up = math.hypot(b["share"] - b["low"], a["high"] - a["share"])
        down = math.hypot(a["share"] - a["low"], b["high"] - b["share"])
        if gap > up or -gap > down:
            word = BETTER if (gap > 0) != least else WORSE
    return {"name": name, "a": a["share"], "b": b["share"], "word": word}


def _size(name: str, a: float | None, b: float | None, of: tuple[int, int]) -> dict[str, Any]:
    """Return a line of two root mean squares over so many answers each."""
    word = SAME
    if a is not None and b is not None:
        chance = 2 * math.hypot(a / math.sqrt(4 * of[0]), b / math.sqrt(4 * of[1]))
        if abs(b - a) > chance:
            word = BETTER if b < a else WORSE
    return {"name": name, "a": a, "b": b, "word": word}


def _differing_settings(a: dict[str, Any], b: dict[str, Any]) -> list[dict[str, str]]:
    """Return the settings in which two runs differ."""
    found = []
    for part in ("campaign", "versions"):
        for name in a[part] | b[part]:
            one, two = a[part].get(name), b[part].get(name)
            if one != two:
                found.append({"name": name, "a": _text(one), "b": _text(two)})
    if a["set"] != b["set"]:
        found.append({"name": "set", "a": a["set"], "b": b["set"]})
    return found


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
