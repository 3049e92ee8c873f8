"""What the files of a recording are called.

`touch.h5` is written as `touch.part.h5`. Closed before it rolled over, it becomes `touch.h5`;
once it rolls over, its pieces are `touch-0001.h5`, `touch-0002.h5`, ...
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from probe.errors import RecordingError

_PART = ".part"


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


def series_of(path: Path) -> list[tuple[int, Path]]:
    """Return the closed pieces of the series `path`, with their numbers, in order."""
    name = re.compile(re.escape(path.stem) + r"-(\d{4,})" + re.escape(path.suffix))
    found = [(name.fullmatch(other.name), other) for other in _files_beside(path)]
    return sorted((int(match[1]), other) for match, other in found if match)


def check_name(path: Path, *, replace: bool) -> None:
    """Refuse a name that is none for a recording, or is taken.

    Raises
    ------
    RecordingError
        Another suffix than .h5 or .hdf5; or a recording of that name exists and the new one
        shall not replace it.
    """
    if path.suffix not in (".h5", ".hdf5") or is_part(path):
        raise RecordingError(
            f"'{path.name}' is no name for a recording",
            fix="take a name like touch.h5",
            place=str(path),
        )
    taken = [path] if path.exists() else [old for _, old in series_of(path)]
    if taken and not replace:
        raise RecordingError(
            "a recording of that name exists", fix="take another name", place=str(taken[0])
        )


def final_name(part: Path, path: Path, files: list[Path], *, last: bool, replace: bool) -> Path:
    """Give a closed part file its name, and return that.

    Parameters
    ----------
    part
        The closed file.
    path
        The name that was asked for.
    files
        Files of the same recording that have their names already.
    last
        Whether the recording ends with this one.
    replace
        Remove the files of an older recording of that name.

    Raises
    ------
    RecordingError
        Another file has got that name meanwhile; the part file stays.
    """
    number = len(files) + 1
    final = path if last and number == 1 else piece_of(path, number)
    if final.exists() and not replace:
        raise RecordingError(
            "another file took the name of the recording",
            fix=f"move it away, then run `repair` on {part.name}",
            place=str(final),
        )
    os.replace(part, final)
    if replace:
        old = [path] if final != path else []
        old += [piece for n, piece in series_of(path) if last and (n > number or final == path)]
        for file in old:
            file.unlink(missing_ok=True)
    return final


def next_free(folder: Path, stem: str, suffix: str) -> Path:
    """Return the first name STEM-001, STEM-002, ... that is free."""
    for number in count(1):
        path = folder / f"{stem}-{number:03d}{suffix}"
        beside = (path, part_of(path), path.with_suffix(".npy"))
        if not any(other.exists() for other in beside):
            return path
    raise AssertionError


@contextmanager
def unless_it_fails(path: Path) -> Iterator[Path]:
    """Remove a file that is being made when making it fails."""
    there = path.exists()
    try:
        yield path
    except BaseException:
        if not there:
            path.unlink(missing_ok=True)
        raise


def _files_beside(path: Path) -> Iterable[Path]:
    try:
        return list(path.parent.iterdir())
    except OSError:
        return []
