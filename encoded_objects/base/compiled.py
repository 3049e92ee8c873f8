"""Inner loops compiled from C: where their library lies, and whether it may be used.

A package keeps the C beside the Python that calls it, and the numpy form as the reference; both
give the same answers. `hatch_build.py` makes one `kernels.so` of all C files in a folder when the
project is installed. It is left out where it is missing (a checkout that nobody installed), older
than its source (install again) or unwanted (`ENCODED_OBJECTS_KERNELS=numpy`).
"""

from __future__ import annotations

import ctypes
import os
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

CHOICE = "ENCODED_OBJECTS_KERNELS"  #: variable; "numpy" leaves the compiled form out


class _Start(ctypes.Array[ctypes.c_char]):
    """Where the values of an array begin."""

    _type_ = ctypes.c_char
    _length_ = 0


def is_wanted() -> bool:
    """Return whether compiled loops may be used."""
    return os.environ.get(CHOICE) != "numpy"


def sources_in(folder: Path) -> tuple[Path, ...]:
    """Return the C files and headers of which a folder's library is made."""
    return tuple(sorted(folder.rglob("*.[ch]")))


def library_made_of(sources: Sequence[Path], file: Path) -> ctypes.CDLL | None:
    """Return a library; None where there is none, or one of another text."""
    if not file.is_file():
        return None
    library = ctypes.CDLL(str(file))
    if not hasattr(library, "source_sum"):
        return None
    library.source_sum.restype = ctypes.c_uint32
    if library.source_sum() != zlib.crc32(b"".join(one.read_bytes() for one in sources)):
        return None
    return library


def addresses(*arrays: Any) -> list[int | None]:
    """Return where the values of arrays lie, None of none.

    Thrice as fast as `ctypes.data`, which serves those that may not be written.
    """
    return [
        None if one is None
        else ctypes.addressof(_Start.from_buffer(one)) if one.flags.writeable
        else one.ctypes.data
        for one in arrays
    ]  # fmt: skip
