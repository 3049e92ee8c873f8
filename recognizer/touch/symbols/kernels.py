"""The inner loops of reading, compiled: built with the project from C.

The numpy forms beside their callers are the reference: values to 1e-6 of them, the same answers.
They are also what reads where the compiled form is missing (a checkout that nobody installed),
older than its source (install again) or unwanted (`ENCODED_OBJECTS_KERNELS=numpy`);
`recognize-object --version` and a run's provenance say which of the two it was.
"""

from __future__ import annotations

import ctypes
import os
import zlib
from functools import lru_cache
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent.parent
FILE = FOLDER / "kernels.so"
SOURCES = tuple(sorted(FOLDER.rglob("*.c")))
CHOICE = "ENCODED_OBJECTS_KERNELS"  #: variable; "numpy" leaves the compiled form out


class _Start(ctypes.Array[ctypes.c_char]):
    """Where the values of an array begin."""

    _type_ = ctypes.c_char
    _length_ = 0


def kernels_in_use() -> str:
    """Return "compiled" or "numpy"."""
    return "numpy" if compiled_kernels() is None else "compiled"


def compiled_kernels() -> ctypes.CDLL | None:
    """Return the compiled form; None where it is missing or unwanted."""
    return None if os.environ.get(CHOICE) == "numpy" else load_kernels(FILE)


@lru_cache(maxsize=2)
def load_kernels(file: Path) -> ctypes.CDLL | None:
    """Return the library of the kernels; None where there is none, or one of another text."""
    if not file.is_file():
        return None
    library = ctypes.CDLL(str(file))
    if not hasattr(library, "source_sum"):
        return None
    library.source_sum.restype = ctypes.c_uint32
    if library.source_sum() != zlib.crc32(b"".join(one.read_bytes() for one in SOURCES)):
        return None
    pointer, whole = ctypes.c_void_p, ctypes.c_int64
    library.refine.argtypes = [pointer, whole, whole, *[pointer] * 7]
    library.refine.restype = None
    library.linearize.argtypes = [pointer] * 9
    library.linearize.restype = None
    library.score_cells.argtypes = [pointer, whole, ctypes.c_double, *[pointer] * 8]
    library.score_cells.restype = ctypes.c_double
    library.add_scores.argtypes = [
        pointer, whole, pointer, pointer, pointer, whole, pointer, pointer, pointer
    ]  # fmt: skip
    library.add_scores.restype = None
    library.sum_lattices.argtypes = [*[whole] * 7, *[pointer] * 3]
    library.sum_lattices.restype = None
    library.look_around.argtypes = [*[whole] * 2, *[pointer] * 2]
    library.look_around.restype = None
    real = ctypes.c_double
    library.fit_spread.argtypes = [*[whole] * 3, *[real] * 3, *[pointer] * 7]
    library.fit_spread.restype = ctypes.c_int
    library.name_places.argtypes = [pointer, whole, pointer, pointer, whole, pointer]
    library.name_places.restype = None
    library.count_names.argtypes = [whole, pointer, pointer, pointer]
    library.count_names.restype = whole
    library.count_places.argtypes = [pointer, whole, pointer, pointer, ctypes.c_double]
    library.count_places.restype = whole
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
