"""The inner loop of the refinement, compiled: `evaluate.c`, built when the project is installed.

The numpy form in `refine` is the reference: the same values to 1e-6 of them, the same answers. It
is also what reads where the compiled form is missing (a checkout that nobody installed), older
than its source (install again) or unwanted (`ENCODED_OBJECTS_KERNELS=numpy`); `recognize-object
--version` and a run's provenance say which of the two it was.
"""

from __future__ import annotations

import ctypes
import os
import zlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.gain import Image
from recognizer.touch.symbols.template import ResponseTemplate

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

FILE = Path(__file__).with_name("evaluate.so")
SOURCE = FILE.with_suffix(".c")  #: the file is of no use that was made of another text
CHOICE = "ENCODED_OBJECTS_KERNELS"  #: variable; "numpy" leaves the compiled form out

_WHOLE = ("b", "n", "q", "size", "hardens", "falls")
_REAL = (
    "symbol", "deepest", "pitch", "half", "step", "noise", "least_gain", "full_press",
    "least_press", "quiet", "displaced", "loud", "most", "first", "far",
)  # fmt: skip


class _Scene(ctypes.Structure):
    """`Scene` of evaluate.c."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in _WHOLE),
        *((name, ctypes.c_double) for name in _REAL),
    ]


def kernels_in_use() -> str:
    """Return "compiled" or "numpy"."""
    return "numpy" if compiled_kernels() is None else "compiled"


def compiled_kernels() -> ctypes.CDLL | None:
    """Return the compiled form; None where it is missing or unwanted."""
    return None if os.environ.get(CHOICE) == "numpy" else load_kernels(FILE)


@lru_cache(maxsize=2)
def load_kernels(file: Path) -> ctypes.CDLL | None:
    """Return a library of evaluate.c; None where there is none, or one of another text."""
    if not file.is_file():
        return None
    library = ctypes.CDLL(str(file))
    if not hasattr(library, "source_sum"):
        return None
    library.source_sum.restype = ctypes.c_uint32
    if library.source_sum() != zlib.crc32(SOURCE.read_bytes()):
        return None
    library.work_size.restype = ctypes.c_int64
    for function, arguments in ((library.work_size, 1), (library.cells_under, 5)):
        function.argtypes = [ctypes.c_void_p] * arguments
    library.evaluate.argtypes = [ctypes.c_void_p] * 17
    library.cells_under.restype = library.evaluate.restype = None
    return library


def evaluate_compiled(
    library: ctypes.CDLL,
    image: Image,
    template: ResponseTemplate,
    pose: Array,
    gain: Array,
    known: Array,
    precision: Array,
    shown: Callable[[Ints], Ints] | None,
) -> tuple[Array, Array, Array]:
    """Return value (b,), normal (b, 11, 11) and right (b, 11) of `refine.Lattices`.

    Parameters
    ----------
    pose, gain
        (b, 7) and (b, 4) of b candidates.
    known, precision
        (b, 11) how far each unknown lies from what is known of it beforehand, and (11,) how well.
    shown
        (b, n, 2) cells -> (b, n) labels; None: each cell shows what fits best.
    """
    count, tactels = len(pose), len(image.forces)
    held: list[NDArray[Any]] = []

    def address(values: NDArray[Any] | None, kind: Any = np.float64) -> int | None:
        if values is None:
            return None
        held.append(np.ascontiguousarray(values, kind))  # until the call is over
        return held[-1].ctypes.data

    scene = _scene(image, template, count)
    at = ctypes.addressof(scene)
    points, poses = address(image.points_mm), address(pose)
    labels = None
    if shown is not None:
        cells = np.empty((count, tactels, 2), np.int64)
        offsets = np.empty((count, tactels, 2))
        library.cells_under(at, points, poses, cells.ctypes.data, offsets.ctypes.data)
        labels = address(shown(cells), np.int64)
    work = np.empty(library.work_size(at))
    value, right = np.empty(count), np.empty((count, len(precision)))
    normal = np.empty((count, len(precision), len(precision)))
    library.evaluate(
        at, points, address(image.forces), address(image.trust), address(image.plane),
        address(image.loaded, np.uint8), address(image.falls),
        address(template.rimmed, np.float32), poses, address(gain), labels, address(known),
        address(precision), work.ctypes.data, value.ctypes.data,
        normal.ctypes.data, right.ctypes.data,
    )  # fmt: skip
    return value, normal, right


def _scene(image: Image, template: ResponseTemplate, count: int) -> _Scene:
    gain, noise, pressing = image.settings.gain, image.settings.noise, image.pressing
    return _Scene(
        b=count, n=len(image.forces), q=template.order, size=template.size,
        hardens=int(pressing.hardens), falls=0 if image.falls is None else len(image.falls),
        symbol=pressing.symbol, deepest=pressing.deepest, pitch=template.pitch_mm,
        half=template.half_mm, step=template.step_mm, noise=image.noise,
        least_gain=gain.least_gain, full_press=gain.full_press, least_press=gain.least_press,
        quiet=noise.quiet, displaced=noise.displaced_mm, loud=noise.loud, most=noise.most,
        first=noise.first, far=noise.far,
    )  # fmt: skip
