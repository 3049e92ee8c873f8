"""All rows of a run -> what the report and `results.json` say. No time, no place, no machine.

The order is that of the report: worlds and verdict, kinds and levels, confusion and faces, pose,
what accuracy depends on, margins, the worst touches. `precision`, `extremes` and `savings` add
theirs. CPU times are in `times.json`, because no two runs agree in them.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np

from recognizer.validation.bounds import HOLDS, state_of
from recognizer.validation.campaign import Campaign
from recognizer.validation.lines import Columns, Mask, face_is_bad, line_of
from recognizer.validation.policy import NEXT
from recognizer.validation.settings import LIMITS, POLICIES
from recognizer.validation.statistics import (
    calibration,
    inside_of,
    quantiles_of,
    rms,
    round_digits,
    share_of,
)
from recognizer.validation.trial import REJECTED, RIGHT, WRONG
from recognizer.validation.worlds import names_in, worlds_of

FORMAT = 2  #: of `results.json`; 1 knew no states of lines and no intervals of errors
WORST = 20
QUANTILES = (0.5, 0.9, 0.99, 1.0)

#: Edges of the bins of what accuracy is shown against, and the unit.
BINS: dict[str, tuple[str, list[float]]] = {
    "force_n": ("N", [20, 40, 60, 80, 100, 120]),
    "tilt_deg": ("degrees", [0, 0.5, 1, 1.5, 2]),
    "edge_mm": ("mm", [0, 3, 6, 9, 12, 15, 20, 30, 60]),
    "symbols": ("symbols", [0, 2, 4, 6, 8, 10, 12, 14, 16, 20, 30, 60]),
}


def results_of(rows: Columns, campaign: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the results of all touches.

    Parameters
    ----------
    rows
        Columns of `rows.COLUMNS`, in the order of the numbers.
    campaign
        As `results.json` has it; None: the usual one.
    """
    asked = asdict(Campaign()) if campaign is None else campaign
    verdicts, kinds, levels = rows["verdict"], rows["kind"], rows["level"]
    registered = rows["object"] != ""
    whole = registered & (kinds != "worn")
    fair = np.asarray(rows["enough"], bool)
    inside = kinds == "face"
    everything = np.ones(len(kinds), bool)
    policy = {"policy": _until_answered(rows, asked)} if asked.get("policy") == NEXT else {}
    return policy | {
        "format": FORMAT,
        "totals": line_of(rows, everything),
        "enough": line_of(rows, fair),
        "worlds": worlds_of(rows, asked),
        "verdict": _verdict(rows, fair),
        "kinds": [
            {
                "kind": kind,
                "surface": surface,
                **line_of(rows, (kinds == kind) & _surface_mask(rows, surface)),
            }
            for kind, surface in _kinds(rows, asked["kinds"])
        ],
        "levels": [
            {"level": level, **line_of(rows, (levels == level) & fair)}
            for level in names_in(levels[fair], asked["levels"])
        ],
        "objects": _confusion(rows, registered),
        "reasons": dict(sorted(Counter(rows["reason"][verdicts == REJECTED].tolist()).items())),
        "drawn_anew": _drawn_anew(rows),
        "pose": _pose(rows, asked["levels"]),
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


def _until_answered(rows: Columns, asked: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return how many touches it took until one was answered right, by kind; all faces first."""
    right = rows["verdict"] == RIGHT
    registered = rows["object"] != ""
    found = []
    masks = [("all faces", registered)]
    masks += [(kind, rows["kind"] == kind) for kind in names_in(rows["kind"], asked["kinds"])]
    for kind, where in masks:
        within = [
            share_of(int((where & right & (rows["touches"] <= n)).sum()), int(where.sum()))
            for n in range(1, POLICIES.most + 1)
        ]
        made = rows["touches"][where]
        found.append(
            {
                "kind": kind,
                "touches": int(where.sum()),
                "within": within,
                "wrong": int((where & (rows["verdict"] == WRONG)).sum()),
                "made": round_digits(float(made.mean())) if len(made) else None,
            }
        )
    return found


_INSIDE = ("force_n", "tilt_deg")  # shown for touches inside faces; the others for whole faces


def _surface_mask(rows: Columns, surface: str) -> Mask:
    found: Mask = np.ones(len(rows["kind"]), bool) if not surface else rows["surface"] == surface
    return found


def _kinds(rows: Columns, order: Any) -> list[tuple[str, str]]:
    """Return every kind, those of several surfaces also by surface."""
    found = []
    for kind in names_in(rows["kind"], order):
        found.append((kind, ""))
        surfaces = sorted(set(rows["surface"][rows["kind"] == kind].tolist()))
        found += [(kind, name) for name in surfaces if len(surfaces) > 1]
    return found


def _verdict(rows: Columns, fair: Mask) -> list[dict[str, Any]]:
    """Return each bound, what was found, and whether it holds."""
    everything = line_of(rows, np.ones(len(fair), bool))
    expected = line_of(rows, fair)
    strong = rows["level"] == LIMITS.hardest
    hard = line_of(rows, fair & strong) if (fair & strong).any() else expected
    under = "under strong mismatch" if (fair & strong).any() else "all levels"
    mm, degrees = (_size_found(hard, name) for name in ("mm", "deg"))
    least, most = LIMITS.inside
    checks = [
        ("wrong answers, all touches", everything["wrongly"], "=", 0.0, None, ""),
        (_EXPECTED, expected["answered"], ">=", LIMITS.answered, None, ""),
        (f"pose, rms, {under}", mm, "<=", LIMITS.rms_mm, None, "mm"),
        (f"turn, rms, {under}", degrees, "<=", LIMITS.rms_deg, None, "degrees"),
        (_INSIDE_95, everything["inside_95"], "within", least, most, ""),
    ]
    found = []
    for name, shown, sign, bound, upper, unit in checks:
        state = state_of(shown, sign, bound, upper)
        line = {"name": name, "sign": sign, "bound": bound, "upper": upper, "unit": unit,
                "holds": state == HOLDS, "state": state}  # fmt: skip
        found.append(line | shown)
    return found


_EXPECTED = "answered, of touches that show enough symbols"
_INSIDE_95 = "right answers inside their own 95 % ellipsoid"


def _size_found(line: dict[str, Any], name: str) -> dict[str, Any]:
    """Return a root mean square as a bound is judged by."""
    low, high = line[f"rms_{name}_95"]
    return {"value": line[f"rms_{name}"], "of": line["right"], "low": low, "high": high}


def _confusion(rows: Columns, on_face: Mask) -> dict[str, Any]:
    """Return who was taken for whom: objects as a matrix, faces as the pairs that occurred."""
    names = sorted(set(rows["object"][on_face].tolist()), key=_natural_key)
    answers = [str(answer).rpartition("/")[0] for answer in rows["answer"]]
    place = {name: i for i, name in enumerate(names)}
    matrix = np.zeros((len(names), len(names) + 1), int)
    for i in np.flatnonzero(on_face).tolist():
        matrix[place[rows["object"][i]], place.get(answers[i], len(names))] += 1
    faces: dict[tuple[str, str], list[int]] = {}
    confused: Counter[tuple[str, str]] = Counter()
    for i in np.flatnonzero(on_face).tolist():
        key = (rows["object"][i], rows["face"][i])
        faces.setdefault(key, []).append(i)
        if rows["verdict"][i] == WRONG:
            confused[f"{key[0]}/{key[1]}", rows["answer"][i]] += 1
    for i in np.flatnonzero(~on_face & (rows["verdict"] == WRONG)).tolist():
        confused[rows["surface"][i], rows["answer"][i]] += 1
    return {
        "names": names,
        "matrix": matrix.tolist(),
        "faces": [
            {"object": a, "face": b, **_face(rows, faces[a, b])}
            for a, b in sorted(faces, key=lambda one: [*map(_natural_key, one)])
        ],
        "confused": [
            {"touched": a, "answered": b, "count": n} for (a, b), n in sorted(confused.items())
        ],
    }


def _drawn_anew(rows: Columns) -> dict[str, int]:
    """Return how often a touch was drawn again because the plate found no rest, by reason."""
    found = Counter(why for text in rows["drawn_anew"] if text for why in text.split(" | "))
    return dict(sorted(found.items()))


def _face(rows: Columns, numbers: list[int]) -> dict[str, Any]:
    """Return what became of the touches of a face, and whether it must be looked at."""
    here = {name: values[numbers] for name, values in rows.items()}
    whole = line_of(here, here["kind"] != "worn")
    return line_of(here, np.ones(len(numbers), bool)) | {"bad": face_is_bad(whole)}


def _natural_key(name: str) -> tuple[str | int, ...]:
    """Return a name's key in an order in which Box-2 comes before Box-10."""
    return tuple(int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name))


def _pose(rows: Columns, order: Any) -> dict[str, Any]:
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
            "inside_95": inside_of(rows["chi2"][here]),
        }
        for level in names_in(rows["level"][right], order)
        if (here := right & (rows["level"] == level)).any()
    ]
    return found


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
