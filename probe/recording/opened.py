"""Open a recording, and say why not.

What is wrong with a file is told by its first bytes and by the lock on it, not by the
library's message.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from probe.errors import RecordingError
from probe.recording.guard import check_file
from probe.recording.lock import is_locked
from probe.recording.names import final_of, is_part, part_of
from probe.recording.padded import PaddedFile
from probe.recording.superblock import Superblock, superblock_of

if TYPE_CHECKING:
    import h5py


@contextmanager
def open_recording(path: Path, *, live: bool = False) -> Iterator[h5py.File]:
    """Open an HDF5 file for reading.

    Parameters
    ----------
    path
        The file.
    live
        Also one that is being written, or that its writer left open: what was flushed is read.

    Raises
    ------
    RecordingError
        No such file, no HDF5 file, truncated, not closed, damaged; or what `guard` refuses.
    """
    head = _head_of(path)
    if head.truncated and not (live and head.writing):
        raise RecordingError(
            f"it is truncated: {head.size} of {head.end} bytes",
            fix="copy it again, or save what can be read with `repair`",
            place=str(path),
        )
    if head.writing and not live:
        raise _not_closed(path)
    with _open_file(path, head) as file:
        yield file


@contextmanager
def open_anyhow(path: Path) -> Iterator[tuple[h5py.File, Superblock]]:
    """Open an HDF5 file in whatever state, if the library can; parts may be missing.

    Raises
    ------
    RecordingError
        No such file, no HDF5 file, its beginning is lost; or what `guard` refuses.
    """
    import h5py

    with ExitStack() as stack:
        with explain_errors(path, "read"):
            stream = stack.enter_context(open(path, "rb"))
        head = _head_of(path)
        with explain_errors(path, "open"):
            source = path if head.whole else PaddedFile(stream, head)
            file = stack.enter_context(h5py.File(source, "r"))
        with explain_errors(path, "read"):
            _held = check_file(file, path)
        yield file, head


def _head_of(path: Path) -> Superblock:
    """Return the beginning of a file that is HDF5."""
    with explain_errors(path, "read"):
        head = superblock_of(path)
    if is_part(path) and _blank(head):
        raise _nothing_yet(path)
    if head is None:
        raise _no_hdf5(path)
    return head


@contextmanager
def _open_file(path: Path, head: Superblock) -> Iterator[h5py.File]:
    import h5py

    with explain_errors(path, "open"):
        try:
            file = h5py.File(path, "r", swmr=head.writing)
        except OSError:
            if superblock_of(path) == head:
                raise
            file = h5py.File(path, "r")  # closed meanwhile
    try:
        with explain_errors(path, "read"):
            _held = check_file(file, path)
        yield file
    finally:
        file.close()


def is_blank(part: Path) -> bool:
    """Tell whether nothing in a part file has reached the disk yet."""
    with explain_errors(part, "read"):
        return _blank(superblock_of(part))


@contextmanager
def explain_errors(path: Path, action: str) -> Iterator[None]:
    """Turn errors of the system and of the HDF5 library into one that says the way out."""
    try:
        yield
    except OSError as error:
        if isinstance(error, FileNotFoundError) and action in ("read", "open"):
            raise _missing_error(path) from error
        if error.errno is None:
            raise _damaged_error(path, action) from error
        reason = os.strerror(error.errno)
        fix = FIXES.get(error.errno, "check the disk and the folder")
        raise RecordingError(f"cannot {action} it: {reason}", fix=fix, place=str(path)) from error
    except (RuntimeError, KeyError, ValueError, TypeError) as error:
        raise _damaged_error(path, action) from error


_OTHER_FOLDER = "choose a folder that you may read and write"
FIXES = {
    errno.ENOSPC: "free some space",
    errno.EDQUOT: "free some of your quota",
    errno.EFBIG: "choose a file system that takes larger files",
    errno.EACCES: _OTHER_FOLDER,
    errno.EPERM: _OTHER_FOLDER,
    errno.EROFS: _OTHER_FOLDER,
    errno.ENOENT: "make the folder first",
    errno.ENOTDIR: "a file stands where the folder should be",
    errno.EISDIR: "this is a folder: name a file in it",
    errno.ENAMETOOLONG: "take a shorter name",
}


def _missing_error(path: Path) -> RecordingError:
    part = part_of(path)
    if not is_part(path) and part.exists():
        return _not_closed(part)
    if is_part(path) and final_of(path).exists():
        fix = f"it was closed meanwhile: read {final_of(path).name}"
        return RecordingError("there is no such recording", fix=fix, place=str(path))
    return RecordingError(
        "there is no such recording", fix="check the name of the file", place=str(path)
    )


def _not_closed(path: Path) -> RecordingError:
    if is_locked(path):
        return RecordingError(
            "it is still being written",
            fix="wait until it is closed, or read what there is with `live`",
            place=str(path),
        )
    return RecordingError(
        "its writer ended without closing it",
        fix=f"run `repair` on {path.name}: it keeps every frame that reached the disk",
        place=str(path),
    )


def _blank(head: Superblock | None) -> bool:
    return head is None or (head.writing and not head.swmr)


def _nothing_yet(path: Path) -> RecordingError:
    """Return the error of a file whose writer has not yet brought anything to the disk."""
    return RecordingError(
        "nothing in it has reached the disk yet",
        fix="wait for its first frames" if is_locked(path) else "delete it: it holds no frame",
        place=str(path),
    )


def _no_hdf5(path: Path) -> RecordingError:
    if path.stat().st_size == 0:
        return RecordingError("it is empty", fix="delete it", place=str(path))
    return RecordingError(
        "it is no HDF5 file",
        fix="give a recording (.h5), or import an array from .npy or .mat",
        place=str(path),
    )


def _damaged_error(path: Path, action: str) -> RecordingError:
    return RecordingError(
        f"it is damaged: cannot {action} it",
        fix="copy it again, or save what can be read with `repair`",
        place=str(path),
    )
