"""The first bytes of an HDF5 file: who left it open, and how long it should be.

HDF5 says "unable to open file" for many reasons; these bytes tell them apart.

References
----------
HDF5 File Format Specification 3.0, II.A: disk format level 0A, the superblock.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_WRITING, _SWMR = 0x01, 0x04
_END_AT = {0: 40, 1: 44, 2: 28, 3: 28}  #: where the address of the end stands, by version


@dataclass(frozen=True, slots=True)
class Superblock:
    """What the start of an HDF5 file says about the whole."""

    version: int
    start: int  #: where it stands, bytes from the beginning of the file
    writing: bool  #: opened for writing and not closed
    swmr: bool  #: so that it can be read meanwhile
    end: int  #: bytes that the file should have
    size: int  #: bytes that it has

    @property
    def truncated(self) -> bool:
        """Whether the end of the file is missing."""
        return self.size < self.end

    @property
    def whole(self) -> bool:
        """Whether it was closed by its writer and has its whole length."""
        return not self.writing and not self.truncated


def superblock_of(path: Path) -> Superblock | None:
    """Return the superblock of a file; None if it is no HDF5 file.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        start = 0
        while start < size:  # a user block of 512, 1024, 2048, ... bytes may come first
            file.seek(start)
            head = file.read(64)
            if head.startswith(_SIGNATURE) and len(head) >= 12:
                return _parse_superblock(head, start, size)
            start = max(512, 2 * start)
    return None


def _parse_superblock(head: bytes, start: int, size: int) -> Superblock | None:
    version = head[8]
    if version not in _END_AT:
        return None
    width = head[13] if version < 2 else head[9]
    flags = head[11] if version >= 3 else 0
    at, end = _END_AT[version], size
    if width == 8 and len(head) >= at + 8:
        end = int.from_bytes(head[at : at + 8], "little")
    return Superblock(version, start, bool(flags & _WRITING), bool(flags & _SWMR), end, size)
