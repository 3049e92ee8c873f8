"""The journal of a recording: what is on the disk while frames come in.

::

    8 bytes     "TOUCHLOG"
    u32, u32    length of the head and its CRC-32
    head        JSON: version, shape, piece, and the origin of the frames
    records     one a frame, all of one length: counts, wrist, t_ns, seq, pose (NaN: not known),
                CRC-32 of those before

Little endian. Records are appended and never changed. After `append` returns, its frames outlive
this process however it ends: a torn record at the end fails its CRC, and all before it are read.
Space is reserved ahead, so that frames which have come are kept when the disk is full; what
stands behind the last record is zeros, whose CRC is wrong.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.foreign import open_regular
from probe.errors import RecordingError
from probe.frame import WRIST, are_rigid
from probe.recording.files import (
    blank_error,
    explain_errors,
    is_locked,
    not_closed_error,
    take_lock,
)
from probe.recording.guard import MOST_TACTELS
from probe.recording.layout import (
    CHUNK,
    FORMAT_VERSION,
    FrameBlock,
    FrameFile,
    RecordingOrigin,
    json_value,
)

_MAGIC: Final = b"TOUCHLOG"
_SUMS: Final = struct.Struct("<II")
_MOST_HEAD: Final = 1 << 24  #: bytes; attributes are texts and numbers
_RESERVED: Final = 1 << 20  #: bytes that are reserved at a time
_AT_ONCE: Final = 1024  #: records that are searched for poses at a time


class JournalWriter:
    """A journal that is being written, and the lock on it.

    `path` is a name that is free, `piece` the number in a series, from 1. Raises RecordingError:
    the name is taken, the folder cannot be written, the disk is full.
    """

    def __init__(self, path: Path, origin: RecordingOrigin, piece: int = 1) -> None:
        self.path, self._origin, self._piece = path, origin, piece
        self.frames = 0  #: that are safe
        self._end = self._reserved = 0  # bytes
        self._descriptor = _make_file(path)
        try:
            with explain_errors(path, "write"):
                self._reserve(0)
        except BaseException:
            self.close()
            path.unlink(missing_ok=True)
            raise

    def append(self, block: FrameBlock) -> None:
        """Append frames; when this returns, they are safe.

        Raises RecordingError: no space for more frames. Those before are safe, and these if
        `frames`
        counts them.
        """
        rows, columns = block.counts.shape[1:]
        dtype = _record_type((rows, columns))
        with explain_errors(self.path, "write"):
            head = b"" if self._end else _head(self._origin, self._piece, (rows, columns))
            self._write(head + _records(block, dtype))
            self.frames += len(block)
            self._reserve(max(CHUNK, len(block)) * dtype.itemsize)

    def close(self) -> None:
        """Release the file."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def _write(self, data: bytes) -> None:
        """Write all of `data`, or leave the end of the journal where it was."""
        rest, at = memoryview(data), self._end
        while rest:
            written = os.pwrite(self._descriptor, rest, at)
            rest, at = rest[written:], at + written
        self._end = at

    def _reserve(self, needed: int) -> None:
        if self._end + needed > self._reserved - _RESERVED // 2:
            self._reserved = self._end + needed + _RESERVED
            os.posix_fallocate(self._descriptor, 0, self._reserved)


def is_journal(path: Path) -> bool:
    """Tell whether a file begins as a journal."""
    with explain_errors(path, "read"), open_regular(path) as file:
        return file.read(len(_MAGIC)) == _MAGIC


@contextmanager
def open_journal(path: Path, *, live: bool = False) -> Iterator[FrameFile]:
    """Open a journal for reading; its frames are the records to the last whole one.

    Raises RecordingError: damaged, without frames, or still being written (and not `live`).
    """
    if not live and is_locked(path):
        raise not_closed_error(path)
    with ExitStack() as stack:
        with explain_errors(path, "read"):
            file = stack.enter_context(open_regular(path))
            head, start = _read_head(file)
            origin = RecordingOrigin.of_texts(head, head["more"])
            (rows, columns), piece = map(int, head["shape"]), int(head["piece"])
            if head["version"] != FORMAT_VERSION or not 0 < rows * columns <= MOST_TACTELS:
                raise ValueError("a head of another version, or of images too large")
            records = _Records(file, start, _record_type((rows, columns)))
            poses = any(
                not np.isnan(records.read(first, first + _AT_ONCE)["pose"]).all()
                for first in range(0, records.number, _AT_ONCE)
            )
        if not records.number:
            raise blank_error(path)

        def read(first: int, stop: int) -> FrameBlock:
            with explain_errors(path, "read"):
                return _block(records.read(first, stop), poses=poses)

        yield FrameFile(
            origin,
            own=True,
            closed=False,
            tool_version=str(head["tool_version"]),
            piece=piece,
            lengths={"frames": records.number},
            shape=(rows, columns),
            poses=poses,
            read=read,
        )


