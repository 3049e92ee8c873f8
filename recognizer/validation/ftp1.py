"""Touches as a Zarr store of FTP-1, the layout that tactile data sets share (arXiv 2606.13102).

Arrays of one entry a touch (`dataset`, `benchmark`) -> `NAME.zarr`, Zarr format 2, chunks packed by
zlib; an episode is a touch:

::

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

There is no camera, which loaders of policies ask for: a touch has none. The same touches give the
same bytes.
"""

from __future__ import annotations

import shutil
import zlib
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from recognizer.validation.files import write_json

AREA: Final = 0  #: thumb pad, or the first pad of a gripper
ROWS: Final = 512  #: touches in a chunk
INSTRUCTION: Final = "say which face is touched, and where"
LEVEL: Final = 6  #: of zlib


def write_ftp1(
    arrays: dict[str, NDArray[Any]], sensor: str, path: Path, attributes: dict[str, Any]
) -> None:
    """Write touches as the store `path`, whole or not there.

    `arrays` are `counts`, `label`, `x_mm`, `y_mm`, `theta_rad` as `dataset` names them.
    """
    draft = path.with_name(f".{path.name}.writing")
    shutil.rmtree(draft, ignore_errors=True)
    each = np.arange(len(arrays["counts"]))
    pose = np.zeros((len(each), 6))
    pose[:, 0], pose[:, 1] = arrays["x_mm"] / 1000, arrays["y_mm"] / 1000
    pose[:, 5] = arrays["theta_rad"]
    for folder in ("", "data", "meta"):
        write_json(draft / folder / ".zgroup", {"zarr_format": 2})
    write_json(draft / ".zattrs", attributes)
    finger = "data/right_tactile_{}_finger"
    for name, values in {
        "data/timestamps": each.astype(np.float64),
        finger.format("data"): arrays["counts"][:, None],
        finger.format("area"): np.full((len(each), 1), AREA),
        finger.format("sensor"): np.full(len(each), sensor),
        finger.format("type"): np.full(len(each), "state"),
        "data/right_wrist_pose": np.nan_to_num(pose),
        "data/sub_task_instruction": np.full(len(each), INSTRUCTION),
        "data/label": arrays["label"],
        "meta/episode_ends": each + 1,
    }.items():
        _array(draft / name, np.ascontiguousarray(values))
    shutil.rmtree(path, ignore_errors=True)
    draft.rename(path)


def _array(folder: Path, values: NDArray[Any]) -> None:
    values = values.astype(values.dtype.newbyteorder("<"))
    chunks = (min(ROWS, max(1, len(values))), *values.shape[1:])
    described = {
        "zarr_format": 2, "shape": values.shape, "chunks": chunks, "dtype": values.dtype.str,
        "compressor": {"id": "zlib", "level": LEVEL}, "fill_value": None, "order": "C",
        "filters": None,
    }  # fmt: skip
    write_json(folder / ".zarray", described)
    for number, start in enumerate(range(0, len(values), ROWS)):
        chunk = np.zeros(chunks, values.dtype)
        some = values[start : start + ROWS]
        chunk[: len(some)] = some
        name = ".".join([str(number), *["0"] * (values.ndim - 1)])
        (folder / name).write_bytes(zlib.compress(chunk.tobytes(), LEVEL))
