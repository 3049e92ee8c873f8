"""The look-up of heights, compiled: `encoded_objects.base.compiled` says when it is used."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path

from encoded_objects.base.compiled import is_wanted, library_made_of, sources_in

FOLDER = Path(__file__).parent
FILE = FOLDER / "kernels.so"
SOURCES = sources_in(FOLDER)


def compiled_kernels() -> ctypes.CDLL | None:
    """Return the compiled form; None where it is missing or unwanted."""
    return load_kernels(FILE) if is_wanted() else None


@lru_cache(maxsize=2)
def load_kernels(file: Path) -> ctypes.CDLL | None:
    """Return the library of the kernels; None where there is none, or one of another text."""
    library = library_made_of(SOURCES, file)
    if library is None:
        return None
    pointer, whole, real = ctypes.c_void_p, ctypes.c_int64, ctypes.c_double
    library.look_up_heights.argtypes = [
        whole, pointer, real, real, real, whole, whole, *[pointer] * 4, real, pointer
    ]  # fmt: skip
    library.look_up_heights.restype = None
    return library
