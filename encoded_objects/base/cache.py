"""Costly results, kept in the user's cache folder under the hash of what made them.

A file is whole or not there (atomic rename), is checked as it is read, and never changes:
processes may share the folder, and it may be deleted at any time. Beyond a number of bytes the
files unused for longest go. Where the folder cannot be written nothing is kept and everything
works; `XDG_CACHE_HOME=/dev/null` turns it off.
"""

from __future__ import annotations

import hashlib
import os
import zlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

from encoded_objects.base.files import staged_file

LARGEST_BYTES = 128 * 2**20  #: of one kind, together: 25 templates with their banks
_CHECK_BYTES = 4


def cache_folder(kind: str) -> Path:
    """Return the folder of a kind, in `XDG_CACHE_HOME` or `~/.cache`; RuntimeError without home."""
    given = os.environ.get("XDG_CACHE_HOME")
    root = Path(given) if given and Path(given).is_absolute() else Path.home() / ".cache"
    return root / "encoded-objects" / kind


def content_key(values: Iterable[object], sources: Iterable[Path] = ()) -> str:
    """Return the hash of values (by their `repr`) and of the files whose code works on them."""
    digest = hashlib.sha256("\0".join(map(repr, values)).encode())
    for source in sorted(sources):
        digest.update(f"\0{source.name}\0".encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:32]


def cached_bytes(
    kind: str, key: str, make: Callable[[], bytes], *, largest: int = LARGEST_BYTES
) -> bytes:
    """Return what `make` returns; from the second time on from the file `key` in folder `kind`."""
    try:
        file = cache_folder(kind) / key
    except RuntimeError:
        return make()
    found = _checked(file)
    if found is not None:
        return found
    content = make()
    with suppress(OSError):
        _write(file, content)
        _shrink(file.parent, largest)
    return content


def _checked(file: Path) -> bytes | None:
    """Return the content of a file; None where it is missing or damaged."""
    try:
        with file.open("rb") as stream:
            check, content = stream.read(_CHECK_BYTES), stream.read()
    except OSError:
        return None
    with suppress(OSError):
        os.utime(file)  # used now
    return content if zlib.crc32(content).to_bytes(_CHECK_BYTES, "little") == check else None


def _write(file: Path, content: bytes) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    with staged_file(file) as draft:
        draft.touch(0o600)
        draft.write_bytes(zlib.crc32(content).to_bytes(_CHECK_BYTES, "little") + content)


def _shrink(folder: Path, largest: int) -> None:
    """Delete the files unused for longest, and drafts of processes that were killed."""
    files = sorted(((at.stat(), at) for at in folder.iterdir()), key=lambda one: -one[0].st_mtime)
    total = 0
    for state, file in files:
        total += state.st_size
        if total > largest:
            file.unlink(missing_ok=True)
