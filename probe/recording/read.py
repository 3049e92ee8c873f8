"""A recording, or any HDF5 file with /frames (N, rows, columns), -> frames, a block at a time.

Nothing is held open between two calls, and no more than a block is in memory: a recording
of an hour is read in the memory of a second.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.errors import RecordingError
from probe.frame import Frame
from probe.recording.checked import check_recording, read_block
from probe.recording.layout import FrameBlock, RecordingOrigin
from probe.recording.names import part_of, series_of
from probe.recording.opened import is_blank, open_recording

_AT_ONCE: Final = 256  #: frames read at a time
_VALUES_AT_ONCE: Final = 1 << 24  #: of larger images fewer: 256 of 256 x 256


@dataclass(frozen=True, slots=True)
class File:
    """One file of a recording."""

    path: Path
    frames: int
    poses: bool  #: whether frames in it may have a pose


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording that is read when asked; opening it reads none of its frames.

    Parameters
    ----------
    path
        A file; or the name that was given to the recorder, when the recording rolled over.
    live
        Also what was flushed of a recording that is still being written, or was left open.

    Raises
    ------
    RecordingError
        No such file, no HDF5 file, no /frames of the right shape, a newer format, truncated,
        damaged, or not closed (and not `live`).

    Examples
    --------
    >>> import tempfile
    >>> from probe.frame import frame_from
    >>> from probe.recording.record import Recorder
    >>> path = Path(tempfile.mkdtemp()) / "touch.h5"
    >>> with Recorder(path) as recorder:
    ...     recorder.append(frame_from(np.full((16, 16), 7), t_ns=5, seq=0))
    >>> recording = Recording(path)
    >>> print(recording)
    touch.h5: 1 frame
    >>> [int(frame.counts[0, 0]) for frame in recording.frames()]
    [7]
    """

    path: Path | str
    live: bool = field(default=False, kw_only=True)
    files: tuple[File, ...] = field(init=False, repr=False)
    origin: RecordingOrigin = field(init=False, repr=False)  #: of the first file
    shape: tuple[int, int] = field(init=False, repr=False)  #: rows and columns of its images
    tool_version: str = field(init=False, repr=False)  #: that wrote it; empty: not this programme

    def __post_init__(self) -> None:
        looks = [
            (name, check_recording(name, live=self.live))
            for name in _files_of(Path(self.path), self.live)
        ]
        _, first = looks[0]
        for name, seen in looks:
            if seen.shape != first.shape:
                raise RecordingError(
                    f"its images are of {seen.shape}, those of {looks[0][0].name} of {first.shape}",
                    fix="read the two by themselves",
                    place=str(name),
                )
        files = tuple(File(name, seen.frames, seen.poses) for name, seen in looks)
        object.__setattr__(self, "files", files)
        object.__setattr__(self, "origin", first.origin)
        object.__setattr__(self, "shape", first.shape)
        object.__setattr__(self, "tool_version", first.tool_version)

    def __str__(self) -> str:
        frames = f"{len(self):,} frame" + ("" if len(self) == 1 else "s")
        more = f" in {len(self.files)} files" if len(self.files) > 1 else ""
        by = f", by {self.origin.sensor}" if self.origin.sensor else ""
        return f"{Path(self.path).name}: {frames}{more}{by}"

    def __len__(self) -> int:
        """Return the number of frames."""
        return sum(file.frames for file in self.files)

    def blocks(
        self, start: int = 0, stop: int | None = None, size: int = _AT_ONCE
    ) -> Iterator[FrameBlock]:
        """Yield frames `start` ... `stop` - 1 as blocks of at most `size` frames.

        Raises
        ------
        RecordingError
            A value that is no count, a pose that is none, a damaged part of the file.
        """
        stop = len(self) if stop is None else min(stop, len(self))
        size = max(1, min(size, _VALUES_AT_ONCE // (self.shape[0] * self.shape[1])))
        for file in self.files:
            if start < min(stop, file.frames):
                with open_recording(file.path, live=self.live) as source:
                    for first in range(start, min(stop, file.frames), size):
                        end = min(first + size, stop, file.frames)
                        yield read_block(source, file.path, first, end)
            start, stop = max(0, start - file.frames), stop - file.frames

    def block(self, start: int = 0, stop: int | None = None) -> FrameBlock:
        """Return frames `start` ... `stop` - 1 at once."""
        return _join_blocks(list(self.blocks(start, stop)), self.shape)

    def sensor_type(self, asked: str | SensorType | None = None) -> SensorType:
        """Return the type of sensor that made it: the one asked for, else the one it tells.

        Raises
        ------
        SensorTypeError
            No such type, one of another shape, or nothing tells.
        """
        return choose_sensor_type(asked, self.origin.sensor_type, self.shape, str(self.path))

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Yield frames `start` ... `stop` - 1."""
        for block in self.blocks(start, stop):
            for i in range(len(block)):
                yield block.frame(i)


def read_frames(path: Path | str, *, live: bool = False) -> Iterator[Frame]:
    """Return an iterator over the frames of a recording; see `Recording`."""
    return Recording(path, live=live).frames()


def _files_of(path: Path, live: bool) -> list[Path]:
    """Return the files of a recording, in order; `path` itself if there are none."""
    if path.exists():
        return [path]
    series = [file for _, file in series_of(path)]
    part = part_of(path)
    if part.exists() and not (live and series and is_blank(part)):
        series.append(part)
    return series or [path]


def _join_blocks(blocks: list[FrameBlock], shape: tuple[int, int]) -> FrameBlock:
    if len(blocks) < 2:
        return blocks[0] if blocks else FrameBlock.empty(shape)
    pose = None
    if any(block.pose is not None for block in blocks):
        pose = np.concatenate(
            [
                np.full((len(block), 4, 4), np.nan) if block.pose is None else block.pose
                for block in blocks
            ]
        )
    return FrameBlock(
        np.concatenate([block.counts for block in blocks]),
        np.concatenate([block.t_ns for block in blocks]),
        np.concatenate([block.seq for block in blocks]),
        np.concatenate([block.wrist for block in blocks]),
        pose,
    ).frozen()
