"""What a killed writer or a bad copy left -> a recording that anybody can read.

Frames that can be read are copied into a new file, which takes the place of the old one.
Where frames were lost, the old file stays as `touch.damaged.h5`: another tool may get more
out of it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from probe.errors import RecordingError
from probe.recording.checked import CheckedFile, check_open_file, read_block
from probe.recording.layout import CHUNK, FrameBlock
from probe.recording.lock import is_locked
from probe.recording.names import final_of, is_part, part_of, piece_of, series_of
from probe.recording.opened import explain_errors, open_anyhow
from probe.recording.write import FileWriter

if TYPE_CHECKING:
    import h5py


@dataclass(frozen=True, slots=True)
class RepairResult:
    """A recording after repair."""

    path: Path  #: where it is now
    frames: int  #: in it
    lost: int  #: frames that were in the file and could not be read
    changed: bool  #: whether there was anything to repair


def repair(path: Path | str) -> RepairResult:
    """Make a recording readable that was not closed, or is damaged or truncated.

    Parameters
    ----------
    path
        The file, `touch.part.h5`, or the name that it should have had, `touch.h5`.

    Returns
    -------
    Where the recording is and how much of it. One that is whole is left as it is.

    Raises
    ------
    RecordingError
        It is being written, holds nothing that can be read, or the disk is full.
    """
    path = Path(path)
    if not path.exists() and part_of(path).exists():
        path = part_of(path)
    if is_locked(path):
        raise RecordingError(
            "it is still being written", fix="stop the recording first", place=str(path)
        )
    with open_anyhow(path) as (source, head):
        seen = check_open_file(source, path)
        target = _free_name(path, seen) if is_part(path) else path
        if head.whole and seen.even and _count_readable(source, path, seen) == seen.frames:
            return _rename(path, target, seen)
        copy = path.with_name(f".{target.name}.repair")
        copy.unlink(missing_ok=True)
        frames = _copy(source, path, seen, copy)
    lost = seen.frames - frames
    if not frames and seen.frames:
        copy.unlink()
        raise RecordingError("no frame in it can be read", fix="copy it again", place=str(path))
    with explain_errors(path, "replace"):
        if lost or not seen.own:
            damaged = _first_free(target.with_name(f"{target.stem}.damaged{target.suffix}"))
            os.link(path, damaged)
        os.replace(copy, target)
        if path != target:
            path.unlink()
    return RepairResult(target, frames, lost, changed=True)


def _copy(source: h5py.File, path: Path, seen: CheckedFile, copy: Path) -> int:
    """Write every block that can be read to a new file; return the number of frames."""
    lost, origin = seen.frames - _count_readable(source, path, seen), seen.origin
    if lost:
        note = {**origin.more, "frames_lost": lost}
        origin = replace(origin, more=MappingProxyType(note))
    with FileWriter(copy, origin, seen.piece) as writer:
        for block in _blocks(source, path, seen):
            writer.write(block)
    return writer.frames


def _count_readable(source: h5py.File, path: Path, seen: CheckedFile) -> int:
    return sum(len(block) for block in _blocks(source, path, seen))


def _blocks(source: h5py.File, path: Path, seen: CheckedFile) -> Iterator[FrameBlock]:
    """Yield the blocks that can be read, one for each that was compressed."""
    for start in range(0, seen.frames, CHUNK):
        try:
            yield read_block(source, path, start, min(start + CHUNK, seen.frames))
        except RecordingError:
            continue


def _rename(path: Path, target: Path, seen: CheckedFile) -> RepairResult:
    if path != target:
        with explain_errors(path, "rename"):
            os.rename(path, target)
    return RepairResult(target, seen.frames, 0, changed=path != target)


def _free_name(part: Path, seen: CheckedFile) -> Path:
    """Return the name that a part file would have got, had it been closed."""
    path = final_of(part)
    if seen.piece == 1 and not path.exists() and not series_of(path):
        return path
    piece = piece_of(path, seen.piece)
    if piece.exists():
        raise RecordingError(
            f"{piece.name} exists, and this is piece {seen.piece} too",
            fix=f"move {piece.name} away",
            place=str(part),
        )
    return piece


def _first_free(path: Path) -> Path:
    number, free = 1, path
    while free.exists():
        number += 1
        free = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return free
