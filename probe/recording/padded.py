"""A file that was left open or lost its end, seen with zeros where its end is missing.

The file itself is not touched. What depends on the missing bytes fails alone, by its own
checksum.

Why by hand: `h5py.File(path, "r")` refuses a file whose writer was killed ("may use h5clear",
a programme that pip does not bring) and one that is shorter than it says ("truncated file").
With `swmr=True` it opens both, but reads metadata with a wrong checksum again and again for a
writer that is gone: a damaged file took more than 9 minutes in HDF5 2.0, and h5py has no
`H5Pset_metadata_read_attempts`. Through a Python file HDF5 looks at no flags and reads once;
only the length must be right.
"""

from __future__ import annotations

import io
from typing import BinaryIO

from probe.recording.superblock import Superblock


class PaddedFile(io.RawIOBase):
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

    def readable(self) -> bool:
        """Say that it can be read."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place."""
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._length}[whence]
        self._at = base + offset
        return self._at

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        """Fill the buffer with the next bytes, zeros where the file has none."""
        count = max(0, min(len(buffer), self._length - self._at))
        self._file.seek(self._at)
        buffer[:count] = self._file.read(count).ljust(count, b"\0")
        self._at += count
        return count
