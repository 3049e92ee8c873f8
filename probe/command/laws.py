"""A calibration in words: sensor, loads, unsound tactels, and how well forces are known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.calibration import Calibration, Condition, calibrate_image, expected_counts
from probe.calibration.condition import tactel_words

_SHARES = (0.1, 0.3, 1.0)  # of the largest load: where the uncertainty is stated


def describe_laws(
    found: Calibration, digest: str, name: str
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return a calibration as values, and as lines to read."""
    alive = ~found.bad
    most_n = float(np.nanmedian(found.most_n)) if alive.any() else math.nan
    errors = [_uncertainty(found, share * most_n) for share in _SHARES] if alive.any() else []
    unsound = {
        condition.name.lower(): found.condition == condition
        for condition in Condition
        if condition != Condition.SOUND
    }
    values = {
        "file": name,
        "hash": digest,
        "sensor": found.sensor,
        "made": found.made,
        "board": None if found.board is None else found.board.readout,
        "loads": list(found.loads),
        "sound": int((found.condition == Condition.SOUND).sum()),
        **{title: np.argwhere(where) for title, where in unsound.items()},
        "scatter": found.scatter,
        "uncertainty": [
            {"force_n": force, "median": median, "worst_of_95": worst}
            for force, median, worst in errors
        ],
    }
    lines = {
        "calibration": name,
        "hash": digest,
        "sensor": found.sensor or "not named",
        "made": found.made or "not dated",
        "board": "none: counts above the bias" if found.board is None
        else f"{found.board.readout}, {found.board.bits} bits",
        "loads": ", ".join(found.loads),
        "sound": f"{values['sound']} of {alive.size} tactels",
        **{title: places(where) for title, where in unsound.items() if where.any()},
        "fit": f"{found.scatter:.2f} (loads miss the law by so many of their errors)",
    }  # fmt: skip
    for force, median, worst in errors:
        lines[f"at {force:.2g} N"] = (
            f"+-{100 * median:.1f} % in one frame, of 95 % of the tactels +-{100 * worst:.1f} %"
        )
    return values, lines


def condition_map(found: Calibration) -> str:
    """Return the matrix in letters: . sound, D dead, S stuck, P preloaded, H hidden."""
    rows = (" ".join(Condition(int(value)).letter for value in row) for row in found.condition)
    return "\n".join(rows) + "\n. sound  D dead  S stuck  P preloaded  H hidden"


def _uncertainty(found: Calibration, force_n: float) -> tuple[float, float, float]:
    """Return a force, and its relative error in one frame: median, and 95 % of the tactels."""
    forces = np.full(found.shape, force_n)
    read = calibrate_image(expected_counts(forces, found), found)
    errors = (read.sigma / force_n)[~read.bad]
    if not errors.size:
        return force_n, math.inf, math.inf
    return force_n, float(np.median(errors)), float(np.quantile(errors, 0.95))


def places(where: NDArray[np.bool_]) -> str:
    """Return tactels in words; empty if there are none."""
    return tactel_words(where) if where.any() else ""
