"""The file of a killed writer, or a bad copy -> a recording that anybody can read.

Images that can be read are copied into a new file, which takes the place of the old one. Times,
numbers, wrist readings and poses that end before the images are continued, see `FrameFile.read`.
Where anything was lost, the old file stays as `touch.damaged.h5`: another tool may get more out
of it.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path
from types import MappingProxyType

from probe.errors import RecordingError
from probe.recording.files import (
    SAVE,
    draft_of,
    explain_errors,
    final_of,
    is_locked,
    is_part,
    part_of,
    piece_of,
    series_of,
)
from probe.recording.hdf5 import write_hdf5
from probe.recording.layout import CHUNK, FrameBlock, FrameFile
from probe.recording.read import open_frames


@dataclass(frozen=True, slots=True)
class RepairResult:
    """A recording after repair."""

    path: Path  #: where it is now
    frames: int  #: in it
    lost: int  #: frames that were in the file and could not be read
    changed: bool  #: whether there was anything to repair
    continued: tuple[str, ...] = ()  #: datasets that ended before the images
    kept: Path | None = None  #: where the old file is; None: it held nothing more


def repair(path: Path | str) -> RepairResult:
    """Make a recording readable that was not closed, or is damaged or truncated.

    `path` is the file, `touch.part.h5`, or the name that it should have had, `touch.h5`. A
    recording that is whole is left as it is.

    Raises RecordingError: it is being written, holds nothing that can be read, or the disk is full.
    """
    path = Path(path)
    if not path.exists() and part_of(path).exists():
        path = part_of(path)
    if is_locked(path):
        raise RecordingError(
            "it is still being written", fix="stop the recording first", place=path
        )
    with _open_damaged(path) as file:
        target = _free_name(path, file.piece) if is_part(path) else path
        frames = sum(map(len, _readable_blocks(file)))
        lost, origin = max(file.lengths.values()) - frames, file.origin
        images = file.lengths["frames"]
        short = tuple(name for name, length in file.lengths.items() if length < images)
        if file.closed and file.even and not lost:
            if path != target:
                with explain_errors(path, "rename"):
                    os.rename(path, target)
            return RepairResult(target, frames, 0, changed=path != target)
        if lost and not frames:
            raise RecordingError("no frame in it can be read", fix="copy it again", place=path)
        said = {"frames_lost": lost, "continued": ", ".join(short)}
        more = {**origin.more, **{name: value for name, value in said.items() if value}}
        origin = dataclasses.replace(origin, more=MappingProxyType(more))
        draft = draft_of(target)
        write_hdf5(draft, origin, _readable_blocks(file), target, file.piece)
    kept = None
    with explain_errors(path, "replace"):
        if lost or short or not file.own:
            kept = _first_free(target.with_name(f"{target.stem}.damaged{target.suffix}"))
            os.link(path, kept)
        os.replace(draft, path)
        if path != target:
            os.rename(path, target)
    return RepairResult(target, frames, lost, changed=True, continued=short, kept=kept)


@contextmanager
def _open_damaged(path: Path) -> Iterator[FrameFile]:
    """Open a file in whatever state; one that cannot be opened is not sent to `repair` again."""
    with ExitStack() as stack:
        try:
            file = stack.enter_context(open_frames(path, damaged=True))
        except RecordingError as error:
            if error.fix != SAVE:
                raise
            raise RecordingError(
                "it is damaged: nothing in it can be read", fix="copy it again", place=path
            ) from error
        yield file


def _readable_blocks(file: FrameFile) -> Iterator[FrameBlock]:
    """Yield the blocks that can be read, one for each that was compressed."""
    images = file.lengths["frames"]
    for start in range(0, images, CHUNK):
        try:
            yield file.read(start, min(start + CHUNK, images))
        except RecordingError:
            continue


def _free_name(part: Path, piece: int) -> Path:
    """Return the name that a part file would have got, had it been closed."""
    path = final_of(part)
    if piece == 1 and not path.exists() and not series_of(path):
        return path
    named = piece_of(path, piece)
    if named.exists():
        raise RecordingError(
            f"{named.name} exists, and this is piece {piece} too",
            fix=f"move {named.name} away",
            place=part,
        )
    return named


def _first_free(path: Path) -> Path:
    numbered = (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in count(2))
    return next(name for name in chain([path], numbered) if not name.exists())
