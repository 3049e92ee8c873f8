"""Who is writing: a lock on the part file that goes when its owner goes, however it ends.

An open-file-description lock: HDF5 itself uses `flock`, which does not meet it, so that
anybody may read the file while it is locked. On a file system without locks nobody seems
to be writing.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import struct
from pathlib import Path
from typing import Final

_FLOCK: Final = "hhqqi0q"  #: struct flock: type, whence, start, length (0: all), process


def take_lock(descriptor: int) -> None:
    """Lock the file behind a descriptor that may write, until the descriptor is closed."""
    with contextlib.suppress(OSError):  # no locks here; part files are made exclusively anyway
        fcntl.fcntl(descriptor, fcntl.F_OFD_SETLK, _request(fcntl.F_WRLCK))


def is_locked(path: Path) -> bool:
    """Tell whether a process that lives holds the lock on this file."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        answer = fcntl.fcntl(descriptor, fcntl.F_OFD_GETLK, _request(fcntl.F_RDLCK))
    except OSError:
        return False
    finally:
        os.close(descriptor)
    kind: int = struct.unpack(_FLOCK, answer)[0]
    return kind != fcntl.F_UNLCK


def _request(kind: int) -> bytes:
    return struct.pack(_FLOCK, kind, os.SEEK_SET, 0, 0, 0)
