"""Whether the strings of an HDF5 file can be read at all.

Texts of attributes stand in global heaps: collections of objects, each with its length. libhdf5
walks along the lengths, and walks for ever where a hurt file says zero.

References
----------
HDF5 File Format Specification 3.0, III.E: disk format level 1E, the global heap.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

_HEAP = b"GCOL\x01"  #: signature and version
_HEAD = 16  #: bytes before the objects, and before the data of each
_ALIGNED = 8  #: bytes, to which an object's length is rounded up
_SEARCHED = 1 << 26  #: bytes from the beginning; attributes are written before frames
_AT_ONCE = 1 << 20  #: bytes


def strings_end(path: Path) -> bool:
    """Tell whether every collection of strings in the beginning of a file has an end.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    room = 2 * path.stat().st_size  # collections lie apart; those that were freed may overlap
    with open(path, "rb") as file:
        for start in _heaps(file):
            data = _objects(file, start)
            room -= len(data)
            if room < 0 or not _ends(data):
                return False
    return True


def _heaps(file: BinaryIO) -> Iterator[int]:
    """Yield where collections begin."""
    for first in range(0, _SEARCHED, _AT_ONCE):
        file.seek(first)
        data = file.read(_AT_ONCE + len(_HEAP) - 1)
        at = data.find(_HEAP)
        while at >= 0:
            yield first + at
            at = data.find(_HEAP, at + 1)
        if len(data) < _AT_ONCE:
            return


def _objects(file: BinaryIO, start: int) -> bytes:
    """Return the objects of a collection, as far as the file has them."""
    file.seek(start + 8)
    return file.read(max(0, min(_number(file.read(8), 0), _SEARCHED) - _HEAD))


def _ends(data: bytes) -> bool:
    """Tell whether the objects of a collection lead to its end, or beyond the end of the file."""
    at = 0
    while at + _HEAD <= len(data):
        length = _number(data, at + 8)
        if int.from_bytes(data[at : at + 2], "little"):
            at += _HEAD + -(-length // _ALIGNED) * _ALIGNED
        elif length < _HEAD:  # what is free counts its own head
            return False
        else:
            at += length
    return True


def _number(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 8], "little")
