"""What the page may read and write: recordings and calibrations of one folder, printed parts.

A name is no path, and no link that leads out. Parts are those that lie in the database's folder
and have the bytes that it registers. Uploaded recordings are written as they come, bounded in
number, time and space.
"""

from __future__ import annotations

import asyncio
import os
import re
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from pathlib import Path

from fastapi.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect

from encoded_objects.base.files import staged_file
from generator.database.open import normal_url
from generator.database.part_file import part_state
from generator.database.registered import RegisteredPart
from recognizer.bench.convert import convert_recording
from recognizer.bench.errors import BenchError, BusyError, TooLongError, UnknownError

LISTED = 200  #: files of a kind that are offered
AT_ONCE = 2  #: recordings that are uploaded at the same time
UPLOAD = 64 * 1024 * 1024  #: bytes of a recording that is sent in
SILENT_S = 10.0  #: without a byte, after which an upload is given up
SLOWEST = 64 * 1024  #: bytes a second, from `SILENT_S` on: 64 MiB come in 17 minutes
QUOTA = 2 * 1024**3  #: bytes of all recordings in the folder; beyond, none is taken

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}")


def find_file(folder: Path, name: str, suffix: str) -> Path:
    """Return a file of the folder; `UnknownError` if it is none or not there."""
    path = folder / checked_name(name, suffix)
    if not path.is_file() or path.resolve().parent != folder.resolve():
        raise UnknownError(f"there is no file {name}", fix="choose one from the list")
    return path


def checked_name(name: str, suffix: str) -> str:
    """Return a name that can only mean a file of its folder; `UnknownError` for another."""
    if not _NAME.fullmatch(name) or not name.endswith(suffix) or ".." in name:
        raise UnknownError(
            f"{name[:60]!r} is no name of a file here",
            fix=f"give letters, digits, . _ - and the ending {suffix}",
        )
    return name


def list_files(folder: Path, suffix: str) -> list[str]:
    """Return the names of the newest files with this ending, newest first."""
    dated = sorted(
        (-found.st_mtime, path.name)
        for path, found in _there(folder, suffix)
        if not path.stem.endswith(".part") and _NAME.fullmatch(path.name)
    )
    return [name for _, name in dated[:LISTED]]


def _there(folder: Path, suffix: str) -> Iterator[tuple[Path, os.stat_result]]:
    """Yield the files with this ending; not those that lead nowhere, or went meanwhile."""
    for path in folder.glob(f"*{suffix}"):
        with suppress(OSError):
            yield path, path.stat()


def part_folder(database: str) -> Path | None:
    """Return the folder in which the parts of a database lie; None on a server."""
    url = normal_url(database)
    if url.get_backend_name() != "sqlite":
        return None
    return Path(url.database or "").absolute().parent.resolve()


def part_to_send(database: str, folder: Path | None, part: RegisteredPart) -> Path:
    """Return the file of a part; `UnknownError` if it is not in the folder as it was written."""
    found = part_state(normal_url(database), part)
    path = found.path.resolve()
    if folder is None or not path.is_relative_to(folder) or not path.is_file():
        raise UnknownError(
            f"the file of {part.name} cannot be had from here",
            fix="start open-bench with --parts and the folder in which the parts lie",
        )
    if found.state != "ok":
        raise UnknownError(
            f"the file of {part.name} is {found.state}", fix="make it again with encode-object"
        )
    return path


class Uploads:
    """Recordings that pages send; on the server's loop."""

    def __init__(self, folder: Path, ending: Callable[[], bool] = lambda: False) -> None:
        self._folder, self._ending = folder, ending
        self._coming: set[str] = set()

    async def take(self, name: str, chunks: AsyncIterator[bytes]) -> int:
        """Keep a recording, if it is one; returns its frames.

        Raises
        ------
        BenchError, UnknownError
            There is one of this name, or the name is none; no room is left, nothing comes, or
            it is too long to be played.
        BusyError
            Others are being sent in, or the server ends.
        RecordingError
            It is no recording; nothing is kept.
        """
        path = self._folder / checked_name(name, ".h5")
        if path.exists() or name in self._coming:
            raise BenchError(f"there is a recording {name} already", fix="give another name")
        if len(self._coming) >= AT_ONCE:
            raise BusyError(
                f"{len(self._coming)} recordings are being sent in", fix="wait for them"
            )
        self._coming.add(name)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            with staged_file(path, replace=False) as copy:
                sent = copy.with_suffix(".sent.h5")
                try:
                    room = await self._write(sent, chunks)
                    return await run_in_threadpool(
                        convert_recording, sent, copy, name, room=room, ending=self._ending
                    )
                finally:
                    sent.unlink(missing_ok=True)
        finally:
            self._coming.discard(name)

    async def _write(self, draft: Path, chunks: AsyncIterator[bytes]) -> int:
        """Write what comes; returns the bytes that are left for recordings."""
        room = QUOTA - folder_bytes(self._folder)
        began_s, came, coming = time.monotonic(), 0, aiter(chunks)
        with draft.open("wb") as file:
            while True:
                left_s = SILENT_S + came / SLOWEST - (time.monotonic() - began_s)
                try:
                    chunk = await asyncio.wait_for(anext(coming), min(left_s, SILENT_S))
                except StopAsyncIteration:
                    return room
                except TimeoutError:
                    raise BenchError(
                        f"{came:,} bytes came in {time.monotonic() - began_s:.0f} s",
                        fix=f"send it in again, {SLOWEST // 1024} kB a second or more",
                    ) from None
                except ClientDisconnect:
                    raise BenchError(
                        f"the page left after {came:,} bytes", fix="send it in again"
                    ) from None
                came += len(chunk)
                if came > UPLOAD:
                    raise TooLongError(f"more than {UPLOAD:,} bytes", fix="send a part of it")
                if came > room:
                    raise BenchError(
                        f"recordings here take {QUOTA / 1024**3:g} GB already",
                        fix="move old ones elsewhere",
                    )
                file.write(chunk)


def folder_bytes(folder: Path) -> int:
    """Return how much all recordings of a folder take."""
    return sum(found.st_size for _, found in _there(folder, ".h5"))
