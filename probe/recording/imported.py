"""Others' images -> a recording of counts.

Sources: .npy and .npz, MATLAB files (v4 to v7 by scipy, v7.3 is HDF5), HDF5, a table (.csv), a
folder of grey pictures in the order of their names. Time may be the first axis of an array or, as
MATLAB users have it, the last. A table holds an image a line (rows * columns numbers, row 0 first;
a head line is skipped, and where it names `r0c0`, `r0c1`, ... as our own tables do, those columns
are taken), or one image (rows lines of columns numbers).

Whole numbers 0 ... 65535 are taken as they are. Other values of a sensor type that says what
one count is (depth in mm, force in N) are counted in that unit, below 0 as 0. Anything else
(voltages, values with the bias removed) is scaled: value = scale_offset + scale * count, with
the largest value at 65535, and zero at zero unless there are negative values. Both numbers stand
in the attributes, and `units` says "scaled".
"""

from __future__ import annotations

import csv
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType, choose_sensor_type, sensor_type_text
from probe.errors import RecordingError
from probe.frame import WRIST
from probe.recording.files import check_name, explain_errors
from probe.recording.guard import open_hdf5
from probe.recording.hdf5 import write_recording
from probe.recording.layout import NOMINAL_HZ, FrameBlock, RecordingOrigin
from probe.recording.read import Recording
from probe.recording.table import table_header

if TYPE_CHECKING:
    import h5py

