"""One file of a recording while it is written: blocks of frames in, safe on the disk.

After `write` returns, its frames outlive this process however it ends: HDF5 keeps the file
readable at every moment (SWMR), and the lock on it tells whether its writer lives. The HDF5
library crashes on a full disk, so space is reserved ahead: when there is no more, the block
at hand is still written, and the file can be closed. What was reserved and is not needed is
cut off at the end.
"""

from __future__ import annotations

import os
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from probe.closing import Closing
from probe.errors import RecordingError
from probe.recording.layout import (
    CHUNK,
    DATASETS,
    FORMAT,
    FORMAT_VERSION,
    OPTIONAL,
    FrameBlock,
    RecordingOrigin,
)
from probe.recording.lock import is_locked, take_lock
from probe.recording.opened import explain_errors
from probe.recording.settings import RECORDING
from probe.recording.superblock import superblock_of

if TYPE_CHECKING:
    import h5py

_FILE_FORMAT: Final = ("v110", "v110")


class FileWriter(Closing):
    """A recording file that is being written.

    Parameters
    ----------
    path
        A name that is free.
    origin
        What the attributes say.
    piece
        Number in a series, from 1.

    Raises
    ------
    RecordingError
        The name is taken, the folder cannot be written, the disk is full.
    """

    def __init__(self, path: Path, origin: RecordingOrigin, piece: int = 1) -> None:
        import h5py

        self.path = path
        self.frames = 0  #: that are safe
        self.poses = False  #: whether the file has a place for poses; decided by the first block
        self._sets: dict[str, h5py.Dataset] = {}
        self._reserved = 0
        self._descriptor = _make_file(path)
        try:
            with explain_errors(path, "write"):
                self._reserve(0)
                self._file = h5py.File(
                    path, "w", libver=_FILE_FORMAT, rdcc_nbytes=4 * RECORDING.step
                )
                self._reserved = 0  # the library emptied the file
                self._reserve(0)
            self._file.attrs.update(_attributes(origin, piece))
        except BaseException:
            os.close(self._descriptor)
            path.unlink(missing_ok=True)
            raise

    def write(self, block: FrameBlock) -> None:
        """Append frames; when this returns, they are safe.

        Raises
        ------
        RecordingError
            There is no space for these frames; those before are safe.
        """
        first, end = self.frames, self.frames + len(block)
        if not self._sets:
            self._start(block.counts.shape[1:], poses=block.pose is not None)
        with explain_errors(self.path, "write"):
            if len(block) > CHUNK:
                self._reserve(len(block) * (512 + block.counts[0].nbytes))
            values = block.datasets()
            for name, dataset in self._sets.items():
                dataset.resize(end, axis=0)
                dataset[first:end] = np.nan if values[name] is None else values[name]
            self._file.flush()
        self.frames = end
        with explain_errors(self.path, "write"):
            self._reserve(0)

    def close(self) -> None:
        """Close the file: it is whole and on the disk."""
        if self._descriptor < 0:
            return
        if not self._sets:
            self._start(FrameBlock.empty().counts.shape[1:], poses=False)
        with explain_errors(self.path, "close"):
            self._file.close()
            head = superblock_of(self.path)
            if head is not None:
                os.ftruncate(self._descriptor, head.end)
            os.fsync(self._descriptor)
        os.close(self._descriptor)
        self._descriptor = -1

    def _start(self, image: tuple[int, ...], *, poses: bool) -> None:
        """Make the datasets, and the file readable from now on."""
        self.poses = poses
        for name, (usual, dtype) in DATASETS.items():
            shape = image if name == "frames" else usual
            if poses or name not in OPTIONAL:
                self._sets[name] = self._file.create_dataset(
                    name,
                    shape=(0, *shape),
                    maxshape=(None, *shape),
                    chunks=(CHUNK, *shape),
                    dtype=dtype,
                    shuffle=True,
                    compression="gzip",
                    compression_opts=1,
                )
        self._file.swmr_mode = True

    def _reserve(self, needed: int) -> None:
        """Make sure of space for `needed` bytes of data, and to close afterwards."""
        end = self._file.id.get_filesize() if self._sets else 0
        if end + needed + RECORDING.spare > self._reserved:
            self._reserved = end + needed + RECORDING.spare + RECORDING.step
            os.posix_fallocate(self._descriptor, 0, self._reserved)


def _make_file(path: Path) -> int:
    """Make the file, lock it, and return its descriptor."""
    try:
        with explain_errors(path, "make"):
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
    except RecordingError as error:
        if not isinstance(error.__cause__, FileExistsError):
            raise
        if is_locked(path):
            cause, fix = "another process is writing it", "choose another name"
        else:
            cause = "a recording that was interrupted stands there"
            fix = f"run `repair` on {path.name}, or delete it"
        raise RecordingError(cause, fix=fix, place=str(path)) from error
    take_lock(descriptor)
    return descriptor


def _attributes(origin: RecordingOrigin, piece: int) -> dict[str, Any]:
    return {
        **origin.more,
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "tool_version": version("encoded-objects"),
        "sensor": origin.sensor,
        "calibration": origin.calibration,
        "units": origin.units,
        "piece": piece,
        **({"sensor_type": origin.sensor_type} if origin.sensor_type else {}),
    }
