"""Open HDF5 files of unknown origin: what is checked by hand before a value is read.

- Superblock: HDF5 says "unable to open file" for many reasons; the first bytes tell them apart.
- Strings: attributes stand in global heaps, collections of objects, each with its length.
  libhdf5 walks along the lengths, and never stops where a damaged file says zero.
- Links and headers: HDF5 lets a dataset stand in any other file, and lets 1,400 bytes claim
  10^9 images. A recording holds all its values itself, and no more than its size allows.
- A file without its end: `h5py.File(path, "r")` refuses a file whose writer was killed, and one
  that is shorter than it says. Through a Python file HDF5 looks at no flags; only the length must
  be right (`PaddedFile`).

HDF5 File Format Specification 3.0, II.A: superblock; III.E: global heap; IV.A.2: link, data layout
and external data files messages. RFC 1951: deflate packs at most 1,032 bytes into one.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final

from encoded_objects.base.foreign import open_regular, regular_size
from probe.errors import RecordingError
from probe.recording.files import SAVE, blank_error, explain_errors, is_part, not_closed_error

if TYPE_CHECKING:
    import h5py

MOST_TACTELS: Final = 1 << 20  #: of an image, 1024 x 1024; 256 of them are read at a time
FREE: Final = 8 << 20  #: bytes of values that any file may hold: 16,384 images of 16 x 16
PACKED: Final = 1100  #: bytes of values in a byte of the file; our recordings reach 185
_PIECE: Final = 512  #: bytes of values that a chunk costs at least, to find and to unpack
MOST_CHUNK: Final = 64 << 20  #: bytes of a chunk, which is unpacked as a whole
_LARGE_CHUNK: Final = 256 << 10  #: bytes; it is kept from one block to the next
_MOST_LINKS: Final = 10_000  #: of all groups; checking as many datasets takes 1 to 2 s
_MOST_DEPTH: Final = 64  #: groups in one another; libhdf5 visits them by recursion

_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
_WRITING, _SWMR = 0x01, 0x04
_END_AT: Final = {0: 40, 1: 44, 2: 28, 3: 28}  #: offset of the address of the end, by version

_HEAP: Final = b"GCOL\x01"  #: signature and version
_HEAD: Final = 16  #: bytes before the objects, and before the data of each
_ALIGNED: Final = 8  #: bytes, to which an object's length is rounded up
_SEARCHED: Final = 1 << 26  #: bytes from the beginning; attributes are written before frames
_AT_ONCE: Final = 1 << 20  #: bytes


@contextmanager
def open_hdf5(
    path: Path, *, live: bool = False, damaged: bool = False
) -> Iterator[tuple[h5py.File, Superblock]]:
    """Open an HDF5 file for reading; gives its superblock too.

    `live`: also one that its writer left open, the values that were flushed are read; `damaged`: in
    whatever state, if the library can, parts may be missing.

    Raises RecordingError: no such file, no HDF5 file, truncated, not closed, damaged; it leads to
    another file, or claims more values than it can hold.
    """
    import h5py

    with explain_errors(path, "read"):
        head = superblock_of(path)
    if is_part(path) and (head is None or head.blank):
        raise blank_error(path)
    if head is None:
        raise _no_hdf5_error(path)
    if head.truncated and not damaged and not (live and head.writing):
        raise RecordingError(
            f"it is truncated: {head.size} of {head.end} bytes",
            fix=SAVE,
            place=path,
        )
    if head.writing and not live and not damaged:
        raise not_closed_error(path)
    with ExitStack() as stack:
        with explain_errors(path, "open"):
            source: object = path
            if not head.whole:
                source = PaddedFile(stack.enter_context(open_regular(path)), head)
            file = stack.enter_context(h5py.File(source, "r"))
        with explain_errors(path, "read"):
            _held = check_file(file, path)
        yield file, head


@dataclass(frozen=True, slots=True)
class Superblock:
    """The first bytes of an HDF5 file: who left it open, and how long it should be."""

    writing: bool  #: opened for writing and not closed
    blank: bool  #: nothing was flushed yet: not opened for readers
    end: int  #: bytes that the file should have
    size: int  #: bytes that it has

    @property
    def truncated(self) -> bool:
        """Whether the end of the file is missing."""
        return self.size < self.end

    @property
    def whole(self) -> bool:
        """Whether it was closed by its writer and has its whole length."""
        return not self.writing and not self.truncated


def superblock_of(path: Path) -> Superblock | None:
    """Return the superblock of a file; None if it is no HDF5 file, OSError if it is unreadable."""
    size = regular_size(path)
    with open_regular(path) as file:
        start = 0
        while start < size:  # a user block of 512, 1024, 2048, ... bytes may come first
            file.seek(start)
            head = file.read(64)
            if head.startswith(_SIGNATURE) and len(head) >= 12:
                return _parse_superblock(head, size)
            start = max(512, 2 * start)
    return None


def _parse_superblock(head: bytes, size: int) -> Superblock | None:
    version = head[8]
    if version not in _END_AT:
        return None
    width = head[13] if version < 2 else head[9]
    flags = head[11] if version >= 3 else 0
    at, writing = _END_AT[version], bool(flags & _WRITING)
    end = _number(head, at) if width == 8 and len(head) >= at + 8 else size
    return Superblock(writing, writing and not flags & _SWMR, end, size)


class PaddedFile(io.RawIOBase):
    """An HDF5 file with zeros where its end is missing; the file itself is not touched.

    Parts that depend on the missing bytes fail alone, by their checksums. Opened with `swmr=True`
    instead, HDF5 reads metadata with a wrong checksum again and again for a writer that is gone
    (9 minutes in HDF5 2.0), and h5py has no `H5Pset_metadata_read_attempts`.
    """

    def __init__(self, file: BinaryIO, head: Superblock) -> None:
        self._file = file
        self._length = max(head.end, head.size)
        self._at = 0

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place."""
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._length}[whence]
        self._at = base + offset
        return self._at

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        """Fill the buffer with the next bytes, zeros where the file has none."""
        count = max(0, min(len(buffer), self._length - self._at))
        self._file.seek(self._at)
        buffer[:count] = self._file.read(count).ljust(count, b"\0")
        self._at += count
        return count


