"""The files of a recording: their names, who is writing them, and why one cannot be used.

`touch.h5` is written as `touch.part.h5`. Closed before it rolled over, it becomes `touch.h5`;
once it rolls over, its pieces are `touch-0001.h5`, `touch-0002.h5`, ...

The writer of a part file holds a lock on it, which the system releases when the writer ends,
however it ends. It is an open-file-description lock, which does not meet the `flock` of HDF5:
anybody may read the file meanwhile. On a file system without locks nobody seems to be writing.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import re
import struct
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Final

from encoded_objects.base.errors import exit_code_of_write
from encoded_objects.base.foreign import DAMAGE, open_regular
from probe.errors import RecordingError

_PART = ".part"
SAVE: Final = "copy it again, or save what can be read with `repair`"  #: of a damaged file
_FLOCK: Final = "hhqqi0q"  #: struct flock: type, whence, start, length (0: all), process
_OTHER_FOLDER = "choose a folder that you may read and write"
_FIXES = {
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
    errno.EINVAL: "give the file of a recording",
}


@contextlib.contextmanager
def explain_errors(path: Path, action: str) -> Iterator[None]:
    """Turn errors of the system and of the HDF5 library into one with a way out."""
    try:
        yield
    except OSError as error:
        if isinstance(error, FileNotFoundError) and action in ("read", "open"):
            raise _missing_error(path) from error
        if error.errno is None:
            raise damaged_error(path, action) from error
        reason = error.strerror
        fix = _FIXES.get(error.errno, "check the disk and the folder")
        code = None if action in ("read", "open") else exit_code_of_write(error)
        raise RecordingError(
            f"cannot {action} it: {reason}", fix=fix, place=path, exit_code=code
        ) from error
    except DAMAGE as error:
        raise damaged_error(path, action) from error


def damaged_error(path: Path, action: str = "read") -> RecordingError:
    """Return the error of a damaged file."""
    return RecordingError(
        f"it is damaged: cannot {action} it",
        fix=SAVE,
        place=path,
    )


def not_closed_error(path: Path) -> RecordingError:
    """Return the error of a file that its writer has not closed (yet)."""
    if is_locked(path):
        return RecordingError(
            "it is still being written",
            fix="wait until it is closed, or read what there is with `live`",
            place=path,
        )
    return RecordingError(
        "its writer ended without closing it",
        fix=f"run `repair` on {path.name}: it keeps every frame that reached the disk",
        place=path,
    )


def blank_error(part: Path) -> RecordingError:
    """Return the error of a part file without any frame."""
    return RecordingError(
        "nothing in it has reached the disk yet",
        fix="wait for its first frames" if is_locked(part) else "delete it: it holds no frame",
        place=part,
    )


def take_lock(descriptor: int) -> None:
    """Lock the file behind a descriptor that may write, until the descriptor is closed."""
    with contextlib.suppress(OSError):  # no locks here; part files are made exclusively anyway
        fcntl.fcntl(descriptor, fcntl.F_OFD_SETLK, _lock_request(fcntl.F_WRLCK))


def is_locked(path: Path) -> bool:
    """Tell whether a running process holds the lock on this file."""
    try:
        with open_regular(path) as file:
            answer = fcntl.fcntl(file, fcntl.F_OFD_GETLK, _lock_request(fcntl.F_RDLCK))
    except OSError:
        return False
    kind: int = struct.unpack(_FLOCK, answer)[0]
    return kind != fcntl.F_UNLCK


def part_of(path: Path) -> Path:
    """Return the name of `path` while it is written."""
    return path.with_name(f"{path.stem}{_PART}{path.suffix}")


def is_part(path: Path) -> bool:
    """Tell whether this is the name of a recording that is not closed."""
    return path.stem.endswith(_PART)


def final_of(path: Path) -> Path:
    """Return the name under which the part file `path` was asked for."""
    return path.with_name(path.stem.removesuffix(_PART) + path.suffix)


def piece_of(path: Path, number: int) -> Path:
    """Return the name of piece `number` (from 1) of the series `path`."""
    return path.with_name(f"{path.stem}-{number:04d}{path.suffix}")


def draft_of(path: Path) -> Path:
    """Return a hidden name for a file that will replace `path` once it is whole."""
    return path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")


def series_of(path: Path) -> list[tuple[int, Path]]:
    """Return the closed pieces of the series `path`, with their numbers, in order."""
    name = re.compile(re.escape(path.stem) + r"-(\d{4,})" + re.escape(path.suffix))
    try:
        others = list(path.parent.iterdir())
    except OSError:
        return []
    found = [(name.fullmatch(other.name), other) for other in others]
    return sorted((int(match[1]), other) for match, other in found if match)


def check_name(path: Path, *, replace: bool) -> None:
    """Refuse a name that no recording can have, or that is taken and not to be replaced.

    Raises RecordingError: another suffix than .h5 or .hdf5, or a recording of that name.
    """
    if path.suffix not in (".h5", ".hdf5") or is_part(path):
        raise RecordingError(
            f"'{path.name}' is no name for a recording", fix="take a name like touch.h5", place=path
        )
    taken = [path] if path.exists() else [old for _, old in series_of(path)]
    if taken and not replace:
        raise RecordingError(
            "a recording of that name exists", fix="take another name", place=str(taken[0])
        )


def final_name(
    part: Path, path: Path, number: int = 1, *, last: bool = True, replace: bool
) -> Path:
    """Give the closed file `part` its name in the recording `path`, and return that.

    `number` is its place there, from 1, and `last` tells that the recording ends with it; `replace`
    removes the files of an older recording. Raises RecordingError: another file has got that name
    meanwhile; the closed file stays.
    """
    final = path if last and number == 1 else piece_of(path, number)
    if final.exists() and not replace:
        raise RecordingError(
            "another file took the name of the recording",
            fix=f"move it away, then run `repair` on {part.name}",
            place=final,
        )
    os.replace(part, final)
    if replace:
        old = [path] if final != path else []
        old += [piece for n, piece in series_of(path) if last and (n > number or final == path)]
        for file in old:
            file.unlink(missing_ok=True)
    return final


def next_free(folder: Path, stem: str, suffix: str) -> Path:
    """Return the first free name of STEM-001, STEM-002, ..."""
    paths = (folder / f"{stem}-{number:03d}{suffix}" for number in count(1))
    return next(
        path
        for path in paths
        if not any(one.exists() for one in (path, part_of(path), path.with_suffix(".npy")))
    )


def _missing_error(path: Path) -> RecordingError:
    if not is_part(path) and part_of(path).exists():
        return not_closed_error(part_of(path))
    fix = "check the name of the file"
    if is_part(path) and final_of(path).exists():
        fix = f"it was closed meanwhile: read {final_of(path).name}"
    return RecordingError("there is no such recording", fix=fix, place=path)


def _lock_request(kind: int) -> bytes:
    return struct.pack(_FLOCK, kind, os.SEEK_SET, 0, 0, 0)
