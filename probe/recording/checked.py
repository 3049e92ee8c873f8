"""What an HDF5 file must hold to be read as a recording, and its values as counts.

Files come from anywhere: everything that is used is checked, values when they are read.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from probe.errors import RecordingError
from probe.recording.guard import MOST_TACTELS
from probe.recording.layout import (
    DATASETS,
    FORMAT,
    FORMAT_VERSION,
    NOMINAL_HZ,
    FrameBlock,
    RecordingOrigin,
)
from probe.recording.opened import explain_errors, open_recording

if TYPE_CHECKING:
    import h5py

_IMPORT = "import the array that holds the images (N, rows, columns)"


@dataclass(frozen=True, slots=True)
class CheckedFile:
    """What a file says about itself."""

    origin: RecordingOrigin
    own: bool  #: written by this programme
    tool_version: str
    piece: int  #: number in its series
    frames: int  #: that are there with everything that belongs to them
    shape: tuple[int, int]  #: rows and columns of its images
    even: bool  #: all datasets have that length
    poses: bool  #: there is a dataset of poses


def check_recording(path: Path, *, live: bool = False) -> CheckedFile:
    """Check that a file is a recording, without reading its frames.

    Raises
    ------
    RecordingError
        It is none, is of a newer format, damaged, or not closed (and not `live`).
    """
    with open_recording(path, live=live) as file:
        seen = check_open_file(file, path)
    if seen.own and not seen.even and not live:
        raise RecordingError(
            "its datasets have different lengths", fix="run `repair` on it", place=str(path)
        )
    return seen


def check_open_file(file: h5py.File, path: Path) -> CheckedFile:
    """Check that an open file is a recording; see `check_recording`."""
    with explain_errors(path, "read"):
        attributes = {name: _attribute_value(value) for name, value in file.attrs.items()}
        names = [name for name in DATASETS if name in file]
        others = ", ".join(sorted(file)) or "nothing"
    own = attributes.get("format") == FORMAT
    if own and attributes.get("format_version") != FORMAT_VERSION:
        raise RecordingError(
            f"its format is {attributes.get('format_version')}, this programme knows "
            f"{FORMAT_VERSION}",
            fix="install a newer version of encoded-objects",
            place=str(path),
        )
    if "frames" not in names:
        raise RecordingError(
            f"it has no dataset /frames, but {others}", fix=_IMPORT, place=str(path)
        )
    shapes = {name: _shape_of(file, path, name) for name in names}
    rows, columns = shapes["frames"][1:]
    if rows * columns > MOST_TACTELS:
        raise RecordingError(
            f"its images are of {rows} x {columns}, at most {MOST_TACTELS:,} values are read",
            fix="import a part of each image",
            place=str(path),
        )
    lengths = [shape[0] for shape in shapes.values()]
    ours = {name: attributes.pop(name, None) for name in _OURS} if own else {}
    origin = RecordingOrigin(
        str(attributes.pop("sensor", "")),
        str(attributes.pop("calibration", "")),
        str(attributes.pop("units", "counts")),
        str(attributes.pop("sensor_type", "")),
        MappingProxyType(attributes),
    )
    return CheckedFile(
        origin,
        own,
        tool_version=str(ours.get("tool_version", "")),
        piece=int(ours.get("piece") or 1),
        frames=min(lengths),
        shape=(rows, columns),
        even=len(set(lengths)) == 1,
        poses="pose" in names,
    )


def read_block(file: h5py.File, path: Path, start: int, stop: int) -> FrameBlock:
    """Read and check frames `start` ... `stop` - 1 of an open file that `check_recording` accepted.

    Raises
    ------
    RecordingError
        The place is damaged, or a value is no count, time, number or pose.
    """
    values: dict[str, Any] = {}
    with explain_errors(path, "read"):
        for name in DATASETS:
            if name in file:
                values[name] = file[name][start:stop]
    number = np.arange(start, stop)
    values.setdefault("t_ns", np.rint(number * (1e9 / NOMINAL_HZ)))
    values.setdefault("seq", number)
    values.setdefault("wrist", np.zeros((len(number), 4)))
    for name, array in values.items():
        dtype = DATASETS[name][1]
        if not _fits_exactly(array, dtype):
            kind, fix = _MEANT[dtype.kind]
            raise RecordingError(
                f"/{name} holds other things than {kind} in frames {start} ... {stop - 1}",
                fix=fix,
                place=str(path),
            )
        values[name] = array.astype(dtype.newbyteorder("="))
    return FrameBlock(
        values["frames"], values["t_ns"], values["seq"], values["wrist"], values.get("pose")
    ).frozen()


#: what a dataset holds, by the kind of its numbers, and what to do with other things
_MEANT = {
    "u": ("counts 0 ... 65535", "import the array: it is scaled to counts"),
    "i": ("whole numbers", f"delete /t_ns or /seq: frames then come at {NOMINAL_HZ:g} Hz"),
    "f": ("rigid transforms", "delete /pose, or write NaN where it is not known"),
}
_OURS = ("format", "format_version", "tool_version", "piece")


def _shape_of(file: h5py.File, path: Path, name: str) -> tuple[int, ...]:
    """Return the shape of a dataset, whose entries have the right one."""
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
        f"/{name} must hold numbers ({wanted}), it is {has}", fix=_IMPORT, place=str(path)
    )


def _fits_exactly(values: NDArray[Any], dtype: np.dtype[Any]) -> bool:
    """Tell whether all values can be told exactly in the type that a frame has."""
    if dtype.kind == "f":
        return _rigid(values)
    if np.can_cast(values.dtype, dtype):
        return True
    limits = np.iinfo(dtype)
    if values.dtype.kind == "f" and not (values == np.floor(values)).all():
        return False
    return bool((values >= limits.min).all() and (values <= limits.max).all())


def _rigid(poses: NDArray[Any]) -> bool:
    known = poses[~np.isnan(poses).all(axis=(1, 2))].astype(np.float64)
    if not np.isfinite(known).all():
        return False
    turn = known[:, :3, :3]
    return bool(
        np.allclose(turn @ turn.transpose(0, 2, 1), np.eye(3), atol=1e-6)
        and (known[:, 3] == (0, 0, 0, 1)).all()
    )


def _attribute_value(value: Any) -> Any:
    """Return an attribute as a text, a number, or an array."""
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(())[()]
    return value.item() if isinstance(value, np.generic) else value
