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
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from encoded_objects.base.files import whole_file
from recognizer.touch.recognise import recognise
from recognizer.validation.campaign import Work, series_of
from recognizer.validation.draw import DrawnTouch, draw_touch
from recognizer.validation.files import write_json, write_table
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
    faces = [one.face(number) for one in reader.lab.arrays for number in range(len(one.faces))]
    names = sorted(f"{face.object}/{face.face}" for face in faces)
    label_of = {name: label for label, name in enumerate(names)}
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
    arrays["names"] = np.array(names)
    return TouchDataset(arrays, reader.sensor.pitch_mm, description)


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


def write_npz(data: TouchDataset, folder: Path) -> None:
    """Write the data set as one file of arrays."""
    arrays: dict[str, Any] = data.arrays | {"description": np.array(json.dumps(data.description))}
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(folder / "dataset.npz") as file:
        np.savez_compressed(file, **arrays)


VERSION: Final = "v3.0"  #: of LeRobot's format
TASK: Final = "say which face is touched, and where"
ROWS: Final = 50_000  #: touches in a file; LeRobot wants less than 100 MB
CHUNK_FILES: Final = 1000
DATA: Final = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
INDEX: Final = "__index_level_0__"  #: what pandas calls an index without a name
PANDAS: Final[dict[str, Any]] = {
    "index_columns": [INDEX],
    "column_indexes": [],
    "columns": [
        {"name": name, "field_name": field, "pandas_type": kind, "numpy_type": stored,
         "metadata": None}
        for name, field, kind, stored in (
            ("task_index", "task_index", "int64", "int64"),
            (None, INDEX, "unicode", "object"),
        )
    ],
    "pandas_version": "2.2.0",
}  # fmt: skip


def write_lerobot(data: TouchDataset, folder: Path) -> None:
    """Write the data set in the folder `lerobot`, whole or not there."""
    target, draft = folder / "lerobot", folder / ".lerobot.writing"
    shutil.rmtree(draft, ignore_errors=True)
    columns = _columns(data)
    total = len(columns["index"])
    for file, start in enumerate(range(0, total, ROWS)):
        rows = {name: _arrow(values[start : start + ROWS]) for name, values in columns.items()}
        name = DATA.format(chunk_index=file // CHUNK_FILES, file_index=file % CHUNK_FILES)
        write_table(pa.table(rows), draft / name, "snappy")
    episodes = draft / "meta/episodes/chunk-000/file-000.parquet"
    write_table(_episodes(total), episodes, "snappy")
    tasks = pa.table({"task_index": pa.array([0]), INDEX: pa.array([TASK])})
    tasks = tasks.replace_schema_metadata({"pandas": json.dumps(PANDAS)})
    write_table(tasks, draft / "meta/tasks.parquet", "snappy")
    write_json(draft / "meta/stats.json", {name: _stats(v) for name, v in columns.items()})
    write_json(draft / "meta/info.json", _info(data, columns))
    shutil.rmtree(target, ignore_errors=True)
    draft.rename(target)


def _columns(data: TouchDataset) -> dict[str, Array]:
    """Return a column for each feature; the touches kept for testing come last."""
    order = np.argsort(data.arrays["test"], kind="stable")
    arrays = {name: values[order] for name, values in data.arrays.items() if name != "names"}
    total = len(order)
    pose = np.stack([arrays["x_mm"], arrays["y_mm"], arrays["theta_rad"]], axis=1)
    return {
        "observation.tactile": arrays["counts"].reshape(total, -1).astype(np.float32),
        "observation.force_n": arrays["force_n"].astype(np.float32),
        "action": np.nan_to_num(pose).astype(np.float32),
        "label": arrays["label"].astype(np.int64),
        "touch": arrays["number"].astype(np.int64),
        "timestamp": np.zeros(total, np.float32),
        "frame_index": np.zeros(total, np.int64),
        "episode_index": np.arange(total),
        "index": np.arange(total),
        "task_index": np.zeros(total, np.int64),
    }


def _info(data: TouchDataset, columns: dict[str, Array]) -> dict[str, Any]:
    rows, across = data.arrays["counts"].shape[1:]
    total, train = len(columns["index"]), int((~data.arrays["test"]).sum())
    named = {
        "observation.tactile": [f"r{r}c{c}" for r in range(rows) for c in range(across)],
        "action": ["x_mm", "y_mm", "theta_rad"],
    }
    features = {
        name: {
            "dtype": str(values.dtype),
            "shape": list(values.shape[1:]) or [1],
            "names": named.get(name),
        }
        for name, values in columns.items()
    }
    splits = {"train": f"0:{train}"} | ({"test": f"{train}:{total}"} if train < total else {})
    return {
        "codebase_version": VERSION,
        "robot_type": "encoded-objects probe",
        "total_episodes": total,
        "total_frames": total,
        "total_tasks": 1,
        "chunks_size": CHUNK_FILES,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": 1,  # an episode has one frame
        "splits": splits,
        "data_path": DATA,
        "video_path": None,
        "features": features,
        "names": data.arrays["names"].tolist(),
        "tactels": {"rows": rows, "columns": across, "pitch_mm": data.pitch_mm},
        "world": data.description,
    }


def _episodes(total: int) -> pa.Table:
    each = np.arange(total)
    files = each // ROWS
    none = np.zeros(total, np.int64)
    return pa.table(
        {
            "episode_index": each,
            "tasks": pa.array([[TASK]] * total),
            "length": none + 1,
            "data/chunk_index": files // CHUNK_FILES,
            "data/file_index": files % CHUNK_FILES,
            "dataset_from_index": each,
            "dataset_to_index": each + 1,
            "meta/episodes/chunk_index": none,
            "meta/episodes/file_index": none,
        }
    )


def _stats(values: Array) -> dict[str, list[Any]]:
    """Return what LeRobot normalises by, over all touches."""
    flat = values.reshape(len(values), -1).astype(np.float64)
    found = {"min": flat.min(axis=0), "max": flat.max(axis=0), "mean": flat.mean(axis=0),
             "std": flat.std(axis=0)}  # fmt: skip
    return {name: each.tolist() for name, each in found.items()} | {"count": [len(values)]}


def _arrow(values: Array) -> pa.Array:
    if values.ndim == 1:
        return pa.array(values)
    return pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])
