"""Others' images -> a recording of counts.

Sources: .npy and .npz, MATLAB files (v4 to v7 by scipy, v7.3 is HDF5), HDF5, a Zarr store as FTP-1
has it, a table (.csv), a folder of grey pictures in the order of their names. Time may be the first
axis of an array or, as MATLAB users have it, the last. A table holds an image a line (rows *
columns numbers, row 0 first; a head line is skipped, and where it names `r0c0`, `r0c1`, ... as our
own tables do, or `r1c1`, ..., those columns are taken, and with them `seq`, `t_ns`, `wrist0` ...
and `p00` ...), or one image (rows lines of columns numbers).

Whole numbers 0 ... 65535 are taken as they are. Other values of a sensor type that says what
one count is (depth in mm, force in N) are counted in that unit, below 0 as 0. Anything else
(voltages, values with the bias removed) is scaled: value = scale_offset + scale * count, with
the largest value at 65535, and zero at zero unless there are negative values. Both numbers stand
in the attributes, and `units` says "scaled".
"""

from __future__ import annotations

import csv
import io
import math
import re
import tokenize
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.foreign import DAMAGE, foreign_bytes, foreign_member, open_regular
from encoded_objects.base.sensor_type import (
    SensorType,
    choose_sensor_type,
    sensor_type_text,
    shipped_like,
)
from probe.errors import RecordingError
from probe.frame import WRIST, are_rigid
from probe.recording.files import check_name, explain_errors
from probe.recording.guard import open_hdf5
from probe.recording.hdf5 import write_recording
from probe.recording.layout import DATASETS, NOMINAL_HZ, FrameBlock, RecordingOrigin
from probe.recording.read import Recording
from probe.recording.table import POSE_HEADER, table_header
from probe.recording.zarr import is_store, store_arrays

if TYPE_CHECKING:
    import h5py