def check_file(file: h5py.File, path: Path) -> list[h5py.h5d.DatasetID]:
    """Check an open HDF5 file before anything in it is read.

    Returns datasets to be kept open as long as the file: their large chunks are then unpacked once.
    Raises RecordingError: it leads to another file, or claims more values than it can hold;
    RuntimeError, ValueError: it is damaged.
    """
    import h5py

    if not strings_end(path):
        raise ValueError("a collection of strings without end")
    most = FREE + PACKED * path.stat().st_size
    root = file["/"].id
    groups, known = [(root, "")], {h5py.h5o.get_info(root).addr}
    soft: list[tuple[h5py.h5g.GroupID, bytes, str]] = []
    held: list[h5py.h5d.DatasetID] = []
    links = 0
    while groups:
        group, folder = groups.pop()
        found = _links(group)
        links += len(found)
        if links > _MOST_LINKS or folder.count("/") > _MOST_DEPTH:
            raise RecordingError(
                f"it holds more than {_MOST_LINKS:,} objects, or groups {_MOST_DEPTH} deep",
                fix="copy the images into a file of their own",
                place=path,
            )
        for name, kind in found:
            place = f"{folder}/{name.decode(errors='replace')}"
            if kind == h5py.h5l.TYPE_SOFT:
                soft.append((group, name, place))
                continue
            if kind != h5py.h5l.TYPE_HARD:
                raise _leads_out(path, place)
            try:
                item = h5py.h5o.open(group, name)
            except (KeyError, RuntimeError, ValueError, OSError):
                continue  # damaged: nobody can read it
            if isinstance(item, h5py.h5g.GroupID):
                address = h5py.h5o.get_info(item).addr
                if address not in known:
                    known.add(address)
                    groups.append((item, place))
            elif isinstance(item, h5py.h5d.DatasetID):
                cache = _checked_cache(item, path, place, most)
                del item  # the first who opens it decides on its cache
                if cache is not None:
                    held.append(h5py.h5d.open(group, name, cache))
    for group, name, place in soft:  # no link of the file leads out of it: these can be followed
        try:
            resolves = h5py.h5o.exists_by_name(group, name)
        except RuntimeError:  # a link to itself, or through something that is no group
            resolves = False
        if not resolves:
            raise RecordingError(
                f"{place[:80]} is a link that leads nowhere",
                fix="delete the link, or copy the images into a file of their own",
                place=path,
            )
    return held


