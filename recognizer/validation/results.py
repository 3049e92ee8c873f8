"""All rows of a run -> what the report and `results.json` say. No time, no place, no machine.

The order is that of the report: verdict, kinds and levels, confusion, pose, what accuracy
depends on, margins, the worst touches. `precision`, `extremes` and `savings` add theirs.
"""

from __future__ import annotations

import re
from collections import Counter
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.simulate.world.levels import LEVELS
from recognizer.validation.campaign import ON_FACES, STRANGE
from recognizer.validation.settings import LIMITS
from recognizer.validation.statistics import (
    calibration,
    quantiles_of,
    rms,
    round_digits,
    share_of,
)
from recognizer.validation.trial import REJECTED, RIGHT, WRONG

Columns = dict[str, Any]
Mask = NDArray[np.bool_]

HOLDS, FAILS, UNTOLD = "holds", "fails", "too few touches to tell"  #: of a bound
WORST = 20
QUANTILES = (0.5, 0.9, 0.99, 1.0)

#: Edges of the bins of what accuracy is shown against, and the unit.
BINS: dict[str, tuple[str, list[float]]] = {
    "force_n": ("N", [20, 40, 60, 80, 100, 120]),
    "tilt_deg": ("degrees", [0, 0.5, 1, 1.5, 2]),
    "edge_mm": ("mm", [0, 3, 6, 9, 12, 15, 20, 30, 60]),
    "symbols": ("symbols", [0, 2, 4, 6, 8, 10, 12, 14, 16, 20, 30, 60]),
}


def results_of(rows: Columns) -> dict[str, Any]:
    """Return the results of all touches.

    Parameters
    ----------
    rows
        Columns of `rows.COLUMNS`, in the order of the numbers.
    """
    verdicts, kinds, levels = rows["verdict"], rows["kind"], rows["level"]
    whole = _membership_mask(kinds, [kind for kind in ON_FACES if kind != "worn"])
    fair = np.asarray(rows["enough"], bool)
    inside = kinds == "face"
    everything = np.ones(len(kinds), bool)
    return {
        "totals": line_of(rows, everything),
        "enough": line_of(rows, fair),
        "worlds": _worlds(rows),
        "verdict": _verdict(rows, fair),
        "kinds": [
            {
                "kind": kind,
                "surface": surface,
                **line_of(rows, (kinds == kind) & _surface_mask(rows, surface)),
            }
            for kind, surface in _kinds(rows)
        ],
        "levels": [
            {"level": level, **line_of(rows, (levels == level) & fair)}
            for level in LEVELS
            if ((levels == level) & fair).any()
        ],
        "objects": _confusion(rows, _membership_mask(kinds, list(ON_FACES))),
        "reasons": dict(sorted(Counter(rows["reason"][verdicts == REJECTED].tolist()).items())),
        "drawn_anew": _drawn_anew(rows),
        "pose": _pose(rows),
        "against": {
            name: {
                "unit": unit,
                "bins": _bins(rows, name, edges, inside if name in _INSIDE else whole),
            }
            for name, (unit, edges) in BINS.items()
        },
        "margins": _margins(rows),
        "worst": _worst_touches(rows, fair),
    }


_INSIDE = ("force_n", "tilt_deg")  # shown for touches inside faces; the others for whole faces


def _surface_mask(rows: Columns, surface: str) -> Mask:
    found: Mask = np.ones(len(rows["kind"]), bool) if not surface else rows["surface"] == surface
    return found


def _membership_mask(values: Any, names: list[str]) -> Mask:
    return np.array([value in names for value in values], bool)


def _kinds(rows: Columns) -> list[tuple[str, str]]:
    """Return every kind, foreign ones also by surface."""
    found = []
    for kind in dict.fromkeys((*ON_FACES, "blank", STRANGE)):
        here = rows["kind"] == kind
        if here.any():
            found.append((kind, ""))
        if kind == STRANGE:
            found += [(kind, name) for name in sorted(set(rows["surface"][here]))]
    return found


