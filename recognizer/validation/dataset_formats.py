"""Touches as files that others read: npz, LeRobot v3.0, and a Zarr store of FTP-1.

The arrays are those of `dataset`, one entry a touch; the same touches give the same bytes. In
LeRobot's and FTP-1's layout an episode is a touch, and there is no camera, which loaders of
policies ask for. FTP-1 (arXiv 2606.13102) is Zarr format 2, chunks packed by zlib::

    data/timestamps (T,) f8                  s; a touch a second
    data/right_tactile_data_finger           (T, 1, rows, columns) u2, counts
    data/right_tactile_area_finger (T, 1) i8 functional area, `AREA`
    data/right_tactile_sensor_finger (T,)    name of the sensor type
    data/right_tactile_type_finger (T,)      "state"
    data/right_wrist_pose (T, 6) f8          of the sensor on the face, face frame: x, y, z in m and
                                             the rotation vector in rad; zeros where it is of none
    data/sub_task_instruction (T,)
    data/label (T,) i8                       number of the face in `names` of `.zattrs`; -1: none
    meta/episode_ends (T,) i8
"""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa

from encoded_objects.base.files import whole_file
from recognizer.validation.dataset import Array, TouchDataset
from recognizer.validation.files import whole_folder, write_json, write_table


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
    columns = _columns(data)
    total = len(columns["index"])
    tasks = pa.table({"task_index": pa.array([0]), INDEX: pa.array([TASK])})
    tasks = tasks.replace_schema_metadata({"pandas": json.dumps(PANDAS)})
    with whole_folder(folder / "lerobot") as draft:
        for file, start in enumerate(range(0, total, ROWS)):
            rows = {name: _arrow(values[start : start + ROWS]) for name, values in columns.items()}
            name = DATA.format(chunk_index=file // CHUNK_FILES, file_index=file % CHUNK_FILES)
            write_table(pa.table(rows), draft / name, "snappy")
        episodes = draft / "meta/episodes/chunk-000/file-000.parquet"
        write_table(_episodes(total), episodes, "snappy")
        write_table(tasks, draft / "meta/tasks.parquet", "snappy")
        write_json(draft / "meta/stats.json", {name: _stats(v) for name, v in columns.items()})
        write_json(draft / "meta/info.json", _info(data, columns))


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


AREA: Final = 0  #: thumb pad, or the first pad of a gripper
CHUNK: Final = 512  #: touches in a chunk
LEVEL: Final = 6  #: of zlib


def write_ftp1(
    arrays: dict[str, Array], sensor: str, path: Path, attributes: dict[str, Any]
) -> None:
    """Write touches as the store `path` of FTP-1, whole or not there."""
    each = np.arange(len(arrays["counts"]))
    pose = np.zeros((len(each), 6))
    pose[:, 0], pose[:, 1] = arrays["x_mm"] / 1000, arrays["y_mm"] / 1000
    pose[:, 5] = arrays["theta_rad"]
    finger = "data/right_tactile_{}_finger"
    stored = {
        "data/timestamps": each.astype(np.float64),
        finger.format("data"): arrays["counts"][:, None],
        finger.format("area"): np.full((len(each), 1), AREA),
        finger.format("sensor"): np.full(len(each), sensor),
        finger.format("type"): np.full(len(each), "state"),
        "data/right_wrist_pose": np.nan_to_num(pose),
        "data/sub_task_instruction": np.full(len(each), TASK),
        "data/label": arrays["label"],
        "meta/episode_ends": each + 1,
    }
    with whole_folder(path) as draft:
        for group in ("", "data", "meta"):
            write_json(draft / group / ".zgroup", {"zarr_format": 2})
        write_json(draft / ".zattrs", attributes)
        for name, values in stored.items():
            _write_zarr(draft / name, np.ascontiguousarray(values))


def _write_zarr(folder: Path, values: Array) -> None:
    values = values.astype(values.dtype.newbyteorder("<"))
    chunks = (min(CHUNK, max(1, len(values))), *values.shape[1:])
    described = {
        "zarr_format": 2, "shape": values.shape, "chunks": chunks, "dtype": values.dtype.str,
        "compressor": {"id": "zlib", "level": LEVEL}, "fill_value": None, "order": "C",
        "filters": None,
    }  # fmt: skip
    write_json(folder / ".zarray", described)
    for number, start in enumerate(range(0, len(values), CHUNK)):
        chunk = np.zeros(chunks, values.dtype)
        some = values[start : start + CHUNK]
        chunk[: len(some)] = some
        name = ".".join([str(number), *["0"] * (values.ndim - 1)])
        (folder / name).write_bytes(zlib.compress(chunk.tobytes(), LEVEL))
