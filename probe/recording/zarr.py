"""Zarr stores of others, format 2, as FTP-1 has them (`recognizer.validation.ftp1`) -> arrays.

A store is a folder with `.zgroup`. Its arrays of three axes or more are images (T, rows, columns);
`<side>_tactile_data_<group>` (T, N, rows, columns) are N of them, named with `/0`, `/1`, ...

No library of Zarr: what a store claims is checked before a chunk is read, chunks are regular files
of the store, and none unpacks to more than its shape says. Read are chunks that are not packed, or
by zlib, gzip, zstd (extra `robot`) or blosc, the default of Zarr (extra `benchmark`); no filters.

Zarr storage specification 2; Blosc 1 chunk format: its head says the unpacked size.
"""

from __future__ import annotations

import itertools
import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from encoded_objects.base.foreign import DAMAGE, foreign_bytes, foreign_json
from probe.errors import RecordingError
from probe.recording.guard import FREE, MOST_CHUNK, PACKED

_FIX: Final = "save it again, as Zarr format 2"
_MOST_ARRAYS: Final = 1000  #: of a store
_MOST_CHUNKS: Final = 1 << 20  #: of an array
_MOST_SAID: Final = 1 << 20  #: bytes of `.zarray`


def is_store(path: Path) -> bool:
    """Tell whether a folder is a Zarr store."""
    return any((path / name).exists() for name in (".zgroup", ".zarray", "zarr.json"))


