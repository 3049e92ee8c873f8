"""Whether the strings of an HDF5 file can be read at all.

Texts of attributes stand in global heaps: collections of objects, each with its length. libhdf5
walks along the lengths, and walks for ever where a hurt file says zero.

References
----------
HDF5 File Format Specification 3.0, III.E: disk format level 1E, the global heap.
"""

from __future__ import annotations

from pathlib import Path

_SIGNATURE, _VERSION = b"GCOL", 1
_HEAD = 16  #: bytes before the objects, and before the data of each
_ALIGNED = 8  #: bytes, to which an object's length is rounded up
_SEARCHED = 1 << 26  #: bytes from the beginning; attributes are written before frames


def strings_end(path: Path) -> bool:
    """Tell whether every collection of strings in the beginning of a file has an end.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    with open(path, "rb") as file:
        data = file.read(_SEARCHED)
    at = data.find(_SIGNATURE)
    while at >= 0:
        if at + _HEAD <= len(data) and data[at + 4] == _VERSION and not _ends(data, at):
            return False
        at = data.find(_SIGNATURE, at + 1)
    return True


def _ends(data: bytes, start: int) -> bool:
    """Tell whether the objects of a collection lead to its end, or beyond what was read."""
    end = min(start + _number(data, start + 8), len(data))
    at = start + _HEAD
    while at + _HEAD <= end:
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
