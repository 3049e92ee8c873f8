"""A touch as a row of the results: what was drawn, what was answered, how far off.

Trial -> Row. Numbers are kept to the digits that mean something (`COLUMNS`), so that two
machines whose libraries differ in the last bit of a sum write the same bytes. CPU times are
in rows of their own, because no two runs agree in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.lab import EncodedFace, Lab
from recognizer.validation.settings import JUDGING
from recognizer.validation.trial import Trial

Row = dict[str, Any]

#: Names and kinds: text, whole, truth, or decimals after the point.
COLUMNS: dict[str, str | int] = {
    "number": "whole",
    "kind": "text",  #: as `campaign.KINDS` names it
    "surface": "text",  #: the kind, or which foreign surface
    "level": "text",
    "object": "text",  #: touched; empty for a foreign surface
    "face": "text",
    "x_mm": 6,
    "y_mm": 6,
    "theta_deg": 6,
    "force_n": 6,
    "tilt_deg": 6,
    "edge_mm": 6,
    "symbols": "whole",  #: registered ones whose centre lies under the sensor
    "enough": "truth",  #: whether that is enough (`JudgeSettings`)
    "verdict": "text",
    "reason": "text",
    "answer": "text",
    "error_mm": 6,
    "error_deg": 6,
    "chi2": 4,
    "margin": 4,
    "noise": 6,
    "touches": "whole",  #: until one was answered, or all that were made
    "drawn_anew": "text",  #: why touches before it were none, ` | ` between; usually empty
}


@dataclass(frozen=True, slots=True)
class CpuTime:
    """CPU seconds of a touch."""

    number: int
    drawing: float  #: surface, contact and reading of the sensor
    reading: float  #: by the recognizer


@dataclass(frozen=True, slots=True)
class SymbolsInView:
    """What of a face is under the sensor."""

    symbols: int
    enough: bool


def row_of(trial: Trial, kind: str, seen: SymbolsInView) -> Row:
    """Return the row of a trial, its numbers as they are kept."""
    row: Row = {}
    given: Row = {
        "kind": kind,
        "surface": trial.kind,
        "symbols": seen.symbols,
        "enough": seen.enough,
    }
    for name, what in COLUMNS.items():
        value = given[name] if name in given else getattr(trial, name)
        row[name] = round(float(value), what) + 0.0 if isinstance(what, int) else value
    return row


def symbols_in_view(lab: Lab, sensor: SensorType, trial: Trial) -> SymbolsInView:
    """Return how many symbols a touch had in view, and whether they were enough.

    Enough is `JudgeSettings.enough` times the cells of the array's window, on a face that is
    not worn.
    """
    found = find_face(lab, trial.object, trial.face)
    if found is None:
        return SymbolsInView(0, enough=False)
    face, window = found
    angle = np.radians(trial.theta_deg)
    c, s = np.cos(angle), np.sin(angle)
    own = (face.centres_mm - (trial.x_mm, trial.y_mm)) @ np.array([[c, -s], [s, c]])
    symbols = int((np.abs(own) < sensor.half_mm).all(axis=1).sum())
    return SymbolsInView(
        symbols, enough=trial.kind != "worn" and symbols >= JUDGING.enough * window
    )


def find_face(lab: Lab, object_name: str, face: str) -> tuple[EncodedFace, int] | None:
    """Return a face of the lab, and the cells of its array's window; None if it is foreign."""
    for encoding in lab.arrays:
        for object_id, name in encoding.names.items():
            if name != object_name:
                continue
            for number in np.flatnonzero(encoding.faces[:, 0] == object_id).tolist():
                held = encoding.face(number)
                if held.face == face:
                    return held, encoding.array.window[0] * encoding.array.window[1]
    return None
