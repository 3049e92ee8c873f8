"""Some touches as a line of a table: counts, shares and errors with their 95 % intervals.

Rows + which of them -> dict, as `results.json` has it. Every table of the report that counts
touches is made of such lines: by world, kind, level, face, force, reader.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from recognizer.validation.bounds import FAILS, state_of
from recognizer.validation.settings import LIMITS
from recognizer.validation.statistics import inside_of, share_of, size_of
from recognizer.validation.trial import REJECTED, RIGHT, WRONG

Columns = dict[str, Any]
Mask = NDArray[np.bool_]


def line_of(rows: Columns, where: Mask) -> dict[str, Any]:
    """Return counts, shares, pose errors and the state of some touches.

    Parameters
    ----------
    rows
        Columns of `rows.COLUMNS`.
    where
        (n,) which of them.

    Returns
    -------
    `answered` and `wrongly` are shares of all these touches, `expected` of those that show enough
    symbols; `rms_mm` and `rms_deg` are of the right answers, `rms_mm_95` and `rms_deg_95` their
    intervals; `inside_95` is how many of these errors lie inside the answer's own 95 % ellipsoid;
    `drawn_anew` counts draws that were no touch; `state` and `inside_state` are those of
    `state_of_line` and `inside_state`.
    """
    verdicts = rows["verdict"][where]
    right = where & (rows["verdict"] == RIGHT)
    fair = where & np.asarray(rows["enough"], bool)
    count = {name: int((verdicts == name).sum()) for name in (RIGHT, WRONG, REJECTED)}
    sizes = {name: size_of(rows[f"error_{name}"][right]) for name in ("mm", "deg")}
    line = {
        "touches": len(verdicts),
        **count,
        "answered": share_of(count[RIGHT] + count[WRONG], len(verdicts)),
        "wrongly": share_of(count[WRONG], len(verdicts)),
        "expected": share_of(int((fair & (rows["verdict"] != REJECTED)).sum()), int(fair.sum())),
        **{f"rms_{name}": size["rms"] for name, size in sizes.items()},
        **{f"rms_{name}_95": [size["low"], size["high"]] for name, size in sizes.items()},
        "inside_95": inside_of(rows["chi2"][right]),
        "drawn_anew": drawn_anew(rows, where),
    }
    return line | {"state": state_of_line(line), "inside_state": inside_state(line)}


def state_of_line(line: dict[str, Any]) -> str:
    """Return whether these touches keep the bounds; empty where nothing is asked of them.

    One wrong answer fails. Where touches show enough symbols, `LIMITS.answered` of them must be
    answered.
    """
    if line["wrong"]:
        return FAILS
    if line["expected"]["of"] == 0:
        return ""
    return state_of(line["expected"], ">=", LIMITS.answered)


def inside_state(line: dict[str, Any]) -> str:
    """Return whether as many errors lie inside the ellipsoid as should; empty without any."""
    if line["inside_95"]["of"] == 0:
        return ""
    return state_of(line["inside_95"], "within", *LIMITS.inside)


def face_is_bad(line: dict[str, Any]) -> bool:
    """Return whether a face must be looked at: its bound fails, or too few touches help.

    Parameters
    ----------
    line
        Of all touches of the face that are not worn; a face whose touches all show too few
        symbols is bad as well, though no answer is expected of it.
    """
    few = state_of(line["answered"], ">=", LIMITS.face_answered)
    return FAILS in (line["state"], few)


def drawn_anew(rows: Columns, where: Mask) -> int | None:
    """Return how many draws were no touch: the plate slipped off, or found no rest.

    None where nobody counted: rows of a version that did not.
    """
    if "drawn_anew" not in rows:
        return None
    texts: list[str | None] = rows["drawn_anew"][where].tolist()
    told = [text for text in texts if text is not None]
    if len(told) < len(texts):
        return None
    return sum(text.count(" | ") + 1 for text in told if text)
