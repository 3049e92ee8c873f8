"""All rows of a run -> the results of its report and `results.json`. No time, no place, no machine.

The order is that of the report: worlds and verdict, kinds and levels, confusion and faces, pose,
what accuracy depends on, margins, the worst touches. A world is who computed the contact, what was
touched, and which sensor. CPU times are in `times.json`, because no two runs agree in them.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from itertools import pairwise, zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recognizer.validation.campaign import Campaign
from recognizer.validation.statistics import (
    FAILS,
    HOLDS,
    calibration,
    inside_of,
    normalised_errors,
    quantiles_of,
    rms,
    round_digits,
    share_of,
    size_of,
    state_of,
)
from recognizer.validation.trial import MOST, NEXT, REJECTED, RIGHT, WRONG

# What a campaign must reach (design, section 4); no answer may be wrong.
ANSWERED = 0.995  #: of the touches that show enough symbols
RMS_MM, RMS_DEG = 0.1, 0.3  #: place and turn, at the level `HARDEST`
INSIDE = (0.90, 0.98)  #: of the errors inside the 95 % ellipsoid
FACE_ANSWERED = 0.5  #: of all touches of a face; with less, the face is no use
HARDEST = "mismatch"  #: wrong in everything at once

FORMAT = 3  #: of `results.json`; 2 had no normalised errors
WORST = 20
QUANTILES = (0.5, 0.9, 0.99, 1.0)

#: What accuracy is shown against: unit, edges of the bins, whether only for touches inside faces.
BINS: dict[str, tuple[str, list[float], bool]] = {
    "force_n": ("N", [20, 40, 60, 80, 100, 120], True),
    "tilt_deg": ("degrees", [0, 0.5, 1, 1.5, 2], True),
    "edge_mm": ("mm", [0, 3, 6, 9, 12, 15, 20, 30, 60], False),
    "symbols": ("symbols", [0, 2, 4, 6, 8, 10, 12, 14, 16, 20, 30, 60], False),
}
SURFACES = {"files": "written files", "database": "registered faces"}
ALL = "all of them"  #: sensors

Columns = dict[str, Any]  #: of `trial.COLUMNS`
Mask = NDArray[np.bool_]


def line_of(rows: Columns, where: Mask) -> dict[str, Any]:
    """Return counts, shares, pose errors and the state of some touches.

    `answered` and `wrongly` are shares of all these touches, `expected` of those that show enough
    symbols; `rms_mm` and `rms_deg` are of the right answers, `rms_mm_95` and `rms_deg_95` their
    intervals; `inside_95` is how many of these errors lie inside the answer's own 95 % ellipsoid;
    `normalised` these errors squared over the answer's variances; `drawn_anew` counts draws that
    were no touch. `state` fails by one wrong answer, and where fewer than `ANSWERED` of the touches
    with enough symbols are answered; `inside_state` by `INSIDE`; both are empty where no bound
    applies.
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
        "normalised": normalised_errors(rows["chi2"][right]),
        "drawn_anew": _resampled(rows, where),
    }
    expected, inside = line["expected"], line["inside_95"]
    state = FAILS if line["wrong"] else state_of(expected, ">=", ANSWERED) if expected["of"] else ""
    inside_state = state_of(inside, "within", *INSIDE) if inside["of"] else ""
    return line | {"state": state, "inside_state": inside_state}


def _resampled(rows: Columns, where: Mask) -> int | None:
    """Return how many draws were no touch; None for rows of a version that did not count."""
    texts: list[str | None] = rows["drawn_anew"][where].tolist() if "drawn_anew" in rows else [None]
    if None in texts:
        return None
    return sum(text.count(" | ") + 1 for text in texts if text)


def _worlds(rows: Columns, campaign: Mapping[str, Any]) -> Iterator[tuple[dict[str, Any], Mask]]:
    """Yield the worlds of a run (engine, surface, sensor, registered) and their rows.

    Touches of registered faces are grouped by the level of the sensor; touches of surfaces that no
    database knows by their kind, where every answer is wrong.
    """
    engine, surface = campaign["engine"], surface_name(campaign)
    registered = rows["object"] != ""
    for level in names_in(rows["level"][registered], campaign["levels"]):
        world = {"engine": engine, "surface": surface, "sensor": level, "registered": True}
        yield world, registered & (rows["level"] == level)
    for kind in names_in(rows["kind"][~registered], campaign["kinds"]):
        world = {"engine": engine, "surface": kind, "sensor": ALL, "registered": False}
        yield world, ~registered & (rows["kind"] == kind)