def _links(group: h5py.h5g.GroupID) -> list[tuple[bytes, int]]:
    """Return names and kinds of the links of a group; follows none of them."""
    import h5py

    found: list[tuple[bytes, int]] = []

    def note(name: bytes, info: h5py.h5l.LinkInfo) -> bool:
        found.append((name, info.type))
        return len(found) > _MOST_LINKS  # ends

    # as they stand in the file: other orders trust a number of links that the file tells
    group.links.iterate(note, order=h5py.h5.ITER_NATIVE, info=True)
    return found


def _checked_cache(
    dataset: h5py.h5d.DatasetID, path: Path, place: str, most: int
) -> h5py.h5p.PropDAID | None:
    """Check a dataset by its header; return a cache for its chunks if they are large.

    The layout comes first: asked for its shape, a virtual dataset opens its sources.
    """
    import h5py

    made = dataset.get_create_plist()
    layout = made.get_layout()
    if layout == h5py.h5d.VIRTUAL or made.get_external_count():
        raise _leads_out(path, place)
    filters = [made.get_filter(number)[0] for number in range(made.get_nfilters())]
    if len(set(filters)) < len(filters):
        raise RecordingError(
            f"{place[:80]} is packed twice, and may unpack to any size",
            fix="save it with one compression",
            place=path,
        )
    shape, size = dataset.shape, dataset.get_type().get_size()
    chunked = layout == h5py.h5d.CHUNKED
    chunk = made.get_chunk() if chunked else (1,) * len(shape)
    piece = math.prod(chunk) * size
    pieces = math.prod(-(-n // c) for n, c in zip(shape, chunk, strict=True))
    if chunked and piece > MOST_CHUNK:
        raise RecordingError(
            f"{place[:80]} is stored in chunks of {piece:,} bytes, {MOST_CHUNK:,} can be read",
            fix="save it in smaller chunks, of 64 images each",
            place=path,
        )
    if pieces * (max(piece, _PIECE) if chunked else piece) > most:
        raise RecordingError(
            f"{place[:80]} claims {' x '.join(map(str, shape))} values, more than a file of "
            f"{path.stat().st_size:,} bytes can hold",
            fix="save only what was measured, without a place for more",
            place=path,
        )
    if not chunked or piece <= _LARGE_CHUNK:
        return None
    access = dataset.get_access_plist()
    slots, usual, weight = access.get_chunk_cache()
    access.set_chunk_cache(slots, max(piece, usual), weight)
    return access


def _leads_out(path: Path, place: str) -> RecordingError:
    return RecordingError(
        f"{place[:80]} leads to another file: a recording holds all its values itself",
        fix="copy the values into one file, without links, external or virtual datasets",
        place=path,
    )


def strings_end(path: Path) -> bool:
    """Tell whether every collection of strings in the beginning of a file has an end."""
    room = 2 * path.stat().st_size  # collections lie apart; those that were freed may overlap
    with open_regular(path) as file:
        for start in _heaps(file):
            file.seek(start + 8)
            objects = file.read(max(0, min(_number(file.read(8), 0), _SEARCHED) - _HEAD))
            room -= len(objects)
            if room < 0 or not _ends(objects):
                return False
    return True


def _heaps(file: BinaryIO) -> Iterator[int]:
    """Yield where collections begin."""
    for first in range(0, _SEARCHED, _AT_ONCE):
        file.seek(first)
        data = file.read(_AT_ONCE + len(_HEAP) - 1)
        at = data.find(_HEAP)
        while at >= 0:
            yield first + at
            at = data.find(_HEAP, at + 1)
        if len(data) < _AT_ONCE:
            return


def _ends(data: bytes) -> bool:
    """Tell whether the objects of a collection lead to its end, or beyond the end of the file."""
    at = 0
    while at + _HEAD <= len(data):
        length = _number(data, at + 8)
        if int.from_bytes(data[at : at + 2], "little"):
            at += _HEAD + -(-length // _ALIGNED) * _ALIGNED
        elif length < _HEAD:  # what is free counts its own head
            return False
        else:
            at += length
    return True


def _number(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 8], "little")


def _no_hdf5_error(path: Path) -> RecordingError:
    if path.stat().st_size == 0:
        return RecordingError("it is empty", fix="delete it", place=path)
    return RecordingError(
        "it is no HDF5 file",
        fix="give a recording (.h5), or import an array from .npy or .mat",
        place=path,
    )
