"""A recording -> a table (CSV): a row a frame.

Columns: seq, t_ns, r0c0, r0c1, ... (row 0 on top), wrist0 ... wrist3, and where a pose is
known in any frame p00 ... p33, T_base_sensor by rows (mm), empty in the frames without.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from encoded_objects.base.files import staged_file
from probe.frame import WRIST
from probe.recording.files import explain_errors
from probe.recording.layout import FrameBlock
from probe.recording.read import Recording

POSE_HEADER: Final = [f"p{r}{c}" for r in range(4) for c in range(4)]


def export_csv(path: Path | str, out: Path | str, *, live: bool = False) -> int:
    """Write a recording, with `live` also one that is being written, as a table.

    Returns the number of rows. The table appears when it is complete, and replaces a file of that
    name. Raises RecordingError: the recording cannot be read, or the table not be written.
    """
    recording, out = Recording(path, live=live), Path(out)
    with (
        explain_errors(out, "write"),
        staged_file(out) as draft,
        open(draft, "x", encoding="ascii", newline="") as stream,
    ):
        poses = any(file.poses for file in recording.files)
        pose = POSE_HEADER if poses else []
        stream.write(",".join([*table_header(recording.shape), *pose]) + "\n")
        for block in recording.blocks():
            stream.write("".join(line + "\n" for line in _lines(block, poses)))
    return len(recording)


def table_header(shape: tuple[int, int]) -> list[str]:
    """Return the names of the columns of a table without poses."""
    images = [f"r{r}c{c}" for r in range(shape[0]) for c in range(shape[1])]
    return ["seq", "t_ns", *images, *(f"wrist{i}" for i in range(WRIST))]


def _lines(block: FrameBlock, poses: bool) -> list[str]:
    n = len(block)
    numbers = np.hstack(
        [block.seq[:, None], block.t_ns[:, None], block.counts.reshape(n, -1), block.wrist]
    )
    lines = [",".join(map(str, row)) for row in numbers.tolist()]
    if not poses:
        return lines
    pose = np.full((n, 16), np.nan) if block.pose is None else block.pose.reshape(n, 16)
    known = ["," * 15 if np.isnan(row[0]) else ",".join(map(repr, row)) for row in pose.tolist()]
    return [f"{line},{rest}" for line, rest in zip(lines, known, strict=True)]