def line_of(rows: Columns, where: Mask) -> dict[str, Any]:
    """Return counts, shares and pose errors of some touches."""
    verdicts = rows["verdict"][where]
    right = where & (rows["verdict"] == RIGHT)
    count = {name: int((verdicts == name).sum()) for name in (RIGHT, WRONG, REJECTED)}
    return {
        "touches": len(verdicts),
        **count,
        "answered": share_of(count[RIGHT] + count[WRONG], len(verdicts)),
        "wrongly": share_of(count[WRONG], len(verdicts)),
        "rms_mm": rms(rows["error_mm"][right]),
        "rms_deg": rms(rows["error_deg"][right]),
    }


def _verdict(rows: Columns, fair: Mask) -> list[dict[str, Any]]:
    """Return each bound, what was found, and whether it holds."""
    everything = line_of(rows, np.ones(len(fair), bool))
    expected = line_of(rows, fair)
    strong = rows["level"] == LIMITS.hardest
    hard = line_of(rows, fair & strong) if (fair & strong).any() else expected
    under = "under strong mismatch" if (fair & strong).any() else "all levels"
    answered = expected["answered"]
    checks = [
        ("wrong answers, all touches", everything["wrongly"], "=", 0.0, ""),
        ("answered, of touches that show enough symbols", answered, ">=", LIMITS.answered, ""),
        (f"pose, rms, {under}", hard["rms_mm"], "<=", LIMITS.rms_mm, "mm"),
        (f"turn, rms, {under}", hard["rms_deg"], "<=", LIMITS.rms_deg, "degrees"),
    ]
    found = []
    for name, value, sign, bound, unit in checks:
        shown = value if isinstance(value, dict) else {"value": value}
        state = state_of(shown, sign, bound)
        line = {"name": name, "sign": sign, "bound": bound, "unit": unit,
                "holds": state == HOLDS, "state": state}  # fmt: skip
        found.append(line | shown)
    return found


def state_of(found: dict[str, Any], sign: str, bound: float) -> str:
    """Return whether a bound holds, fails, or the touches are too few to tell.

    A share that must be reached holds or fails when its whole 95 % interval does; a count that
    must be zero fails by one touch.
    """
    if "share" not in found:
        size = found["value"]
        return UNTOLD if size is None else HOLDS if size <= bound else FAILS
    if sign == "=":
        return HOLDS if found["count"] == bound else FAILS
    if found["low"] >= bound:
        return HOLDS
    return FAILS if found["high"] < bound else UNTOLD


def _confusion(rows: Columns, on_face: Mask) -> dict[str, Any]:
    """Return who was taken for whom: objects as a matrix, faces as the pairs that occurred."""
    names = sorted(set(rows["object"][on_face].tolist()), key=_natural_key)
    answers = [str(answer).rpartition("/")[0] for answer in rows["answer"]]
    place = {name: i for i, name in enumerate(names)}
    matrix = np.zeros((len(names), len(names) + 1), int)
    for i in np.flatnonzero(on_face).tolist():
        matrix[place[rows["object"][i]], place.get(answers[i], len(names))] += 1
    faces: dict[tuple[str, str], Counter[str]] = {}
    confused: Counter[tuple[str, str]] = Counter()
    for i in np.flatnonzero(on_face).tolist():
        key = (rows["object"][i], rows["face"][i])
        faces.setdefault(key, Counter())[rows["verdict"][i]] += 1
        if rows["verdict"][i] == WRONG:
            confused[f"{key[0]}/{key[1]}", rows["answer"][i]] += 1
    for i in np.flatnonzero(~on_face & (rows["verdict"] == WRONG)).tolist():
        confused[rows["surface"][i], rows["answer"][i]] += 1
    return {
        "names": names,
        "matrix": matrix.tolist(),
        "faces": [
            {"object": a, "face": b, **{v: count[v] for v in (RIGHT, WRONG, REJECTED)}}
            for (a, b), count in sorted(faces.items(), key=lambda one: [*map(_natural_key, one[0])])
        ],
        "confused": [
            {"touched": a, "answered": b, "count": n} for (a, b), n in sorted(confused.items())
        ],
    }


