"""Write all files of an object, or none.

`Staging` holds a hidden folder `.encode-object-<process>` in the output folder. Files are
written there, flushed to the disk, and moved under their final names by `commit`; leaving
without `commit` removes everything, also the folders that were made for it. The hidden folder of
a process that died is removed by the next one. Whether its owner lives is read from the lock that
the owner holds on the folder, not from the process number, which may be reused or belong to
another container.
"""

from __future__ import annotations

import errno
import fcntl
import filecmp
import hashlib
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from generator.errors import FileThereError, WriteError

_PREFIX = ".encode-object-"


@dataclass(frozen=True, slots=True)
class StagedFile:
    """A file that waits to be moved under its final name."""

    path: Path  #: final name
    staged: Path  #: where it is until then
    size: int  #: bytes
    sha256: str = ""  #: of its bytes, where it was asked for


class Staging:
    """Files that appear together in a folder, which is made if it is not there.

    Raises `WriteError` if the folder cannot be made, or a file cannot be written or moved.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> with Staging(folder) as staging:
    ...     written = staging.write("a.txt", b"abc")
    ...     files = staging.commit()
    >>> [path.name for path in folder.iterdir()]
    ['a.txt']
    """

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder)
        self.written: list[StagedFile] = []
        self._made: list[Path] = []
        self._lock = -1

    def __enter__(self) -> Staging:
        with _named_errors(self.folder, "make the folder"):
            ways = (self.folder, *self.folder.parents)
            self._made = [path for path in ways if not path.exists()]  # the innermost first
            self.folder.mkdir(parents=True, exist_ok=True)
        try:
            with _named_errors(self.folder, "write into the folder"):
                remove_leftovers(self.folder)
                self._hidden, self._lock = _locked_folder(self.folder)
        except BaseException:
            self._remove_made()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        shutil.rmtree(self._hidden, ignore_errors=True)
        os.close(self._lock)
        self._remove_made()

    def write(
        self, name: str, content: bytes | Iterable[bytes | memoryview], *, digest: bool = False
    ) -> StagedFile:
        """Write one file into the staging folder, from bytes or from a stream of pieces.

        With `digest` its sha256 is returned: of a large file that takes as long as writing it.
        """
        final = self.folder / name
        pieces = (content,) if isinstance(content, bytes) else content
        sha256 = hashlib.sha256()
        size = 0
        with _named_errors(final, "write the file"):
            if final.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(final))
            with open(self._hidden / name, "xb") as file:
                for piece in pieces:
                    file.write(piece)
                    size += len(piece)
                    if digest:
                        sha256.update(piece)
                file.flush()
                os.fsync(file.fileno())
        checksum = sha256.hexdigest() if digest else ""
        self.written.append(StagedFile(final, self._hidden / name, size, checksum))
        return self.written[-1]

    def refuse_others(self) -> None:
        """Refuse to replace files that are other ones than were written here.

        Raises
        ------
        FileThereError
            Names the first of them.
        """
        for written in self.written:
            if written.path.exists() and not filecmp.cmp(
                written.staged, written.path, shallow=False
            ):
                raise FileThereError(
                    "there is a file of this name, and no object of this database has made it",
                    fix="move it, choose another folder with -o, or replace it with --replace",
                    place=str(written.path),
                )

    def commit(self) -> tuple[StagedFile, ...]:
        """Move all files under their final names; files of those names are replaced.

        Each file is whole at any moment; a process killed between two moves leaves some old
        and some new files, and the rest of the new ones is removed by the next run.
        """
        for written in self.written:
            with _named_errors(written.path, "replace the file"):
                os.replace(self._hidden / written.path.name, written.path)
        with _named_errors(self.folder, "write into the folder"):
            _flush_folder(self.folder)
        done, self.written = tuple(self.written), []
        return done

    def _remove_made(self) -> None:
        """Remove the folders that were made and are empty, the innermost first."""
        for folder in self._made:
            try:
                folder.rmdir()
            except OSError:
                return


def _locked_folder(folder: Path) -> tuple[Path, int]:
    """Make a hidden folder that this process has locked; return it and the lock."""
    number = 0
    while True:
        hidden = folder / (f"{_PREFIX}{os.getpid()}" + (f"-{number}" if number else ""))
        number += 1
        try:
            hidden.mkdir()
        except FileExistsError:
            continue
        try:
            lock = os.open(hidden, os.O_RDONLY)
        except FileNotFoundError:
            continue
        fcntl.flock(lock, fcntl.LOCK_EX)
        # Another process may have taken the folder for a leftover before it was locked.
        if hidden.exists() and os.path.samestat(os.fstat(lock), hidden.stat()):
            return hidden, lock
        os.close(lock)


def remove_leftovers(folder: Path, *, below: bool = False) -> None:
    """Remove the hidden folders whose owner is gone, `below`: of the folders in this one."""
    for hidden in sorted(folder.glob("*/" * below + _PREFIX + "*")):
        try:
            lock = os.open(hidden, os.O_RDONLY)
        except OSError:
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(hidden, ignore_errors=True)
        except BlockingIOError:
            pass  # its owner is at work
        finally:
            os.close(lock)


def _flush_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def _named_errors(path: Path, action: str) -> Iterator[None]:
    """Turn an error of the operating system into one that names place, cause and way out."""
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        fix = _FIXES.get(error.errno or 0, "check the folder or choose another one with -o")
        if error.errno == errno.ENAMETOOLONG and action.endswith("folder"):
            fix = "choose a folder of a shorter name with -o"
        raise WriteError(f"cannot {action}: {reason}", fix=fix, place=str(path)) from error


_OTHER_FOLDER = "choose a folder that you may write with -o"
_FIXES = {
    errno.ENOSPC: "free some space or choose a folder on another disk with -o",
    errno.EDQUOT: "free some of your quota or choose a folder on another disk with -o",
    errno.EFBIG: "choose a folder on a file system that takes larger files with -o",
    errno.EACCES: _OTHER_FOLDER,
    errno.EPERM: _OTHER_FOLDER,
    errno.EROFS: _OTHER_FOLDER,
    errno.ENOTDIR: "a file stands where the folder should be: move it or choose another -o",
    errno.EEXIST: "a file stands where the folder should be: move it or choose another -o",
    errno.EISDIR: "a folder has the name of the file: move it or choose another -o",
    errno.ENAMETOOLONG: "give the object a shorter name",
    errno.ENOENT: "no folder can be made there, or it was removed meanwhile: choose another -o, or "
    "run the command again",
}
