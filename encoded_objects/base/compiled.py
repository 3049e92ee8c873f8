"""Inner loops compiled from C, which a package keeps next to the Python that calls them.

`hatch_build.py` makes one `kernels.so` of all C files in a folder when the project is installed.
Tests hold them to plain forms, and the answers of thousands of touches (`tests/corpora`) to what
they were.
"""

from __future__ import annotations

import ctypes
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from encoded_objects.base.errors import EncodedObjectsError

WHOLE, REAL, POINTER = ctypes.c_int64, ctypes.c_double, ctypes.c_void_p  #: types of arguments

#: Result and arguments of each function of a library.
Signatures = Mapping[str, tuple[Any, Sequence[Any]]]


class KernelsError(EncodedObjectsError):
    """The compiled loops are missing, or older than their source."""


class _Start(ctypes.Array[ctypes.c_char]):
    """Where the values of an array begin."""

    _type_ = ctypes.c_char
    _length_ = 0


def sources_in(folder: Path) -> tuple[Path, ...]:
    """Return the C files and headers of which a folder's library is made."""
    return tuple(sorted(folder.rglob("*.[ch]")))


def load_library(folder: Path, signatures: Signatures, file: Path | None = None) -> ctypes.CDLL:
    """Return the compiled loops of a folder; `file` in place of its `kernels.so`.

    Raises KernelsError: there is none, or it was made of other sources.
    """
    file = file or folder / "kernels.so"
    library = ctypes.CDLL(str(file)) if file.is_file() else None
    if library is None or not _is_made_of(library, sources_in(folder)):
        raise KernelsError(
            f"the compiled loops are {'missing' if library is None else 'older than their source'}",
            fix="install the project again: pip install -e . (or pip install encoded-objects)",
            place=file,
        )
    for name, (result, arguments) in signatures.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


def _is_made_of(library: ctypes.CDLL, sources: Sequence[Path]) -> bool:
    if not hasattr(library, "source_sum"):
        return False
    library.source_sum.restype = ctypes.c_uint32
    made_of: int = library.source_sum()
    return made_of == zlib.crc32(b"".join(one.read_bytes() for one in sources))


def addresses(*arrays: Any) -> list[int | None]:
    """Return where the values of arrays lie, None of none; thrice as fast as `ctypes.data`."""
    return [
        None if one is None
        else ctypes.addressof(_Start.from_buffer(one)) if one.flags.writeable
        else one.ctypes.data
        for one in arrays
    ]  # fmt: skip
