"""The inner loops of reading, compiled: `encoded_objects.base.compiled` says when they are used.

The numpy forms beside their callers are the reference: values to 1e-6 of them, the same answers.
`recognize-object --version` and a run's provenance say which of the two it was.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path

from encoded_objects.base.compiled import is_wanted, library_made_of, sources_in

FOLDER = Path(__file__).parent.parent
FILE = FOLDER / "kernels.so"
SOURCES = sources_in(FOLDER)


def kernels_in_use() -> str:
    """Return "compiled" or "numpy"."""
    return "numpy" if compiled_kernels() is None else "compiled"


def compiled_kernels() -> ctypes.CDLL | None:
    """Return the compiled form; None where it is missing or unwanted."""
    return load_kernels(FILE) if is_wanted() else None


@lru_cache(maxsize=2)
def load_kernels(file: Path) -> ctypes.CDLL | None:
    """Return the library of the kernels; None where there is none, or one of another text."""
    library = library_made_of(SOURCES, file)
    if library is None:
        return None
    pointer, whole = ctypes.c_void_p, ctypes.c_int64
    library.refine.argtypes = [pointer, whole, whole, *[pointer] * 7]
    library.refine.restype = None
    library.fit_posterior.argtypes = [pointer] * 9
    library.fit_posterior.restype = ctypes.c_int
    library.explained_share.argtypes = [*[pointer] * 5, *[ctypes.c_double] * 2]
    library.explained_share.restype = ctypes.c_double
    library.score_cells.argtypes = [pointer, whole, ctypes.c_double, *[pointer] * 8]
    library.score_cells.restype = ctypes.c_double
    library.add_scores.argtypes = [
        pointer, whole, pointer, pointer, pointer, whole, pointer, pointer, pointer
    ]  # fmt: skip
    library.add_scores.restype = None
    library.sum_lattices.argtypes = [*[whole] * 7, *[pointer] * 4]
    library.sum_lattices.restype = None
    library.look_around.argtypes = [*[whole] * 2, *[pointer] * 2]
    library.look_around.restype = None
    library.name_places.argtypes = [pointer, whole, pointer, pointer, whole, pointer]
    library.name_places.restype = None
    library.count_names.argtypes = [whole, pointer, pointer, pointer]
    library.count_names.restype = whole
    library.count_places.argtypes = [pointer, whole, pointer, pointer, ctypes.c_double]
    library.count_places.restype = whole
    return library
