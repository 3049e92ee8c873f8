"""A file that was left open or lost its end, seen as if it were closed and whole.

HDF5 refuses such files, or waits minutes for a writer that is gone. Here the first bytes are
shown as a closed file has them, and zeros where the end is missing; the file itself is not
touched. What depends on the missing bytes fails alone, by its own checksum.

References
----------
Checksum of the metadata: B. Jenkins, lookup3.c, `hashlittle`, 2006 (public domain).
"""

from __future__ import annotations

import io
from typing import BinaryIO, Final

from probe.recording.superblock import Superblock

_MASK: Final = 0xFFFFFFFF
_HEAD: Final = 44  #: bytes of a superblock of version 2 or 3 before its checksum


class MendedFile:
    """What the HDF5 library needs of a file: bytes at a place.

    Parameters
    ----------
    file
        The file, open for reading.
    head
        Its superblock.
    """

    def __init__(self, file: BinaryIO, head: Superblock) -> None:
        self._file = file
        self._length = max(head.end, head.size)
        self._at = 0
        self._start = head.start
        file.seek(head.start)
        self._head = file.read(_HEAD + 4)
        if head.version >= 2:
            closed = self._head[:11] + b"\0" + self._head[12:_HEAD]
            self._head = closed + lookup3(closed).to_bytes(4, "little")

    def tell(self) -> int:
        """Return the place."""
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place."""
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._length}[whence]
        self._at = base + offset
        return self._at

    def read(self, count: int) -> bytes:
        """Return the next bytes, zeros where the file has none."""
        count = max(0, min(count, self._length - self._at))
        self._file.seek(self._at)
        data = bytearray(self._file.read(count).ljust(count, b"\0"))
        first, end = self._start - self._at, self._start + len(self._head) - self._at
        if first < count and end > 0:
            data[max(0, first) : end] = self._head[max(0, -first) : count - first]
        self._at += count
        return bytes(data)

    def readinto(self, buffer: memoryview) -> int:
        """Fill the buffer with the next bytes."""
        data = self.read(len(buffer))
        buffer[: len(data)] = data
        return len(data)


def lookup3(data: bytes) -> int:
    """Return the checksum that HDF5 puts behind its metadata."""
    a = b = c = (0xDEADBEEF + len(data)) & _MASK
    at = 0
    while len(data) - at > 12:
        a, b, c = _mixed(*_added(a, b, c, data[at : at + 12]))
        at += 12
    return _finished(*_added(a, b, c, data[at:])) if data[at:] else c


def _added(a: int, b: int, c: int, data: bytes) -> tuple[int, int, int]:
    x, y, z = (int.from_bytes(data[i : i + 4], "little") for i in (0, 4, 8))
    return (a + x) & _MASK, (b + y) & _MASK, (c + z) & _MASK


def _turned(x: int, k: int) -> int:
    return (x << k | x >> 32 - k) & _MASK


def _mixed(a: int, b: int, c: int) -> tuple[int, int, int]:
    for k in (4, 6, 8, 16, 19, 4):
        a = (a - c & _MASK) ^ _turned(c, k)
        c = c + b & _MASK
        a, b, c = b, c, a
    return a, b, c


def _finished(a: int, b: int, c: int) -> int:
    for k in (14, 11, 25, 16, 4, 14, 24):
        c = (c ^ b) - _turned(b, k) & _MASK
        a, b, c = b, c, a
    return b  # the last that was changed
