"""Where images may stand in a file that is no recording of ours.

.npy and .npz, MATLAB files (v4 to v7 by scipy, v7.3 is HDF5), and HDF5 -> the arrays in
them, read a block at a time. Time may be the first axis or, as MATLAB users have it, the
last. HDF5 files that MATLAB wrote have their axes in reverse order.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from probe.errors import RecordingError
from probe.recording.opened import explain_errors, open_recording

if TYPE_CHECKING:
    import h5py


@dataclass(frozen=True, slots=True)
class FileArray:
    """An array in a file."""

    name: str
    shape: tuple[int, ...]  #: with the axes in the order of the programme that wrote it
    dtype: np.dtype[Any]
    part: Callable[[tuple[slice, ...]], NDArray[Any]]  #: read some of it

    def frames(self, image: tuple[int, int]) -> int | None:
        """Return how many images of that shape it holds; None if it holds other things."""
        if self.dtype.kind not in "biuf":
            return None
        if self.shape == image:
            return 1
        if len(self.shape) == 3 and self.shape[1:] == image:
            return self.shape[0]
        if len(self.shape) == 3 and self.shape[:2] == image:
            return self.shape[2]
        return None

    def images(self, image: tuple[int, int], start: int, stop: int) -> NDArray[Any]:
        """Return images `start` ... `stop` - 1, (n, rows, columns)."""
        if self.shape == image:
            return self.part((slice(None), slice(None)))[None][start:stop]
        if self.shape[1:] == image:
            return self.part((slice(start, stop), slice(None), slice(None)))
        return np.moveaxis(self.part((slice(None), slice(None), slice(start, stop))), 2, 0)


@contextmanager
def arrays_of(path: Path) -> Iterator[list[FileArray]]:
    """Open a file and give the arrays in it.

    Raises
    ------
    RecordingError
        No such file, or no file of these kinds.
    """
    with explain_errors(path, "read"), open(path, "rb") as file:
        head = file.read(128)
    if head.startswith(b"\x93NUMPY") or zipfile.is_zipfile(path):
        yield _numpy(path)
    elif head.startswith(b"MATLAB 5.0") or (path.suffix == ".mat" and b"MATLAB 7.3" not in head):
        yield _matlab(path)
    else:
        with open_recording(path) as hdf5:
            yield _hdf5(hdf5)


def _numpy(path: Path) -> list[FileArray]:
    try:
        with explain_errors(path, "read"):
            loaded = np.load(path, mmap_mode="r", allow_pickle=False)
            if isinstance(loaded, np.ndarray):
                return [_in_memory(path.stem, loaded)]
            with loaded:
                return [_in_memory(name, loaded[name]) for name in loaded.files]
    except RecordingError as error:
        if not isinstance(error.__cause__, ValueError):
            raise
        raise RecordingError(
            "it holds objects, or it is damaged",
            fix="save a plain array of numbers (N, rows, columns)",
            place=str(path),
        ) from error


def _matlab(path: Path) -> list[FileArray]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        with explain_errors(path, "read"):
            variables = loadmat(path, appendmat=False)
    except MatReadError as error:
        raise RecordingError(
            "it is no MATLAB file, or it is damaged", fix="save it again", place=str(path)
        ) from error
    return [
        _in_memory(name, array)
        for name, array in variables.items()
        if isinstance(array, np.ndarray) and not name.startswith("__")
    ]


def _in_memory(name: str, array: NDArray[Any]) -> FileArray:
    return FileArray(name, array.shape, array.dtype, lambda part: array[part])


def _hdf5(file: h5py.File) -> list[FileArray]:
    import h5py

    found: list[FileArray] = []

    def note(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.shape is not None:
            found.append(_dataset(name, item))

    with explain_errors(Path(file.filename), "read"):
        file.visititems(note)
    return found


def _dataset(name: str, dataset: h5py.Dataset) -> FileArray:
    def part(slices: tuple[slice, ...]) -> NDArray[Any]:
        with explain_errors(Path(dataset.file.filename), "read"):
            read: NDArray[Any] = dataset[slices[::-1]].T if reverse else dataset[slices]
        return read

    reverse = "MATLAB_class" in dataset.attrs
    shape = dataset.shape[::-1] if reverse else dataset.shape
    return FileArray(name, tuple(map(int, shape)), dataset.dtype, part)