def _drawn_anew(rows: Columns) -> dict[str, int]:
    """Return how often a touch was drawn again because the plate found no rest, by reason."""
    found = Counter(why for text in rows["drawn_anew"] if text for why in text.split(" | "))
    return dict(sorted(found.items()))


def _natural_key(name: str) -> tuple[str | int, ...]:
    """Return a name's key in an order in which Box-2 comes before Box-10."""
    return tuple(int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name))


def _pose(rows: Columns) -> dict[str, Any]:
    """Return the distribution of pose errors, and how honest the covariance is."""
    right = rows["verdict"] == RIGHT
    found: dict[str, Any] = {"right": int(right.sum()), "quantiles": list(QUANTILES)}
    found["error_mm"] = quantiles_of(rows["error_mm"][right], QUANTILES)
    found["error_deg"] = quantiles_of(np.abs(rows["error_deg"][right]), QUANTILES)
    found["calibration"] = calibration(rows["chi2"][right])
    found["by_level"] = [
        {
            "level": level,
            "touches": int(here.sum()),
            "rms_mm": rms(rows["error_mm"][here]),
            "rms_deg": rms(rows["error_deg"][here]),
            "inside_95": calibration(rows["chi2"][here])[2],
        }
        for level in LEVELS
        if (here := right & (rows["level"] == level)).any()
    ]
    return found


def _worlds(rows: Columns) -> list[dict[str, Any]]:
    """Return what became of the touches of registered faces, by the sensor that felt them."""
    on_face = _membership_mask(rows["kind"], list(ON_FACES))
    return [
        {
            "level": level,
            **line_of(rows, here),
            "inside_95": calibration(rows["chi2"][here & (rows["verdict"] == RIGHT)])[2],
        }
        for level in LEVELS
        if (here := on_face & (rows["level"] == level)).any()
    ]


def _bins(rows: Columns, name: str, edges: list[float], where: Mask) -> list[dict[str, Any]]:
    found = []
    last = edges[-2]
    for low, high in pairwise(edges):
        values = rows[name]
        inside = where & (values >= low) & ((values < high) | (low == last) & (values <= high))
        if inside.any():
            found.append({"low": low, "high": high, **line_of(rows, inside)})
    return found


def _margins(rows: Columns) -> dict[str, Any]:
    """Return the distribution of the margins of right, wrong and refused answers."""
    at = (0.01, 0.1, 0.5, 0.9)
    found: dict[str, Any] = {"quantiles": list(at)}
    for verdict in (RIGHT, WRONG, REJECTED):
        margins = rows["margin"][rows["verdict"] == verdict]
        finite = margins[np.isfinite(margins)]
        found[verdict] = {
            "touches": len(margins),
            "weighed": len(finite),
            "margin": quantiles_of(finite, at),
        }
    return found


def _worst_touches(rows: Columns, fair: Mask) -> list[dict[str, Any]]:
    """Return the worst touches: wrong ones; then unanswered and farthest off, one by one."""
    verdict, error = rows["verdict"], np.nan_to_num(rows["error_mm"])
    wrong = np.flatnonzero(verdict == WRONG)
    unanswered = np.flatnonzero(fair & (verdict == REJECTED))
    unanswered = unanswered[np.argsort(-rows["symbols"][unanswered], kind="stable")]
    right = np.flatnonzero(verdict == RIGHT)
    far = right[np.argsort(-error[right], kind="stable")]
    chosen = wrong.tolist()[:WORST]
    for pair in range(WORST):
        chosen += [*unanswered[pair : pair + 1].tolist(), *far[pair : pair + 1].tolist()]
    keep = ("number", "kind", "surface", "level", "object", "face", "symbols", "verdict",
            "reason", "answer", "force_n", "tilt_deg", "edge_mm", "error_mm", "error_deg",
            "margin")  # fmt: skip
    return [{name: _json_value(rows[name][i]) for name in keep} for i in chosen[:WORST]]


def _json_value(value: Any) -> Any:
    """Return a value as JSON has it: null for what is no number."""
    plain = value.item() if hasattr(value, "item") else value
    if isinstance(plain, float):
        return round_digits(plain) if np.isfinite(plain) else None
    return plain
