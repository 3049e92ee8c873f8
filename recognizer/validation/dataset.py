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

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.files import whole_file
from recognizer.touch.recognise import recognise
from recognizer.validation.campaign import plan_of, series_of
from recognizer.validation.draw import draw_touch
from recognizer.validation.progress import TouchProgress
from recognizer.validation.record import RunRecord
from recognizer.validation.settings import JUDGING
from recognizer.validation.trial import judge
from recognizer.validation.work import prepare_reader

Array = NDArray[Any]
#: What answers are judged by.
JUDGED = ("label", "x_mm", "y_mm", "theta_rad", "answer", "answer_x_mm", "answer_y_mm",
          "answer_theta_rad")  # fmt: skip
TEST_EVERY = 5  #: every fifth touch is kept apart for testing


@dataclass(frozen=True, slots=True, eq=False)
class TouchDataset:
    """Touches, truth and answers; arrays under the names of the module."""

    arrays: dict[str, Array]
    pitch_mm: float  #: of the sensor's tactels
    description: dict[str, Any]  #: of the world, and what our reader reaches in it

    def __len__(self) -> int:
        return len(self.arrays["number"])


def touch_dataset(record: RunRecord, folder: Path, progress: TouchProgress) -> TouchDataset:
    """Return the touches of a run, drawn and read again by their numbers."""
    work = record.work_now(folder)
    reader = prepare_reader(work)
    series = series_of(record.campaign)[0]
    faces = [one.face(number) for one in reader.lab.arrays for number in range(len(one.faces))]
    names = sorted(f"{face.object}/{face.face}" for face in faces)
    label_of = {name: label for label, name in enumerate(names)}
    rows: list[dict[str, Any]] = []
    progress.begin("data set", series.touches, 0)
    for number in range(series.touches):
        kind, plan = plan_of(record.campaign, series, work.database, number, work.labs, work.prints)
        found = draw_touch(plan, number, reader)
        answer = recognise(reader, reader.signal(found.counts), number)
        trial = judge(plan, number, found, answer, 0.0)
        T = np.full((4, 4), math.nan) if answer.T_face_probe is None else answer.T_face_probe
        touched = trial.object != ""
        rows.append(
            {
                "counts": found.counts,
                "number": number,
                "kind": kind,
                "level": plan.level,
                "test": number % TEST_EVERY == TEST_EVERY - 1,
                "label": label_of.get(f"{trial.object}/{trial.face}", -1),
                "x_mm": trial.x_mm if touched else math.nan,
                "y_mm": trial.y_mm if touched else math.nan,
                "theta_rad": math.radians(trial.theta_deg) if touched else math.nan,
                "force_n": trial.force_n,
                "tilt_rad": math.radians(trial.tilt_deg),
                "answer": label_of.get(trial.answer, -1),
                "answer_x_mm": T[0, 3],
                "answer_y_mm": T[1, 3],
                "answer_theta_rad": math.atan2(T[1, 0], T[0, 0]),
                "margin": trial.margin,
            }
        )
        progress.step("touches")
    arrays = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    arrays["names"] = np.array(names)
    return TouchDataset(arrays, reader.sensor.pitch_mm, _described(record, arrays))


def baseline(arrays: dict[str, Array], chosen: Array) -> dict[str, Any]:
    """Return what our reader reaches on chosen touches: the number to beat.

    A right answer names the face, within `JUDGING.near_mm` and `JUDGING.near_deg` of the truth.
    """
    some = {name: arrays[name][chosen] for name in JUDGED}
    off = np.hypot(some["answer_x_mm"] - some["x_mm"], some["answer_y_mm"] - some["y_mm"])
    turn = np.abs(np.angle(np.exp(1j * (some["answer_theta_rad"] - some["theta_rad"]))))
    answered = some["answer"] >= 0
    near = (off < JUDGING.near_mm) & (np.degrees(turn) < JUDGING.near_deg)
    right = answered & (some["answer"] == some["label"]) & near
    return {
        "touches": len(off),
        "of_the_set": int((some["label"] >= 0).sum()),
        "right": int(right.sum()),
        "wrong": int((answered & ~right).sum()),
        "refused": int((~answered).sum()),
        "rms_mm": _rms(off[right]),
        "rms_deg": _rms(np.degrees(turn[right])),
    }


def write_npz(data: TouchDataset, folder: Path) -> Path:
    """Write the data set as one file of arrays; returns its name."""
    path = folder / "dataset.npz"
    arrays: dict[str, Any] = data.arrays | {"description": np.array(json.dumps(data.description))}
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as file:
        np.savez_compressed(file, **arrays)
    return path


def _described(record: RunRecord, arrays: dict[str, Array]) -> dict[str, Any]:
    campaign = record.campaign
    return {
        "seed": campaign.seed,
        "kinds": dict(campaign.kinds),
        "levels": dict(campaign.levels),
        "surfaces": campaign.surfaces,
        "engine": campaign.engine,
        "set": record.set_digest,
        "specs": [Path(spec).name for spec in record.specs],
        "baseline": baseline(arrays, arrays["test"]),
    }


def _rms(values: Array) -> float | None:
    return round(float(np.sqrt(np.mean(values**2))), 4) if len(values) else None
