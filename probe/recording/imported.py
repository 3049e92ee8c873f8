"""Others' images -> a recording of counts.

Whole numbers 0 ... 65535 are taken as they are. Other values of a sensor type that says what
one count is (depth in mm, force in N) are counted in that unit, below 0 as 0. Anything else
(voltages, values with the bias removed) is scaled: value = scale_offset + scale * count, with
the largest value at 65535, and zero at zero unless there are negative values. Both numbers stand
in the attributes, and `units` says "scaled".
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType, choose_sensor_type, sensor_type_text
from probe.errors import RecordingError
from probe.frame import WRIST
from probe.recording.arrays import FileArray, arrays_of
from probe.recording.layout import NOMINAL_HZ, FrameBlock, RecordingOrigin
from probe.recording.names import check_name, final_name, part_of, unless_it_fails
from probe.recording.pictures import folder_array, table_array
from probe.recording.read import Recording
from probe.recording.write import FileWriter

_AT_ONCE: Final = 1024  #: images read at a time
_FULL: Final = 65535


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
    calibration: str = "",
    replace: bool = False,
) -> Recording:
    """Make a recording from an array of images.

    Parameters
    ----------
    path
        A .npy, .npz, .mat or HDF5 file with an array (N, rows, columns), (rows, columns, N) or
        (rows, columns), the first axis taken for time where both would do; a table (.csv) or a
        folder of pictures, see `pictures`.
    out
        The recording to be made.
    dataset
        Which array, when there are several.
    rate_hz
        Frames per second; the array does not tell.
    sensor, calibration
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
        told = sensor_type_text(kind)
        origin = RecordingOrigin(sensor, calibration, units, told, MappingProxyType(more))
        with unless_it_fails(part_of(out)) as part, FileWriter(part, origin) as writer:
            for first, images in _images(found, kind.shape):
                writer.write(_block(images, first, scale, 1e9 / rate_hz))
    final_name(part, out, [], last=True, replace=replace)
    return Recording(out)


@contextmanager
def _arrays_at(path: Path, image: tuple[int, int]) -> Iterator[list[FileArray]]:
    """Open whatever holds images: a folder of pictures, a table, a file of arrays."""
    if path.is_dir():
        yield [folder_array(path, image)]
    elif path.suffix.lower() == ".csv":
        yield [table_array(path, image)]
    else:
        with arrays_of(path) as arrays:
            yield arrays


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
