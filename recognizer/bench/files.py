"""What the page may read and write: recordings and calibrations of one folder, printed parts.

A name is a name: no path, no link that leads out. Parts are those that the database names, and
only where they lie in its folder.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from generator.database.open import normal_url, part_path
from generator.database.registered import RegisteredPart
from probe.errors import RecordingError
from probe.recording.read import Recording
from recognizer.bench.errors import UnknownError
from recognizer.bench.replay import playable_blocks
from recognizer.bench.settings import PAGE

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}")


def find_file(folder: Path, name: str, suffix: str) -> Path:
    """Return a file of the folder.

    Raises
    ------
    UnknownError
        When the name is none, or no such file is there.
    """
    path = folder / checked_name(name, suffix)
    if not path.is_file() or path.resolve().parent != folder.resolve():
        raise UnknownError(f"there is no file {name}", fix="choose one from the list")
    return path


def checked_name(name: str, suffix: str) -> str:
    """Return a name that can only mean a file of its folder.

    Raises
    ------
    UnknownError
        When it can mean something else.
    """
    if not _NAME.fullmatch(name) or not name.endswith(suffix) or ".." in name:
        raise UnknownError(
            f"{name[:60]!r} is no name of a file here",
            fix=f"give letters, digits, . _ - and the ending {suffix}",
        )
    return name


def list_files(folder: Path, suffix: str) -> list[str]:
    """Return the names of the newest files with this ending, newest first."""
    if not folder.is_dir():
        return []
    found = [
        path
        for path in folder.iterdir()
        if path.name.endswith(suffix)
        and not path.stem.endswith(".part")
        and _NAME.fullmatch(path.name)
    ]
    dated = sorted((-path.stat().st_mtime, path.name) for path in found)
    return [name for _, name in dated[: PAGE.listed]]


def keep_recording(draft: Path, path: Path, ending: Callable[[], bool]) -> int:
    """Give a file that was sent in its name, if it is a recording; returns its frames.

    Raises
    ------
    RecordingError
        It is none.
    BenchError
        It is too long to be played.
    BusyError
        `ending` says that the server ends.
    """
    try:
        recording = Recording(draft)
        for _ in playable_blocks(recording, ending):  # every value is looked at
            pass
    except RecordingError as error:
        raise RecordingError(error.cause, fix=error.fix, place=path.name) from error
    draft.rename(path)
    return len(recording)


def part_folder(database: str) -> Path | None:
    """Return the folder in which the parts of a database lie; None on a server."""
    url = normal_url(database)
    if url.get_backend_name() != "sqlite":
        return None
    return Path(url.database or "").absolute().parent.resolve()


def part_to_send(database: str, folder: Path | None, part: RegisteredPart) -> Path:
    """Return the file of a part, if it lies in the part folder.

    Raises
    ------
    UnknownError
        When it does not, or is not there.
    """
    path = part_path(normal_url(database), part.file).resolve()
    if folder is None or not path.is_relative_to(folder) or not path.is_file():
        raise UnknownError(
            f"the file of {part.name} cannot be had from here",
            fix="start open-bench with --parts and the folder in which the parts lie",
        )
    return path