SUFFIXES: Final = (".png", ".pgm", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg")
_AT_ONCE: Final = 1024  #: images read at a time
_MOST_BYTES: Final = 1 << 29  #: of the arrays of an archive, which are read as a whole
_MOST_TABLE: Final = 128 << 20  #: bytes of a table: its cells take 16 times that in memory
_FULL: Final = 65535  #: counts
_PLACE: Final = re.compile(r"r(\d{1,6})c(\d{1,6})", re.ASCII | re.IGNORECASE)  #: of a tactel
_OTHER: Final = {
    "t_ns": "a time is a whole number of ns",
    "seq": "a number is whole",
    "pose": "a pose is a rigid transform of 16 numbers, or empty",
    "wrist": "readings of the wrist are whole numbers 0 ... 65535",
}  #: what a column must hold
_WHOLE: Final = re.compile(r"\s*[+-]?\d{1,19}\s*", re.ASCII)


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
        A .npy, .npz, .mat or HDF5 file, or the folder of a Zarr store, with an array
        (N, rows, columns), (rows, columns, N) or (rows, columns), the first axis taken for time
        where both would do; a table (.csv) or a folder of pictures. Of an FTP-1 store `NAME/k` is
        pad k of the group `NAME`.
    out, replace
        The recording to be made, also in place of an older one.
    dataset
        Which array, when there are several.
    rate_hz
        Frames per second; the array does not tell.
    sensor, sensor_type
        Whose images they are: the name to be kept, and a type, its name or file; `fsr-16`.

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
        scale = scale_of(path, found.name, _images(path, found, kind.shape), kind)
        more: dict[str, Any] = {"imported_from": path.name, "imported_array": found.name}
        units, scaled = scale_attributes(scale, kind)
        more |= scaled
        if left := _left_out(arrays, found, kind.shape):
            more["not_read"] = left
        origin = RecordingOrigin(sensor, "", units, sensor_type_text(kind), MappingProxyType(more))
        images = _images(path, found, kind.shape)
        blocks = (_block(found, part, first, scale, 1e9 / rate_hz) for first, part in images)
        write_recording(out, origin, blocks, replace=replace)
    return Recording(out)


@dataclass(frozen=True, slots=True)
class FileArray:
    """An array in a file, read a block at a time."""

    name: str
    values: Any  #: an ndarray, or a dataset of HDF5
    reverse: bool = False  #: its axes stand in the order of MATLAB
    others: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """What it says of its images besides, under the names of `DATASETS`."""
    left: tuple[str, ...] = ()  #: names of columns that are not read

    @property
    def shape(self) -> tuple[int, ...]:
        """The axes in the order of the programme that wrote it."""
        shape = tuple(map(int, self.values.shape))
        return shape[::-1] if self.reverse else shape

    def frames(self, image: tuple[int, int]) -> int | None:
        """Return how many images of that shape it holds; None if it holds other things."""
        shape = self.shape
        if self.values.dtype.kind not in "biuf":
            return None
        if shape == image:
            return 1
        if len(shape) != 3 or image not in (shape[1:], shape[:2]):
            return None
        return shape[0] if shape[1:] == image else shape[2]

    def images(self, image: tuple[int, int], start: int, stop: int) -> NDArray[Any]:
        """Return images `start` ... `stop` - 1, (n, rows, columns)."""
        everything, time = slice(None), slice(start, stop)
        if self.shape == image:
            return self._read(everything, everything)[None][time]
        if self.shape[1:] == image:
            return self._read(time, everything, everything)
        return np.moveaxis(self._read(everything, everything, time), 2, 0)

    def _read(self, *slices: slice) -> NDArray[Any]:
        read: NDArray[Any] = self.values[slices[::-1] if self.reverse else slices]
        return read.T if self.reverse else read


@contextmanager
def _arrays_at(path: Path, image: tuple[int, int]) -> Iterator[list[FileArray]]:
    """Open whatever holds images: a folder of pictures, a table, a file of arrays."""
    if path.is_dir() and is_store(path):
        yield [FileArray(name, array) for name, array in store_arrays(path)]
        return
    if path.is_dir():
        yield [_folder_array(path, image)]
        return
    if path.suffix.lower() == ".csv":
        yield [_table_array(path, image)]
        return
    with explain_errors(path, "read"), open_regular(path) as file:
        head = file.read(128)
        archive = zipfile.is_zipfile(file)
    if head.startswith(b"\x93NUMPY") or archive:
        yield _numpy_arrays(path, archive=archive)
    elif head.startswith(b"MATLAB 5.0") or (path.suffix == ".mat" and b"MATLAB 7.3" not in head):
        yield _matlab_arrays(path)
    else:
        with open_hdf5(path) as (hdf5, _):
            yield _hdf5_arrays(path, hdf5)


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
        alike = shipped_like(lambda one: any(array.frames(one.shape) for array in arrays))
        fix = f"give the --sensor-type {alike or 'whose images they are'}, or reshape it first"
    elif name is None:
        cause, fix = f"several arrays of images in it: {here}", "say which by --dataset NAME"
    else:
        cause, fix = f"no array of images '{name}' in it, but {here}", "take one of these"
    raise RecordingError(cause, fix=fix, place=path)


def _left_out(arrays: list[FileArray], found: FileArray, image: tuple[int, int]) -> str:
    """Return what may be times of the images and is not read, in words; empty where times are."""
    if "t_ns" in found.others:
        return ""
    of_each = [one.name for one in arrays if one.shape == (found.frames(image),)]
    names = ["".join(filter(str.isprintable, name))[:40] for name in (*found.left, *of_each)]
    return ", ".join(names[:5]) + (", ..." if names[5:] else "")


def _images(
    path: Path, found: FileArray, image: tuple[int, int]
) -> Iterator[tuple[int, NDArray[Any]]]:
    frames = found.frames(image) or 0
    for first in range(0, frames, _AT_ONCE):
        with explain_errors(path, "read"):
            images = found.images(image, first, min(first + _AT_ONCE, frames))
        yield first, images


def scale_of(
    path: Path, name: str, numbered: Iterable[tuple[int, NDArray[Any]]], kind: SensorType
) -> tuple[float, float] | None:
    """Return how counts become values, value = offset + scale * count; None if they are counts.

    `numbered` gives arrays of images and the number of the first in each. Raises RecordingError: a
    value is no number, or all are too small.
    """
    least, most, whole = 0.0, 0.0, True
    for first, images in numbered:
        bad = ~np.isfinite(images)
        if bad.any():
            raise RecordingError(
                f"{name} holds values that are no numbers, "
                f"the first in image {first + int(np.argwhere(bad)[0, 0])}",
                fix="replace them, or leave those images out",
                place=path,
            )
        least, most = min(least, float(images.min())), max(most, float(images.max()))
        whole = whole and (images.dtype.kind != "f" or bool((images == np.floor(images)).all()))
    if whole and least >= 0 and most <= _FULL:
        return None
    if kind.value != "counts" and most <= _FULL * kind.unit:
        return 0.0, kind.unit
    scale = most / _FULL - least / _FULL
    if scale < np.finfo(np.float64).tiny:
        raise RecordingError(
            f"{name} holds nothing above {most:g}",
            fix="multiply the values by a power of ten",
            place=path,
        )
    return least, scale


def scale_attributes(
    scale: tuple[float, float] | None, kind: SensorType
) -> tuple[str, dict[str, float]]:
    """Return the units of a recording that was scaled so, and what it says of the scale."""
    if scale is None:
        return "counts", {}
    units = "counts" if scale[1] == kind.unit else "scaled"
    return units, {"scale": scale[1], "scale_offset": scale[0]}


def to_counts(images: NDArray[Any], scale: tuple[float, float] | None) -> NDArray[np.uint16]:
    """Return values as the counts that `scale_of` makes of them."""
    if scale:
        images = np.rint(images / scale[1] - scale[0] / scale[1]).clip(0, _FULL)
    return images.astype(np.uint16)


def _block(
    found: FileArray,
    images: NDArray[Any],
    first: int,
    scale: tuple[float, float] | None,
    period_ns: float,
) -> FrameBlock:
    number = np.arange(first, first + len(images))
    others = {name: values[number] for name, values in found.others.items()}
    return FrameBlock(
        to_counts(images, scale),
        others.get("t_ns", np.rint(number * period_ns).astype(np.int64)),
        others.get("seq", number),
        others.get("wrist", np.zeros((len(images), WRIST), np.uint16)),
        others.get("pose"),
    )


def _numpy_arrays(path: Path, *, archive: bool) -> list[FileArray]:
    try:
        if not archive:
            return [FileArray(path.stem, np.load(path, mmap_mode="r", allow_pickle=False))]
        with open_regular(path) as file, zipfile.ZipFile(file) as members:
            names = members.namelist()
            _check_claim(path, sum(members.getinfo(name).file_size for name in names))
            arrays = {name: foreign_member(members, name, _MOST_BYTES) for name in names}
        return [FileArray(name.removesuffix(".npy"), _npy(data)) for name, data in arrays.items()]
    except (*DAMAGE, zipfile.BadZipFile, tokenize.TokenError) as error:
        raise RecordingError(
            "it holds objects, or it is damaged",
            fix="save a plain array of numbers (N, rows, columns)",
            place=path,
        ) from error


def _npy(content: bytes) -> NDArray[Any]:
    """Return the array in an .npy file; ValueError where it claims more values than there are."""
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    read_header = (
        np.lib.format.read_array_header_1_0
        if version == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    shape, _, dtype = read_header(stream)
    if math.prod(shape) * dtype.itemsize > len(content):
        raise ValueError(f"{shape} values in {len(content)} bytes")
    stream.seek(0)
    read: NDArray[Any] = np.load(stream, allow_pickle=False)
    return read


def _check_claim(path: Path, claimed: int) -> None:
    """Refuse arrays that take too many bytes, before a value is read."""
    if claimed > _MOST_BYTES:
        raise RecordingError(
            f"it claims arrays of {claimed:,} bytes, {_MOST_BYTES:,} are read",
            fix="save a part of it, or as .npy or HDF5, which are read piece by piece",
            place=path,
        )


def _matlab_arrays(path: Path) -> list[FileArray]:
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import MatReadError

    try:
        with explain_errors(path, "read"), open_regular(path) as file:
            shapes = [shape for _, shape, _ in whosmat(file, appendmat=False)]
            _check_claim(path, sum(8 * math.prod(shape) for shape in shapes))
            file.seek(0)
            variables = loadmat(file, appendmat=False)
    except MatReadError as error:
        raise RecordingError(
            "it is no MATLAB file, or it is damaged", fix="save it again", place=path
        ) from error
    return [
        FileArray(name, array)
        for name, array in variables.items()
        if isinstance(array, np.ndarray) and not name.startswith("__")
    ]


def _hdf5_arrays(path: Path, file: h5py.File) -> list[FileArray]:
    import h5py

    found: list[FileArray] = []

    def note(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.shape is not None:
            found.append(FileArray(name, item, "MATLAB_class" in item.attrs))

    with explain_errors(path, "read"):
        file.visititems(note)
    return found


def _folder_array(folder: Path, image: tuple[int, int]) -> FileArray:
    with explain_errors(folder, "read"):
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise RecordingError(
            "no picture in the folder", fix=f"put {', '.join(SUFFIXES)} there", place=folder
        )
    return FileArray(folder.name, np.stack([_picture(path, image) for path in paths]))


def _table_array(path: Path, image: tuple[int, int]) -> FileArray:
    with explain_errors(path, "read"):
        try:
            content = foreign_bytes(
                path, RecordingError, most=_MOST_TABLE, fix="give a table (CSV), or an array (.npy)"
            )
            text = io.StringIO(content.decode("utf-8-sig"), newline="")
            lines = [line for line in csv.reader(text) if any(cell.strip() for cell in line)]
        except (UnicodeError, csv.Error) as bad:
            raise RecordingError(
                f"it is no table: {bad}", fix="save it as CSV, UTF-8", place=path
            ) from bad
    # pandas names columns 0, 1, 2, ... where they have no names
    named = lines and (not _are_numbers(lines[0]) or lines[0] == [*map(str, range(len(lines[0])))])
    head = [name.strip() for name in lines.pop(0)] if named else []
    others: dict[str, NDArray[Any]] = {}
    left: tuple[str, ...] = ()
    if columns := _image_columns(path, head, image):
        ours = [*table_header(image), *POSE_HEADER]
        even = all(len(line) == len(head) for line in lines)
        others = _other_columns(path, head, lines) if even else {}
        left = tuple(name for i, name in enumerate(head) if i not in columns and name not in ours)
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
            place=path,
        )
    return FileArray(path.stem, values, others=others, left=left)


def _image_columns(path: Path, head: list[str], image: tuple[int, int]) -> list[int]:
    """Return the columns of the tactels by their names, row 0 first; none where they have none."""
    named = {i: found for i, name in enumerate(head) if (found := _PLACE.fullmatch(name))}
    places = {(int(found[1]), int(found[2])): i for i, found in named.items()}
    for first in (0, 1):
        wanted = [(r + first, c + first) for r in range(image[0]) for c in range(image[1])]
        if len(named) == len(places) and sorted(places) == wanted:
            return [places[place] for place in wanted]
    if not named:
        return []
    last = f"r{image[0] - 1}c{image[1] - 1}"
    raise RecordingError(
        f"its head names {len(places)} tactels in {len(named)} columns, not r0c0 ... {last}, nor "
        f"r1c1 ... r{image[0]}c{image[1]}, each once",
        fix="name every tactel once, or give the --sensor-type",
        place=f"{path}:1",
    )


def _other_columns(path: Path, head: list[str], lines: list[list[str]]) -> dict[str, NDArray[Any]]:
    """Return what columns of our own names say of each image; see `export_csv`."""
    ours = {"t_ns": ["t_ns"], "seq": ["seq"], "pose": POSE_HEADER,
            "wrist": [f"wrist{i}" for i in range(WRIST)]}  # fmt: skip
    found: dict[str, NDArray[Any]] = {}
    for dataset, names in ours.items():
        if not set(names) <= set(head):
            continue
        shape, dtype = DATASETS[dataset]
        columns = [head.index(name) for name in names]
        for number, line in enumerate(lines, 2):
            cells = [line[c] for c in columns]
            values = _exact_values(cells, dtype)
            if values is None or (dtype.kind == "f" and not are_rigid(values.reshape(1, *shape))):
                raise RecordingError(
                    f"{', '.join(cells)[:60]} in {names[0]}{' ...' if names[1:] else ''}: "
                    f"{_OTHER[dataset]}",
                    fix="write it so, or name the column otherwise",
                    place=f"{path}:{number}",
                )
            found.setdefault(dataset, np.empty((len(lines), *shape), dtype.newbyteorder("=")))
            found[dataset][number - 2] = values.reshape(shape)
    return found


def _exact_values(cells: list[str], dtype: np.dtype[Any]) -> NDArray[Any] | None:
    """Return the numbers in cells, empty ones as NaN; None where one is none of that type."""
    try:
        if dtype.kind == "f":
            return np.array([cell.strip() or "nan" for cell in cells], np.float64)
        if all(map(_WHOLE.fullmatch, cells)):
            return np.array([int(cell) for cell in cells], dtype.newbyteorder("="))
    except (ValueError, OverflowError):
        pass
    return None


def _picture(path: Path, image: tuple[int, int]) -> NDArray[np.float64]:
    from PIL import Image, UnidentifiedImageError

    with explain_errors(path, "read"):
        try:
            with open_regular(path) as file, Image.open(file) as opened:
                shape = opened.size[::-1]
                values = np.asarray(opened) if shape == image else None  # a bomb stays packed
        except (UnidentifiedImageError, Image.DecompressionBombError, SyntaxError) as bad:
            raise RecordingError(
                "it is no picture, or it is damaged", fix="save it again", place=path
            ) from bad
    if values is None or values.shape != image or values.dtype.kind not in "uif":
        shape = shape if values is None else values.shape
        raise RecordingError(
            f"a picture of {' x '.join(map(str, shape))}, not of "
            f"{image[0]} x {image[1]} grey values",
            fix="save it in grey, a pixel a tactel; or give the --sensor-type",
            place=path,
        )
    return values.astype(np.float64)


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
        raise RecordingError("it holds no numbers", fix="write an image a line", place=path)
    return np.array(lines, np.float64)


def _are_numbers(cells: list[str]) -> bool:
    try:
        np.array(cells, np.float64)
    except ValueError:
        return False
    return True