SUFFIXES: Final = (".png", ".pgm", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg")
_AT_ONCE: Final = 1024  #: images read at a time
_FULL: Final = 65535  #: counts


@dataclass(frozen=True, slots=True)
class Scale:
    """How values become counts: value = offset + scale * count."""

    offset: float
    scale: float


def import_array(
    path: Path | str,
    out: Path | str,
    *,
    dataset: str | None = None,
    rate_hz: float = NOMINAL_HZ,
    sensor: str = "",
    sensor_type: str | SensorType | None = None,
    replace: bool = False,
) -> Recording:
    """Make a recording from an array of images.

    Parameters
    ----------
    path
        A .npy, .npz, .mat or HDF5 file with an array (N, rows, columns), (rows, columns, N) or
        (rows, columns), the first axis taken for time where both would do; a table (.csv) or a
        folder of pictures.
    out
        The recording to be made.
    dataset
        Which array, when there are several.
    rate_hz
        Frames per second; the array does not tell.
    sensor
        What the recording shall say about its origin.
    sensor_type
        A type, its name or file: whose images they are; `fsr-16` if not given.
    replace
        Let it take the place of an older recording of that name.

    Raises
    ------
    RecordingError
        No such file or array, several arrays, values that are no numbers, a name that is
        taken, a full disk.
    """
    path, out = Path(path), Path(out)
    check_name(out, replace=replace)
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise RecordingError(f"a rate of {rate_hz:g} Hz", fix="give frames per second above 0")
    kind = choose_sensor_type(sensor_type, "", None, str(path))
    with _arrays_at(path, kind.shape) as arrays:
        found = _choose_array(path, arrays, dataset, kind)
        scale = _scale(path, found, kind)
        more: dict[str, Any] = {"imported_from": path.name, "imported_array": found.name}
        if scale:
            more |= {"scale": scale.scale, "scale_offset": scale.offset}
        units = "counts" if scale is None or scale.scale == kind.unit else "scaled"
        origin = RecordingOrigin(sensor, "", units, sensor_type_text(kind), MappingProxyType(more))
        blocks = (
            _block(images, first, scale, 1e9 / rate_hz)
            for first, images in _images(found, kind.shape)
        )
        write_recording(out, origin, blocks, replace=replace)
    return Recording(out)


@contextmanager
def _arrays_at(path: Path, image: tuple[int, int]) -> Iterator[list[FileArray]]:
    """Open whatever holds images: a folder of pictures, a table, a file of arrays."""
    if path.is_dir():
        yield [_folder_array(path, image)]
        return
    if path.suffix.lower() == ".csv":
        yield [_table_array(path, image)]
        return
    with explain_errors(path, "read"), open(path, "rb") as file:
        head = file.read(128)
    if head.startswith(b"\x93NUMPY") or zipfile.is_zipfile(path):
        yield _numpy_arrays(path)
    elif head.startswith(b"MATLAB 5.0") or (path.suffix == ".mat" and b"MATLAB 7.3" not in head):
        yield _matlab_arrays(path)
    else:
        with open_hdf5(path) as (hdf5, _):
            yield _hdf5_arrays(hdf5)


def _choose_array(
    path: Path, arrays: list[FileArray], name: str | None, kind: SensorType
) -> FileArray:
    """Return the array that was asked for, or the only one that may be meant."""
    images = [found for found in arrays if found.frames(kind.shape) is not None]
    named = [found for found in images if found.name == (name or "frames").strip("/")]
    if named or (name is None and len(images) == 1):
        return (named or images)[0]
    here = ", ".join(f"{found.name} {found.shape}" for found in (images or arrays)) or "nothing"
    if not images:
        cause = f"no array of images (N, {kind.rows}, {kind.columns}) in it, but {here}"
        fix = f"give the --sensor-type {_types_of(arrays)}, or reshape it first"
    elif name is None:
        cause, fix = f"several arrays of images in it: {here}", "say which by --dataset NAME"
    else:
        cause, fix = f"no array of images '{name}' in it, but {here}", "take one of these"
    raise RecordingError(cause, fix=fix, place=str(path))


def _types_of(arrays: list[FileArray]) -> str:
    """Return the shipped types of which one of the arrays holds images, in words."""
    from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names

    shapes = {name: sensor_type_named(name).shape for name in shipped_names()}
    alike = [n for n, shape in shapes.items() if any(one.frames(shape) for one in arrays)]
    return " or ".join(alike) or "whose images they are"


def _images(found: FileArray, image: tuple[int, int]) -> Iterator[tuple[int, NDArray[Any]]]:
    frames = found.frames(image) or 0
    for first in range(0, frames, _AT_ONCE):
        yield first, found.images(image, first, min(first + _AT_ONCE, frames))


def _scale(path: Path, found: FileArray, kind: SensorType) -> Scale | None:
    """Return how the values become counts; None if they are counts."""
    least, most, whole = 0.0, 0.0, True
    for first, images in _images(found, kind.shape):
        bad = ~np.isfinite(images)
        if bad.any():
            raise RecordingError(
                f"{found.name} holds values that are no numbers, "
                f"the first in image {first + int(np.argwhere(bad)[0, 0])}",
                fix="replace them, or leave those images out",
                place=str(path),
            )
        least, most = min(least, float(images.min())), max(most, float(images.max()))
        whole = whole and (images.dtype.kind != "f" or bool((images == np.floor(images)).all()))
    if whole and least >= 0 and most <= _FULL:
        return None
    if kind.value != "counts" and most <= _FULL * kind.unit:
        return Scale(0.0, kind.unit)
    scale = most / _FULL - least / _FULL
    if scale < np.finfo(np.float64).tiny:
        raise RecordingError(
            f"{found.name} holds nothing above {most:g}",
            fix="multiply the values by a power of ten",
            place=str(path),
        )
    return Scale(least, scale)


def _block(images: NDArray[Any], first: int, scale: Scale | None, period_ns: float) -> FrameBlock:
    if scale:
        images = np.rint(images / scale.scale - scale.offset / scale.scale).clip(0, _FULL)
    number = np.arange(first, first + len(images))
    return FrameBlock(
        images.astype(np.uint16),
        np.rint(number * period_ns).astype(np.int64),
        number,
        np.zeros((len(images), WRIST), np.uint16),
        None,
    )


@dataclass(frozen=True, slots=True)
class FileArray:
    """An array in a file, read a block at a time."""

    name: str
    shape: tuple[int, ...]  #: with the axes in the order of the programme that wrote it
    dtype: np.dtype[Any]
    part: Callable[[tuple[slice, ...]], NDArray[Any]]  #: reads these slices

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


def _numpy_arrays(path: Path) -> list[FileArray]:
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


def _matlab_arrays(path: Path) -> list[FileArray]:
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


def _hdf5_arrays(file: h5py.File) -> list[FileArray]:
    import h5py

    found: list[FileArray] = []

    def note(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.shape is not None:
            found.append(_dataset(name, item))

    with explain_errors(Path(file.filename), "read"):
        file.visititems(note)
    return found


def _dataset(name: str, dataset: h5py.Dataset) -> FileArray:
    reverse = "MATLAB_class" in dataset.attrs
    shape = dataset.shape[::-1] if reverse else dataset.shape

    def part(slices: tuple[slice, ...]) -> NDArray[Any]:
        with explain_errors(Path(dataset.file.filename), "read"):
            read: NDArray[Any] = dataset[slices[::-1]].T if reverse else dataset[slices]
        return read

    return FileArray(name, tuple(map(int, shape)), dataset.dtype, part)


def _folder_array(folder: Path, image: tuple[int, int]) -> FileArray:
    """Return the pictures of a folder as one array; each is read when it is asked for."""
    with explain_errors(folder, "read"):
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise RecordingError(
            "no picture in the folder", fix=f"put {', '.join(SUFFIXES)} there", place=str(folder)
        )
    for path in paths:
        _picture(path, image)

    def part(slices: tuple[slice, ...]) -> NDArray[Any]:
        return np.stack([_picture(path, image) for path in paths[slices[0]]])[:, *slices[1:]]

    return FileArray(folder.name, (len(paths), *image), np.dtype(np.float64), part)


def _table_array(path: Path, image: tuple[int, int]) -> FileArray:
    """Return the images of a table of numbers."""
    with explain_errors(path, "read"):
        try:
            with open(path, encoding="utf-8-sig", newline="") as file:
                lines = [line for line in csv.reader(file) if any(cell.strip() for cell in line)]
        except (UnicodeError, csv.Error) as bad:
            raise RecordingError(
                f"it is no table: {bad}", fix="save it as CSV, UTF-8", place=str(path)
            ) from bad
    head = [] if not lines or _are_numbers(lines[0]) else [name.strip() for name in lines.pop(0)]
    wanted = [name for name in table_header(image) if name.startswith("r")]
    if all(name in head for name in wanted):
        columns = [head.index(name) for name in wanted]
        lines = [[line[c] for c in columns] if len(line) == len(head) else line for line in lines]
    values = _numbers(path, lines, bool(head))
    rows, columns_ = image
    if values.shape == image:
        values = values[None]
    elif values.ndim == 2 and values.shape[1] == rows * columns_:
        values = values.reshape(-1, rows, columns_)
    else:
        raise RecordingError(
            f"lines of {values.shape[-1]} numbers are no images of {rows} x {columns_}",
            fix=f"write {rows * columns_} numbers a line, or give the --sensor-type",
            place=str(path),
        )
    return FileArray(path.stem, values.shape, values.dtype, lambda slices: values[slices])


def _picture(path: Path, image: tuple[int, int]) -> NDArray[np.float64]:
    from PIL import Image, UnidentifiedImageError

    with explain_errors(path, "read"):
        try:
            with Image.open(path) as opened:
                values = np.asarray(opened)
        except (UnidentifiedImageError, SyntaxError) as bad:
            raise RecordingError(
                "it is no picture, or it is damaged", fix="save it again", place=str(path)
            ) from bad
    if values.shape != image or values.dtype.kind not in "uif":
        raise RecordingError(
            f"a picture of {' x '.join(map(str, values.shape))}, not of "
            f"{image[0]} x {image[1]} grey values",
            fix="save it in grey, a pixel a tactel; or give the --sensor-type",
            place=str(path),
        )
    return values.astype(np.float64)


def _are_numbers(cells: list[str]) -> bool:
    try:
        [float(cell) for cell in cells]
    except ValueError:
        return False
    return True


def _numbers(path: Path, lines: list[list[str]], headed: bool) -> NDArray[np.float64]:
    width = len(lines[0]) if lines else 0
    for number, line in enumerate(lines, 2 if headed else 1):
        if len(line) != width or not _are_numbers(line):
            raise RecordingError(
                f"not {width} numbers as in the lines before",
                fix="write numbers with commas between, as many in each line",
                place=f"{path}:{number}",
            )
    if not lines:
        raise RecordingError("it holds no numbers", fix="write an image a line", place=str(path))
    return np.array([[float(cell) for cell in line] for line in lines])
