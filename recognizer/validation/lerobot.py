"""A data set of touches in the form of LeRobot's data sets, version 3.0.

Every touch is an episode of one frame. Features: `observation.tactile` (counts by rows),
`observation.force_n`, `action` (x_mm, y_mm, theta_rad of the sensor on the face; zeros where it is
no face of the set) and `label` (face, see `names` in `meta/info.json`; -1: none). The split `test`
is the fifth of the touches that is kept apart: episodes are ordered so that it comes last.

::

    lerobot/meta/info.json, stats.json, tasks.parquet
    lerobot/meta/episodes/chunk-000/file-000.parquet
    lerobot/data/chunk-000/file-000.parquet, ...
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from encoded_objects.base.files import whole_file
from recognizer.validation.dataset import TouchDataset
from recognizer.validation.files import write_json

VERSION: Final = "v3.0"
FPS: Final = 1  #: frames of an episode a second: there is one
TASK: Final = "say which face is touched, and where"
ROWS: Final = 50_000  #: touches in a file; LeRobot wants less than 100 MB
CHUNK_FILES: Final = 1000
DATA: Final = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES: Final = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"


def write_lerobot(data: TouchDataset, folder: Path) -> Path:
    """Write the data set; returns its folder, whole or not there."""
    target, draft = folder / "lerobot", folder / ".lerobot.writing"
    shutil.rmtree(draft, ignore_errors=True)
    order = np.argsort(data.arrays["test"], kind="stable")
    columns = _columns(data, order)
    total, train = len(order), int((~data.arrays["test"]).sum())
    for file, start in enumerate(range(0, total, ROWS)):
        rows = {name: values[start : start + ROWS] for name, values in columns.items()}
        _write(draft / DATA.format(**_place(file)), {n: _arrow(v) for n, v in rows.items()})
    _write(draft / EPISODES.format(chunk_index=0, file_index=0), _episodes(total))
    _write(draft / "meta/tasks.parquet", {"task_index": pa.array([0]), _INDEX: pa.array([TASK])},
           {"pandas": json.dumps(_PANDAS)})  # fmt: skip
    write_json(
        draft / "meta/stats.json", {name: _stats(values) for name, values in columns.items()}
    )
    write_json(draft / "meta/info.json", _info(data, columns, total, train))
    shutil.rmtree(target, ignore_errors=True)
    draft.rename(target)
    return target


def _columns(data: TouchDataset, order: NDArray[np.intp]) -> dict[str, NDArray[Any]]:
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


def _info(
    data: TouchDataset, columns: dict[str, NDArray[Any]], total: int, train: int
) -> dict[str, Any]:
    rows, across = data.arrays["counts"].shape[1:]
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
        "fps": FPS,
        "splits": splits,
        "data_path": DATA,
        "video_path": None,
        "features": features,
        "names": data.arrays["names"].tolist(),
        "tactels": {"rows": rows, "columns": across, "pitch_mm": data.pitch_mm},
        "world": data.description,
    }


def _episodes(total: int) -> dict[str, pa.Array]:
    each = np.arange(total)
    files = each // ROWS
    none = np.zeros(total, np.int64)
    return {
        "episode_index": pa.array(each),
        "tasks": pa.array([[TASK]] * total),
        "length": pa.array(none + 1),
        "data/chunk_index": pa.array(files // CHUNK_FILES),
        "data/file_index": pa.array(files % CHUNK_FILES),
        "dataset_from_index": pa.array(each),
        "dataset_to_index": pa.array(each + 1),
        "meta/episodes/chunk_index": pa.array(none),
        "meta/episodes/file_index": pa.array(none),
    }


def _stats(values: NDArray[Any]) -> dict[str, list[Any]]:
    """Return what LeRobot normalises by, over all touches."""
    flat = values.reshape(len(values), -1).astype(np.float64)
    found = {"min": flat.min(axis=0), "max": flat.max(axis=0), "mean": flat.mean(axis=0),
             "std": flat.std(axis=0)}  # fmt: skip
    return {name: each.tolist() for name, each in found.items()} | {"count": [len(values)]}


def _arrow(values: NDArray[Any]) -> pa.Array:
    if values.ndim == 1:
        return pa.array(values)
    return pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])


def _place(file: int) -> dict[str, int]:
    return {"chunk_index": file // CHUNK_FILES, "file_index": file % CHUNK_FILES}


def _write(
    path: Path, columns: dict[str, pa.Array], metadata: dict[str, str] | None = None
) -> None:
    table = pa.table(columns)
    if metadata:
        table = table.replace_schema_metadata(metadata)
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as file:
        pq.write_table(table, file)


_INDEX = "__index_level_0__"  #: what pandas calls an index without a name
_PANDAS: dict[str, Any] = {
    "index_columns": [_INDEX],
    "column_indexes": [],
    "columns": [
        {"name": name, "field_name": field, "pandas_type": kind, "numpy_type": stored,
         "metadata": None}
        for name, field, kind, stored in (
            ("task_index", "task_index", "int64", "int64"),
            (None, _INDEX, "unicode", "object"),
        )
    ],
    "pandas_version": "2.2.0",
}  # fmt: skip