@dataclass(frozen=True, slots=True, eq=False)
class ZarrArray:
    """An array of a store; slices are read chunk by chunk."""

    folder: Path
    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    dtype: np.dtype[Any]
    order: str
    compressor: str  #: empty: none
    separator: str
    fill: float
    channel: int | None = None  #: of the second axis, which is left out; None: it has none

    def __getitem__(self, slices: tuple[slice, ...]) -> NDArray[Any]:
        """Return what slices of step 1 hold."""
        time, *rest = slices
        start, stop, _ = time.indices(self.shape[0])
        spans = [(start, max(start, stop)), *((0, n) for n in self.shape[1:])]
        if self.channel is not None:
            spans.insert(1, (self.channel, self.channel + 1))
        made = np.full([high - low for low, high in spans], self.fill, self.dtype)
        sides = zip(spans, self.chunks, strict=True)
        for at in itertools.product(*(range(a // c, math.ceil(b / c)) for (a, b), c in sides)):
            chunk = self._chunk(at)
            if chunk is None:
                continue
            here, there = [], []  # of the chunk, of what is made
            for k, c, (low, high) in zip(at, self.chunks, spans, strict=True):
                first, last = max(low, k * c), min(high, (k + 1) * c)
                here.append(slice(first - k * c, last - k * c))
                there.append(slice(first - low, last - low))
            made[tuple(there)] = chunk[tuple(here)]
        whole = made if self.channel is None else made[:, 0]
        return np.asarray(whole[(slice(None), *rest)])

    def _chunk(self, at: tuple[int, ...]) -> NDArray[Any] | None:
        """Return a chunk; None where it was not written."""
        path = self.folder / self.separator.join(map(str, at))
        if not path.exists():
            return None
        size = math.prod(self.chunks) * self.dtype.itemsize
        packed = foreign_bytes(path, RecordingError, most=size + size // 8 + 4096, fix=_FIX)
        try:
            content = _unpack(packed, self.compressor, size)
            if len(content) != size:
                raise ValueError(f"{len(content)} bytes, not {size}")
            read = np.frombuffer(content, self.dtype)
        except DAMAGE as error:
            cause = f"a chunk is damaged: {str(error)[:120]}"
            raise RecordingError(cause, fix=_FIX, place=path) from error
        return read.reshape(self.chunks, order="F" if self.order == "F" else "C")


def store_arrays(path: Path) -> Iterator[tuple[str, ZarrArray]]:
    """Yield the arrays of numbers of a store that may be images, with their names.

    Raises RecordingError: it is of another format, damaged, or claims more than is read.
    """
    if (path / "zarr.json").exists():
        fix = "write it as Zarr format 2, which FTP-1 has"
        raise RecordingError("it is a Zarr store of format 3", fix=fix, place=path)
    said = sorted(itertools.islice(path.rglob(".zarray"), _MOST_ARRAYS + 1))
    if len(said) > _MOST_ARRAYS:
        cause = f"more than {_MOST_ARRAYS} arrays in it"
        raise RecordingError(cause, fix="name the folder of one array", place=path)
    for file in said:
        values = foreign_json(file, RecordingError, fix=_FIX, most=_MOST_SAID)
        name = file.parent.relative_to(path).as_posix().removeprefix("data/")
        try:
            array = _described(file.parent, values)
        except DAMAGE as error:
            cause = f"it is no array that is read: {str(error)[:120]}"
            raise RecordingError(cause, fix=_FIX, place=file) from error
        if array is None:
            continue
        if len(array.shape) == 4:
            for k in range(min(array.shape[1], _MOST_ARRAYS)):
                shape = (array.shape[0], *array.shape[2:])
                yield f"{name}/{k}", replace(array, shape=shape, channel=k)
        else:
            yield name, array


def _described(folder: Path, values: Any) -> ZarrArray | None:
    """Return the array of a `.zarray`, None where it holds no images; raises as `DAMAGE` has it."""
    dtype = np.dtype(str(values["dtype"]))
    shape, chunks = (tuple(map(int, values[name])) for name in ("shape", "chunks"))
    if dtype.kind not in "biuf" or len(shape) not in (2, 3, 4):
        return None
    if len(chunks) != len(shape) or min(shape) < 0 or min(chunks) < 1:
        raise ValueError(f"shape {shape} in chunks {chunks}")
    number = math.prod(-(-n // c) for n, c in zip(shape, chunks, strict=True))
    if math.prod(chunks) * dtype.itemsize > MOST_CHUNK or number > _MOST_CHUNKS:
        raise ValueError(f"{number:,} chunks of {chunks}, more than is read")
    sizes = (file.stat().st_size for file in itertools.islice(folder.rglob("*"), _MOST_CHUNKS))
    claimed = math.prod(shape) * dtype.itemsize
    if claimed > FREE + PACKED * sum(sizes):
        raise ValueError(f"it claims {claimed:,} bytes, more than its files can hold")
    if values.get("filters"):
        raise ValueError("it has filters")
    compressor = values.get("compressor")
    kind = "" if compressor is None else str(compressor["id"])
    separator = str(values.get("dimension_separator", "."))
    if separator not in (".", "/"):
        raise ValueError(f"'{separator}' between the numbers of a chunk")
    fill = values.get("fill_value")
    fill = float(fill) if isinstance(fill, int | float) else 0.0
    return ZarrArray(folder, shape, chunks, dtype, str(values["order"]), kind, separator, fill)


def _unpack(packed: bytes, kind: str, size: int) -> bytes:
    """Return the bytes of a chunk, no more than one more than `size`."""
    if not kind:
        return packed
    if kind in ("zlib", "gzip"):
        return zlib.decompressobj(47).decompress(packed, size + 1)  # the head says which
    if kind == "zstd":
        require("zstandard", extra="robot", purpose="a store packed by zstd")
        import zstandard

        if zstandard.frame_content_size(packed) not in (-1, size):
            raise ValueError("it unpacks to another size")
        try:
            return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
        except zstandard.ZstdError as error:
            raise ValueError(str(error)) from error
    if kind == "blosc":
        require("numcodecs.blosc", extra="benchmark", purpose="a store packed by blosc")
        from numcodecs import blosc

        if struct.unpack_from("<I", packed, 4)[0] != size:
            raise ValueError("it unpacks to another size")
        return bytes(blosc.decompress(packed))
    raise ValueError(f"it is packed by {kind}")
