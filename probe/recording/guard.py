"""What an HDF5 file may ask of its reader: values of its own, and no more than it can hold.

HDF5 lets a dataset stand in any other file, and lets 1,400 bytes claim 10^9 images. Every file
that is opened is checked here, by its links and headers alone, before a value is read.

References
----------
HDF5 File Format Specification 3.0, IV.A.2: link, data layout and external data files messages.
RFC 1951: deflate packs at most 1,032 bytes into one.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Final

from probe.errors import RecordingError
from probe.recording.heap import strings_end

if TYPE_CHECKING:
    import h5py

MOST_TACTELS: Final = 1 << 20  #: of an image, 1024 x 1024; 256 of them are read at a time
_FREE: Final = 8 << 20  #: bytes of values that any file may hold: 16,384 images of 16 x 16
_PACKED: Final = 1100  #: bytes of values in a byte of the file; our recordings reach 185
_PIECE: Final = 512  #: bytes of values that a chunk costs at least, to find and to unpack
_MOST_CHUNK: Final = 64 << 20  #: bytes of a chunk, which is unpacked as a whole
_LARGE_CHUNK: Final = 256 << 10  #: bytes; it is kept from one block to the next
_MOST_LINKS: Final = 10_000  #: of all groups; checking as many datasets takes 1 to 2 s
_MOST_DEPTH: Final = 64  #: groups in one another; libhdf5 visits them by recursion


def check_file(file: h5py.File, path: Path) -> list[h5py.h5d.DatasetID]:
    """Check an open HDF5 file before anything in it is read.

    Returns
    -------
    Datasets to be kept open as long as the file, so that their large chunks are not unpacked
    again for every block.

    Raises
    ------
    RecordingError
        It leads to another file, or claims more values than it can hold.
    RuntimeError, ValueError
        It is damaged.
    """
    import h5py

    if not strings_end(path):
        raise ValueError("a collection of strings without end")
    most = _FREE + _PACKED * path.stat().st_size
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
                place=str(path),
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
        if not _resolves(group, name):
            raise RecordingError(
                f"{place[:80]} is a link that leads nowhere",
                fix="delete the link, or copy the images into a file of their own",
                place=str(path),
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


def _resolves(group: h5py.h5g.GroupID, name: bytes) -> bool:
    import h5py

    try:
        return bool(h5py.h5o.exists_by_name(group, name))
    except RuntimeError:  # a link to itself, or through something that is no group
        return False


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
    shape, size = dataset.shape, dataset.get_type().get_size()
    chunked = layout == h5py.h5d.CHUNKED
    chunk = made.get_chunk() if chunked else (1,) * len(shape)
    piece = math.prod(chunk) * size
    pieces = math.prod(-(-n // c) for n, c in zip(shape, chunk, strict=True))
    asked = pieces * (max(piece, _PIECE) if chunked else piece)
    if chunked and piece > _MOST_CHUNK:
        raise RecordingError(
            f"{place[:80]} is stored in chunks of {piece:,} bytes, {_MOST_CHUNK:,} can be read",
            fix="save it in smaller chunks, of 64 images each",
            place=str(path),
        )
    if asked > most:
        raise RecordingError(
            f"{place[:80]} claims {' x '.join(map(str, shape))} values, more than a file of "
            f"{path.stat().st_size:,} bytes can hold",
            fix="save only what was measured, without a place for more",
            place=str(path),
        )
    access = dataset.get_access_plist()
    slots, usual, weight = access.get_chunk_cache()
    if not chunked or piece <= _LARGE_CHUNK:
        return None
    access.set_chunk_cache(slots, max(piece, usual), weight)
    return access


def _leads_out(path: Path, place: str) -> RecordingError:
    return RecordingError(
        f"{place[:80]} leads to another file: a recording holds all its values itself",
        fix="copy the values into one file, without links, external or virtual datasets",
        place=str(path),
    )
