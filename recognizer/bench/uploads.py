"""Recordings that are sent in: written as they come, bounded in number, time and space.

How long one may be is bounded by the guard.
"""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import AsyncIterator, Callable
from pathlib import Path

from fastapi.concurrency import run_in_threadpool

from recognizer.bench.errors import BenchError, BusyError
from recognizer.bench.files import checked_name, keep_recording
from recognizer.bench.settings import UPLOAD


class Uploads:
    """What comes in; on the server's loop."""

    def __init__(self, folder: Path, ending: Callable[[], bool] = lambda: False) -> None:
        self._folder, self._ending = folder, ending
        self._coming = 0

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
        if path.exists():
            raise BenchError(f"there is a recording {name} already", fix="give another name")
        if self._coming >= UPLOAD.at_once:
            raise BusyError(f"{self._coming} recordings are being sent in", fix="wait for them")
        self._coming += 1
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=".coming-", dir=self._folder) as place:
                draft = Path(place) / path.name
                await self._write(draft, chunks)
                return await run_in_threadpool(keep_recording, draft, path, self._ending)
        finally:
            self._coming -= 1

    async def _write(self, draft: Path, chunks: AsyncIterator[bytes]) -> None:
        room = UPLOAD.quota - folder_bytes(self._folder)
        coming = aiter(chunks)
        with draft.open("wb") as file:
            while True:
                try:
                    chunk = await asyncio.wait_for(anext(coming), UPLOAD.silent_s)
                except StopAsyncIteration:
                    return
                except TimeoutError:
                    raise BenchError(
                        f"nothing came for {UPLOAD.silent_s:g} s", fix="send it in again"
                    ) from None
                room -= len(chunk)
                if room < 0:
                    raise BenchError(
                        f"recordings here take {UPLOAD.quota / 1024**3:g} GB already",
                        fix="move old ones elsewhere",
                    )
                file.write(chunk)


def folder_bytes(folder: Path) -> int:
    """Return how much all recordings of a folder take."""
    return sum(path.stat().st_size for path in folder.glob("*.h5")) if folder.is_dir() else 0