class _Records:
    def __init__(self, file: BinaryIO, start: int, dtype: np.dtype[Any]) -> None:
        self._file, self._start, self._dtype = file, start, dtype
        self.number = max(0, os.fstat(file.fileno()).st_size - start) // dtype.itemsize
        while self.number and not _is_whole(self.read(self.number - 1, self.number)):
            self.number -= 1

    def read(self, first: int, stop: int) -> NDArray[Any]:
        size = self._dtype.itemsize
        self._file.seek(self._start + first * size)
        data = self._file.read((min(stop, self.number) - first) * size)
        return np.frombuffer(data, self._dtype)


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
        raise RecordingError(cause, fix=fix, place=path) from error
    take_lock(descriptor)
    return descriptor


def _record_type(shape: tuple[int, int]) -> np.dtype[Any]:
    return np.dtype([
        ("counts", "<u2", shape), ("wrist", "<u2", WRIST), ("t_ns", "<i8"), ("seq", "<i8"),
        ("pose", "<f8", (4, 4)), ("crc", "<u4")
    ])  # fmt: skip


def _records(block: FrameBlock, dtype: np.dtype[Any]) -> bytes:
    records = np.empty(len(block), dtype)
    records["counts"], records["wrist"] = block.counts, block.wrist
    records["t_ns"], records["seq"] = block.t_ns, block.seq
    records["pose"] = np.nan if block.pose is None else block.pose
    records["crc"] = _sums(records)
    return records.tobytes()


def _block(records: NDArray[Any], *, poses: bool) -> FrameBlock:
    """Return records as frames; ValueError where one is damaged."""
    if not _is_whole(records):
        raise ValueError("a record with a wrong CRC")
    if poses and not are_rigid(records["pose"]):
        raise ValueError("a pose that is no rigid transform")
    counts, t_ns, seq, wrist, pose = (
        np.array(records[name]) for name in ("counts", "t_ns", "seq", "wrist", "pose")
    )
    return FrameBlock(counts, t_ns, seq, wrist, pose if poses else None).frozen()


def _is_whole(records: NDArray[Any]) -> bool:
    return bool((records["crc"] == _sums(records)).all())


def _sums(records: NDArray[Any]) -> NDArray[np.uint32]:
    """Return the CRC-32 of each record."""
    data, size = memoryview(records.tobytes()), records.dtype.itemsize
    ends = range(size - 4, len(data), size)
    return np.array([zlib.crc32(data[end + 4 - size : end]) for end in ends], np.uint32)


def _head(origin: RecordingOrigin, piece: int, shape: tuple[int, int]) -> bytes:
    said = {
        "version": FORMAT_VERSION,
        "tool_version": version("encoded-objects"),
        "piece": piece,
        "shape": shape,
        **origin.texts(),
        "more": dict(origin.more),
    }
    text = json.dumps(said, default=json_value).encode()
    return _MAGIC + _SUMS.pack(len(text), zlib.crc32(text)) + text


def _read_head(file: BinaryIO) -> tuple[dict[str, Any], int]:
    """Return the head, and where the records begin; ValueError where it is damaged."""
    file.seek(len(_MAGIC))
    length, crc = _SUMS.unpack(file.read(_SUMS.size).ljust(_SUMS.size, b"\0"))
    text = file.read(min(length, _MOST_HEAD))
    if zlib.crc32(text) != crc:
        raise ValueError("a head with a wrong CRC")
    try:
        return dict(json.loads(text)), file.tell()
    except RecursionError as error:
        raise ValueError("a head nested too deep") from error