def worlds_of(rows: Columns, campaign: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a line for each world, with the states of its bounds; "" where none can be judged."""
    found = []
    for world, where in _worlds(rows, campaign):
        line = world | line_of(rows, where)
        states = {"expected": line["state"]}
        for name, bound in (("mm", RMS_MM), ("deg", RMS_DEG)):
            size = _size_found(line, name)
            states[f"rms_{name}"] = state_of(size, "<=", bound) if line["right"] else ""
        found.append(line | {"states": states | {"inside_95": line["inside_state"]}})
    return found


def world_times(
    rows: Columns, spent: Mapping[str, Any], campaign: Mapping[str, Any]
) -> list[dict[str, float]]:
    """Return mean CPU times of a touch, ms, in the order of `worlds_of`, from columns in s."""
    return [
        {
            name: round(1e3 * float(np.mean(spent[name][where])), 3)
            for name in ("drawing", "reading")
        }
        for _, where in _worlds(rows, campaign)
    ]


def names_in(values: Any, order: Any) -> list[str]:
    """Return the names that occur, in the order of the campaign's shares, others after them."""
    there = set(values.tolist())
    known = [name for name, _ in order if name in there]
    return known + sorted(there.difference(known))


def surface_name(campaign: Mapping[str, Any]) -> str:
    """Return in words what was touched; of prints also how they were made."""
    words = [SURFACES.get(campaign["surfaces"], campaign["surfaces"])]
    for key, word in (("faults", "faults"), ("print_profile", "by")):
        if campaign.get(key):
            words.append(f"{word} {campaign[key]}")
    return ", ".join(words)


def results_of(rows: Columns, campaign: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the results of all touches, in the order of their numbers.

    The campaign is as `results.json` has it; None: the usual one.
    """
    given = Campaign().as_json() if campaign is None else campaign
    verdicts, kinds, levels = rows["verdict"], rows["kind"], rows["level"]
    registered = rows["object"] != ""
    whole = registered & (kinds != "worn")
    fair = np.asarray(rows["enough"], bool)
    everything = np.ones(len(kinds), bool)
    policy = {"policy": _until_answered(rows, given)} if given.get("policy") == NEXT else {}
    return policy | {
        "format": FORMAT,
        "totals": line_of(rows, everything),
        "enough": line_of(rows, fair),
        "worlds": worlds_of(rows, given),
        "verdict": _verdict(rows, fair),
        "kinds": _kinds(rows, given["kinds"]),
        "levels": [
            {"level": level, **line_of(rows, (levels == level) & fair)}
            for level in names_in(levels[fair], given["levels"])
        ],
        "objects": _confusion(rows, registered),
        "reasons": dict(sorted(Counter(rows["reason"][verdicts == REJECTED].tolist()).items())),
        "drawn_anew": dict(sorted(Counter(
            why for text in rows["drawn_anew"] if text for why in text.split(" | ")
        ).items())),
        "pose": _pose(rows, given["levels"]),
        "against": {
            name: {
                "unit": unit,
                "bins": _bins(rows, rows[name], edges, kinds == "face" if inside else whole),
            }
            for name, (unit, edges, inside) in BINS.items()
        },
        "margins": _margins(rows),
        "worst": _worst_touches(rows, fair),
    }  # fmt: skip


def _until_answered(rows: Columns, given: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return how many touches it took until one was answered right, by kind; all faces first."""
    masks = [("all faces", rows["object"] != "")]
    masks += [(kind, rows["kind"] == kind) for kind in names_in(rows["kind"], given["kinds"])]
    found = []
    for kind, where in masks:
        verdicts, made = rows["verdict"][where], rows["touches"][where]
        within = [
            share_of(int(((verdicts == RIGHT) & (made <= n)).sum()), len(made))
            for n in range(1, MOST + 1)
        ]
        found.append(
            {
                "kind": kind,
                "touches": len(made),
                "within": within,
                "wrong": int((verdicts == WRONG).sum()),
                "made": round_digits(float(made.mean())) if len(made) else None,
            }
        )
    return found


def _kinds(rows: Columns, order: Any) -> list[dict[str, Any]]:
    """Return a line for every kind, and for each surface of those that have several."""
    found = []
    for kind in names_in(rows["kind"], order):
        of_kind = rows["kind"] == kind
        found.append({"kind": kind, "surface": "", **line_of(rows, of_kind)})
        surfaces = sorted(set(rows["surface"][of_kind].tolist()))
        for name in surfaces if len(surfaces) > 1 else ():
            line = line_of(rows, of_kind & (rows["surface"] == name))
            found.append({"kind": kind, "surface": name, **line})
    return found


def _verdict(rows: Columns, fair: Mask) -> list[dict[str, Any]]:
    """Return each bound, what was found, and whether it holds."""
    everything, expected = line_of(rows, np.ones(len(fair), bool)), line_of(rows, fair)
    strong = fair & (rows["level"] == HARDEST)
    hard, under = expected, "all levels"
    if strong.any():
        hard, under = line_of(rows, strong), "under strong mismatch"
    found = []
    for name, shown, sign, bound, upper, unit in (
        ("wrong answers, all touches", everything["wrongly"], "=", 0.0, None, ""),
        ("answered, of touches that show enough symbols", expected["answered"], ">=", ANSWERED,
         None, ""),
        (f"pose, rms, {under}", _size_found(hard, "mm"), "<=", RMS_MM, None, "mm"),
        (f"turn, rms, {under}", _size_found(hard, "deg"), "<=", RMS_DEG, None, "degrees"),
        ("right answers inside their own 95 % ellipsoid", everything["inside_95"], "within",
         *INSIDE, ""),
    ):  # fmt: skip
        state = state_of(shown, sign, bound, upper)
        line = {"name": name, "sign": sign, "bound": bound, "upper": upper, "unit": unit,
                "holds": state == HOLDS, "state": state}  # fmt: skip
        found.append(line | shown)
    return found


def _size_found(line: dict[str, Any], name: str) -> dict[str, Any]:
    """Return a root mean square as a bound is judged by."""
    low, high = line[f"rms_{name}_95"]
    return {"value": line[f"rms_{name}"], "of": line["right"], "low": low, "high": high}


def _confusion(rows: Columns, on_face: Mask) -> dict[str, Any]:
    """Return who was taken for whom: objects as a matrix, faces as the pairs that occurred."""
    names = sorted(set(rows["object"][on_face].tolist()), key=_natural_key)
    place = {name: i for i, name in enumerate(names)}
    matrix = np.zeros((len(names), len(names) + 1), int)
    faces: defaultdict[tuple[str, str], list[int]] = defaultdict(list)
    confused: Counter[tuple[str, str]] = Counter()
    for i, known in enumerate(on_face.tolist()):
        held, face, answer = rows["object"][i], rows["face"][i], str(rows["answer"][i])
        if known:
            matrix[place[held], place.get(answer.rpartition("/")[0], len(names))] += 1
            faces[held, face].append(i)
        if rows["verdict"][i] == WRONG:
            confused[f"{held}/{face}" if known else rows["surface"][i], answer] += 1
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


def _face(rows: Columns, numbers: list[int]) -> dict[str, Any]:
    """Return the line of a face, and whether it needs a look.

    It does if, of its touches that are not worn, its bound fails or too few are answered, even
    where no touch shows enough symbols.
    """
    here = {name: values[numbers] for name, values in rows.items()}
    whole = line_of(here, here["kind"] != "worn")
    few = state_of(whole["answered"], ">=", FACE_ANSWERED)
    return line_of(here, np.ones(len(numbers), bool)) | {"bad": FAILS in (whole["state"], few)}


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
            "normalised": normalised_errors(rows["chi2"][here]),
        }
        for level in names_in(rows["level"][right], order)
        if (here := right & (rows["level"] == level)).any()
    ]
    return found


def _bins(rows: Columns, values: Any, edges: list[float], where: Mask) -> list[dict[str, Any]]:
    found = []
    for low, high in pairwise(edges):
        inside = (
            where & (values >= low) & ((values < high) | (high == edges[-1]) & (values == high))
        )
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
    pairs = zip_longest(unanswered[:WORST].tolist(), far[:WORST].tolist())
    chosen = [*wrong.tolist()[:WORST], *(i for pair in pairs for i in pair if i is not None)]
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
