"""The touches of a run as a data set: what the sensor read, the truth, and what our reader said.

Folder of a run -> `dataset.npz`, arrays of one entry a touch:

::

    counts (N, rows, columns) u16    what the sensor read
    number, kind, level, test        of the touch; test: belongs to the fifth that is kept apart
    label (N,) i64                   number in `names` of the face touched; -1: none of the set
    names (L,)                       "Object/face"
    x_mm, y_mm, theta_rad            of the sensor on the face, face frame; NaN with label -1
    force_n, tilt_rad
    answer (N,) i64                  label that our reader gave; -1: it refused
    answer_x_mm, answer_y_mm, answer_theta_rad, margin

Under policy `next` these are the first touch of each. The same run gives the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.lab import EncodedFace, Lab
from recognizer.touch.recognise import recognise
from recognizer.validation.campaign import Work, series_of
from recognizer.validation.draw import DrawnTouch, draw_touch
from recognizer.validation.run import TouchProgress
from recognizer.validation.trial import NEAR_DEG, NEAR_MM, Trial, judge
from recognizer.validation.workers import prepare_reader

Array = NDArray[Any]
#: What answers are judged by.
JUDGED = ("label", "x_mm", "y_mm", "theta_rad", "answer", "answer_x_mm", "answer_y_mm",
          "answer_theta_rad")  # fmt: skip
#: Arrays of a data set, as they are written.
ORDER = ("counts", "number", "kind", "level", "test", "label", "x_mm", "y_mm", "theta_rad",
         "force_n", "tilt_rad", "answer", "answer_x_mm", "answer_y_mm", "answer_theta_rad",
         "margin")  # fmt: skip
TEST_EVERY = 5  #: every fifth touch is kept apart for testing


@dataclass(frozen=True, slots=True, eq=False)
class TouchDataset:
    """Touches, truth and answers; arrays under the names of the module."""

    arrays: dict[str, Array]
    pitch_mm: float  #: of the sensor's tactels
    description: dict[str, Any]  #: of the world, and what our reader reaches in it


def touch_dataset(work: Work, progress: TouchProgress) -> TouchDataset:
    """Return the touches of a run, drawn and read again by their numbers."""
    reader, campaign = prepare_reader(work), work.campaign
    series = series_of(campaign)[0]
    label_of = {name: label for label, name in enumerate(faces_by_name(reader.lab))}
    rows: list[dict[str, Any]] = []
    progress.begin("data set", series.touches, 0)
    for number in range(series.touches):
        plan = work.plan(series, number)
        found = draw_touch(plan, number, reader)
        answer = recognise(reader, reader.signal(found.counts), number)
        trial = judge(plan, number, found, answer, reader)
        T = np.full((4, 4), math.nan) if answer.T_face_probe is None else answer.T_face_probe
        row = truth_row(found, trial, label_of) | {
            "test": number % TEST_EVERY == TEST_EVERY - 1,
            "answer": label_of.get(trial.answer, -1),
            "answer_x_mm": T[0, 3],
            "answer_y_mm": T[1, 3],
            "answer_theta_rad": math.atan2(T[1, 0], T[0, 0]),
            "margin": trial.margin,
        }
        rows.append({name: row[name] for name in ORDER})
        progress.step("touches")
    arrays = {name: np.array([row[name] for row in rows]) for name in ORDER}
    description = {
        "seed": campaign.seed,
        "kinds": dict(campaign.kinds),
        "levels": dict(campaign.levels),
        "surfaces": campaign.surfaces,
        "engine": campaign.engine,
        "set": work.set_digest,
        "specs": [Path(spec).name for spec in work.specs],
        "baseline": baseline(arrays, arrays["test"]),
    }
    arrays["names"] = np.array(list(label_of))
    return TouchDataset(arrays, reader.sensor.pitch_mm, description)


def faces_by_name(lab: Lab) -> dict[str, EncodedFace]:
    """Return the registered faces by "Object/face", in order: a label is a face's number here."""
    faces = [one.face(number) for one in lab.arrays for number in range(len(one.faces))]
    named = {f"{face.object}/{face.face}": face for face in faces}
    return {name: named[name] for name in sorted(named)}


def truth_row(found: DrawnTouch, trial: Trial, label_of: dict[str, int]) -> dict[str, Any]:
    """Return what the sensor read, and the truth."""
    touched = trial.object != ""
    return {
        "counts": found.counts,
        "number": trial.number,
        "kind": trial.kind,
        "level": trial.level,
        "label": label_of.get(f"{trial.object}/{trial.face}", -1),
        "x_mm": trial.x_mm if touched else math.nan,
        "y_mm": trial.y_mm if touched else math.nan,
        "theta_rad": math.radians(trial.theta_deg) if touched else math.nan,
        "force_n": trial.force_n,
        "tilt_rad": math.radians(trial.tilt_deg),
    }


def errors_of_answers(
    arrays: Mapping[str, Array], truth: str = ""
) -> tuple[NDArray[np.bool_], Array]:
    """Return which answers are right (N,), and by how much they miss: (N, 3), x, y, mm, turn, rad.

    A right answer names the face, within `NEAR_MM` and `NEAR_DEG` of the truth, whose columns begin
    with `truth`.
    """
    x, y = (arrays[f"answer_{k}_mm"] - arrays[f"{truth}{k}_mm"] for k in "xy")
    turn = np.angle(np.exp(1j * (arrays["answer_theta_rad"] - arrays[f"{truth}theta_rad"])))
    near = (np.hypot(x, y) < NEAR_MM) & (np.degrees(np.abs(turn)) < NEAR_DEG)
    named = (arrays["answer"] >= 0) & (arrays["answer"] == arrays[f"{truth}label"])
    return named & near, np.stack([x, y, turn], axis=-1)


def baseline(arrays: dict[str, Array], chosen: Array) -> dict[str, Any]:
    """Return what our reader reaches on chosen touches: the number to beat.

    A right answer is one of `errors_of_answers`.
    """
    some = {name: arrays[name][chosen] for name in JUDGED}
    right, away = errors_of_answers(some)
    off, turn = np.hypot(away[:, 0], away[:, 1]), away[:, 2]
    answered = some["answer"] >= 0
    return {
        "touches": len(off),
        "of_the_set": int((some["label"] >= 0).sum()),
        "right": int(right.sum()),
        "wrong": int((answered & ~right).sum()),
        "refused": int((~answered).sum()),
        "rms_mm": _rms(off[right]),
        "rms_deg": _rms(np.degrees(turn[right])),
    }


def _rms(values: Array) -> float | None:
    return round(float(np.sqrt(np.mean(values**2))), 4) if len(values) else None
