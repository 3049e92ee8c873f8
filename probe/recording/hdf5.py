"""Recordings as HDF5 files: the datasets that are needed to read one, and how one is written.

Files come from anywhere: everything that is used is checked, values when they are read.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from probe.errors import RecordingError
from probe.frame import are_rigid
from probe.recording.files import draft_of, explain_errors, final_name
from probe.recording.guard import MOST_TACTELS, open_hdf5
from probe.recording.layout import (
    CHUNK,
    DATASETS,
    FORMAT,
    FORMAT_VERSION,
    NOMINAL_HZ,
    FrameBlock,
    FrameFile,
    RecordingOrigin,
)

if TYPE_CHECKING:
    import h5py

_FILE_FORMAT: Final = ("v110", "v110")
_OURS: Final = ("format", "format_version", "tool_version", "piece")
_TYPES: Final = {
    "format_version": int, "tool_version": str, "piece": int, "sensor": str, "calibration": str,
    "units": str, "sensor_type": str,
}  # fmt: skip
_MOST_STEP_NS: Final = 3.6e12  #: an hour from frame to frame: more is no rate
_IMPORT: Final = "import the array that holds the images (N, rows, columns)"
#: by kind of numbers: the values of a dataset, and what to do with others
_MEANT: Final = {
    "u": ("counts 0 ... 65535", "import the array: it is scaled to counts"),
    "i": ("whole numbers", f"delete /t_ns or /seq: frames then come at {NOMINAL_HZ:g} Hz"),
    "f": ("rigid transforms", "delete /pose, or write NaN where it is not known"),
}


@contextmanager
def open_hdf5_frames(
    path: Path, *, live: bool = False, damaged: bool = False
) -> Iterator[FrameFile]:
    """Open an HDF5 file of frames; see `open_hdf5`.

    Raises RecordingError also where it is no recording, or of a newer format.
    """
    with open_hdf5(path, live=live, damaged=damaged) as (file, head):
        yield _checked(file, path, closed=head.whole)


def write_hdf5(
    draft: Path, origin: RecordingOrigin, blocks: Iterable[FrameBlock], place: Path, piece: int = 1
) -> int:
    """Write a recording as a file that will be called `place`; returns the number of its frames.

    When something fails, the draft is removed. The HDF5 library crashes when it cannot write, so
    it writes to a `_Draft`, which raises afterwards: RecordingError, the folder cannot be written
    or the disk is full.
    """
    import h5py

    written = 0
    with explain_errors(place, "make"):
        stream = _Draft(draft)
    try:
        with explain_errors(place, "write"), stream:
            with h5py.File(stream, "w", libver=_FILE_FORMAT, rdcc_nbytes=0) as file:
                file.attrs.update(_attributes(origin, piece))
                for block in blocks:
                    _append_block(file, block, written)
                    written += len(block)
                    stream.check()
                if not written:
                    _append_block(file, FrameBlock.empty(), 0)
            stream.check()
            os.fsync(stream.fileno())
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
    return written


def write_recording(
    out: Path, origin: RecordingOrigin, blocks: Iterable[FrameBlock], *, replace: bool
) -> None:
    """Write a recording of one file under its name, whole or not at all; see `write_hdf5`."""
    draft = draft_of(out)
    write_hdf5(draft, origin, blocks, out)
    final_name(draft, out, replace=replace)


class _Draft(io.FileIO):
    """A file that takes whatever is written; `check` raises the first error that occurred."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self.failure: OSError | None = None

    def check(self) -> None:
        if self.failure is not None:
            raise self.failure

    def write(self, data: Any) -> int:
        rest = memoryview(data)
        try:
            while rest and self.failure is None:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.failure = error
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.failure = self.failure or error
            return size or 0


def _append_block(file: h5py.File, block: FrameBlock, first: int) -> None:
    """Append frames, the arrays of each chunk near each other.

    The datasets are made first, so a truncated copy holds all of the frames that reached it.
    """
    datasets = block.datasets()
    for name in datasets:
        if name not in file:
            shape = block.counts.shape[1:] if name == "frames" else DATASETS[name][0]
            file.create_dataset(
                name,
                shape=(0, *shape),
                maxshape=(None, *shape),
                chunks=(CHUNK, *shape),
                dtype=DATASETS[name][1],
                shuffle=True,
                compression="gzip",
                compression_opts=1,
                fillvalue=np.nan if name == "pose" else None,
            )
    written = {name: file[name] for name in DATASETS if name in file}
    for dataset in written.values():
        dataset.resize(first + len(block), axis=0)
    for start in range(0, len(block), CHUNK):
        stop = min(start + CHUNK, len(block))
        for name, values in datasets.items():
            written[name][first + start : first + stop] = values[start:stop]


def _attributes(origin: RecordingOrigin, piece: int) -> dict[str, Any]:
    return {
        **origin.more,
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "tool_version": version("encoded-objects"),
        "sensor": origin.sensor,
        "calibration": origin.calibration,
        "units": origin.units,
        "piece": piece,
        **({"sensor_type": origin.sensor_type} if origin.sensor_type else {}),
    }


