"""A recording, or any HDF5 file with /frames (N, rows, columns), -> frames, a block at a time.

Nothing is held open between two calls, and no more than a block is in memory: a recording
of an hour is read in the memory of a second. The journal of a writer that was killed is read as
it is, to its last whole record.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.errors import RecordingError
from probe.frame import Frame
from probe.recording.files import explain_errors, part_of, series_of
from probe.recording.guard import superblock_of
from probe.recording.hdf5 import open_hdf5_frames
from probe.recording.journal import is_journal, open_journal
from probe.recording.layout import FrameBlock, FrameFile, RecordingOrigin, join_blocks

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
        Also the flushed frames of a recording that is still being written.

    Raises
    ------
    RecordingError
        No such file, no HDF5 file, no /frames of the right shape, a newer format, truncated,
        damaged, or being written (and not `live`); an HDF5 file that was left open.

    Examples
    --------
    >>> import tempfile
    >>> import h5py
    >>> import numpy as np
    >>> from encoded_objects import Recording
    >>> path = Path(tempfile.mkdtemp()) / "mine.h5"
    >>> with h5py.File(path, "w") as file:  # any HDF5 file with /frames will do
    ...     file["frames"] = np.full((3, 16, 16), 7, np.uint16)
    >>> recording = Recording(path)
    >>> print(recording)
    mine.h5: 3 frames
    >>> [int(frame.counts[0, 0]) for frame in recording.frames()]
    [7, 7, 7]
    """

    path: Path | str
    live: bool = field(default=False, kw_only=True)
    files: tuple[File, ...] = field(init=False, repr=False)
    origin: RecordingOrigin = field(init=False, repr=False)  #: of the first file
    shape: tuple[int, int] = field(init=False, repr=False)  #: rows and columns of its images
    tool_version: str = field(init=False, repr=False)  #: that wrote it; empty: not this programme

    def __post_init__(self) -> None:
        if not isinstance(self.path, str | Path):
            kind = type(self.path).__name__
            raise RecordingError(f"{kind} is no file", fix="give the path of a recording")
        files: list[File] = []
        first: FrameFile | None = None
        for name in _files_of(Path(self.path), self.live):
            with open_frames(name, live=self.live) as file:
                if not file.even and not self.live:
                    raise RecordingError(
                        "its datasets have different lengths", fix="run `repair` on it", place=name
                    )
            first = first or file
            if file.shape != first.shape:
                raise RecordingError(
                    f"its images are of {file.shape}, those of {files[0].path.name} of "
                    f"{first.shape}",
                    fix="read the two by themselves",
                    place=name,
                )
            files.append(File(name, file.frames, file.poses))
        assert first is not None
        object.__setattr__(self, "files", tuple(files))
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

    def blocks(self, start: int = 0, stop: int | None = None) -> Iterator[FrameBlock]:
        """Yield frames `start` ... `stop` - 1 as blocks of some hundred frames at most.

        Raises RecordingError: a value that is no count, a pose that is none, a damaged part.
        """
        stop = len(self) if stop is None else min(stop, len(self))
        size = max(1, min(_AT_ONCE, _VALUES_AT_ONCE // (self.shape[0] * self.shape[1])))
        for file in self.files:
            if start < min(stop, file.frames):
                with open_frames(file.path, live=self.live) as source:
                    for first in range(start, min(stop, file.frames), size):
                        end = min(first + size, stop, file.frames)
                        yield source.read(first, end)
            start, stop = max(0, start - file.frames), stop - file.frames

    def block(self, start: int = 0, stop: int | None = None) -> FrameBlock:
        """Return frames `start` ... `stop` - 1 at once."""
        return join_blocks(list(self.blocks(start, stop)), self.shape)

    def sensor_type(self, asked: str | SensorType | None = None) -> SensorType:
        """Return the type of sensor that made it: the one asked for, else the one it names.

        Raises SensorTypeError: no such type, one of another shape, or nothing tells.
        """
        return choose_sensor_type(asked, self.origin.sensor_type, self.shape, str(self.path))

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Yield frames `start` ... `stop` - 1."""
        for block in self.blocks(start, stop):
            for i in range(len(block)):
                yield block.frame(i)


def open_frames(
    path: Path, *, live: bool = False, damaged: bool = False
) -> AbstractContextManager[FrameFile]:
    """Open a file of frames: HDF5, or the journal of one that is not closed.

    `live`: also one that is being written, or that its writer left open; `damaged`: in whatever
    state, parts may be missing. Raises RecordingError, see `Recording`.
    """
    if is_journal(path):
        return open_journal(path, live=live)
    return open_hdf5_frames(path, live=live, damaged=damaged)


def _files_of(path: Path, live: bool) -> list[Path]:
    """Return the files of a recording, in order; `path` itself if there are none."""
    if os.path.exists(path):  # also of a name that is too long
        return [path]
    series = [file for _, file in series_of(path)]
    part = part_of(path)
    if os.path.exists(part) and not (live and series and _is_blank(part)):
        series.append(part)
    return series or [path]


def _is_blank(part: Path) -> bool:
    """Tell whether nothing in a part file has reached the disk yet."""
    with explain_errors(part, "read"):
        head = superblock_of(part)
    return not is_journal(part) and (head is None or head.blank)