def _checked(file: h5py.File, path: Path, *, closed: bool) -> FrameFile:
    """Check that an open file is a recording, without reading its frames."""
    with explain_errors(path, "read"):
        attributes = {name: _attribute_value(value) for name, value in file.attrs.items()}
        names = [name for name in DATASETS if name in file]
        others = ", ".join(sorted(file)) or "nothing"
    named = attributes.get("format")
    own = isinstance(named, str) and named == FORMAT
    if own:
        _check_attributes(attributes, path)
    if own and attributes.get("format_version") != FORMAT_VERSION:
        raise RecordingError(
            f"its format is {attributes.get('format_version')}, this programme knows "
            f"{FORMAT_VERSION}",
            fix="install a newer version of encoded-objects",
            place=path,
        )
    if "frames" not in names:
        raise RecordingError(f"it has no dataset /frames, but {others}", fix=_IMPORT, place=path)
    shapes = {name: _shape_of(file, path, name) for name in names}
    rows, columns = shapes["frames"][1:]
    if rows * columns > MOST_TACTELS:
        raise RecordingError(
            f"its images are of {rows} x {columns}, at most {MOST_TACTELS:,} values are read",
            fix="import a part of each image",
            place=path,
        )
    ours = {name: attributes.pop(name, None) for name in _OURS} if own else {}
    said = {name: attributes.pop(name) for name in RecordingOrigin().texts() if name in attributes}
    origin = RecordingOrigin.of_texts(said, attributes)
    return FrameFile(
        origin,
        own,
        closed,
        tool_version=str(ours.get("tool_version", "")),
        piece=int(ours.get("piece") or 1),
        lengths={name: shape[0] for name, shape in shapes.items()},
        shape=(rows, columns),
        poses="pose" in names,
        read=lambda start, stop: _read_block(file, path, start, stop),
    )


def _check_attributes(attributes: dict[str, Any], path: Path) -> None:
    """Refuse attributes of a recording of ours that are of another type than we write."""
    for name, kind in _TYPES.items():
        value = attributes.get(name, kind())
        if not isinstance(value, kind):
            raise RecordingError(
                f"its attribute {name} is no {'number' if kind is int else 'text'}: "
                f"{str(value)[:40]!r}",
                fix=f"delete the attribute {name}, or write it as it was",
                place=path,
            )


def _read_block(file: h5py.File, path: Path, start: int, stop: int) -> FrameBlock:
    values = {
        name: _read_values(file, name, path, start, stop)
        for name in DATASETS
        if name in file or name != "pose"
    }
    return FrameBlock(
        values["frames"], values["t_ns"], values["seq"], values["wrist"], values.get("pose")
    ).frozen()


def _read_values(file: h5py.File, name: str, path: Path, start: int, stop: int) -> NDArray[Any]:
    """Return and check entries `start` ... `stop` - 1; those that a dataset lacks are made."""
    dtype = DATASETS[name][1]
    length = len(file[name]) if name in file else 0
    found: list[NDArray[Any]] = []
    if start < length:
        with explain_errors(path, "read"):
            values = file[name][start:stop]
        if not _fits_exactly(values, dtype):
            kind, fix = _MEANT[dtype.kind]
            raise RecordingError(
                f"/{name} holds other things than {kind} in frames {start} ... {stop - 1}",
                fix=fix,
                place=path,
            )
        found.append(values.astype(dtype.newbyteorder("=")))
    if length < stop:
        found.append(_make_values(file, name, path, np.arange(max(start, length), stop)))
    return found[0] if len(found) == 1 else np.concatenate(found)


def _make_values(file: h5py.File, name: str, path: Path, number: NDArray[np.int64]) -> NDArray[Any]:
    """Return entries for frames of these numbers, which a dataset lacks; see `FrameFile.read`."""
    shape, dtype = DATASETS[name]
    if shape:
        fill = np.nan if dtype.kind == "f" else 0
        return np.full((len(number), *shape), fill, dtype.newbyteorder("="))
    first, last, end = 0, 0, 0
    step = 1e9 / NOMINAL_HZ if name == "t_ns" else 1.0
    if name in file and len(file[name]):
        end = len(file[name]) - 1
        first, last = (int(_read_values(file, name, path, i, i + 1)[0]) for i in (0, end))
    if name == "t_ns" and 0 < last - first < _MOST_STEP_NS * end:
        step = (last - first) / end
    made: NDArray[Any] = last + np.rint((number - end) * step).astype(np.int64)
    return made


def _shape_of(file: h5py.File, path: Path, name: str) -> tuple[int, ...]:
    """Return the shape of a dataset; refuse entries of another one."""
    import h5py

    shape = DATASETS[name][0]
    with explain_errors(path, "read"):
        found = file[name]
        is_array = isinstance(found, h5py.Dataset) and found.shape is not None
        has = f"{found.dtype} {found.shape}" if is_array else "no array"
        right = is_array and found.dtype.kind in "iuf" and found.ndim == 1 + len(shape)
        if right and all(
            n == wanted or (wanted < 0 < n)
            for n, wanted in zip(found.shape[1:], shape, strict=True)
        ):
            return tuple(map(int, found.shape))
    lengths = iter(("rows", "columns"))
    wanted = ", ".join(["N", *(str(n) if n >= 0 else next(lengths) for n in shape)])
    raise RecordingError(
        f"/{name} must hold numbers ({wanted}), it is {has}", fix=_IMPORT, place=path
    )


def _fits_exactly(values: NDArray[Any], dtype: np.dtype[Any]) -> bool:
    """Tell whether the type that a frame has holds all values exactly."""
    if dtype.kind == "f":
        return are_rigid(values)
    if np.can_cast(values.dtype, dtype):
        return True
    limits = np.iinfo(dtype)
    if values.dtype.kind == "f":
        values = values.astype(np.float64)  # which holds the end of every range, 16 bits do not
        whole = (values == np.floor(values)) & (values < float(limits.max) + 1)
        return bool((whole & (values >= limits.min)).all())
    return bool((values >= limits.min).all() and (values <= limits.max).all())


def _attribute_value(value: Any) -> Any:
    """Return an attribute as a text, a number, or an array."""
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(())[()]
    return value.item() if isinstance(value, np.generic) else value
