"""Files that others wrote: the one door through which their bytes come in.

Only a regular file is opened, or a link to one; its size is checked before its content, and no
more than was allowed is read. What is refused becomes an error of the reader's own, with the file,
the cause and the way out. A file that a library opens by its name (SQLite, MATLAB) passes
`regular_size` first. What only a library can parse, and may crash or never end on, is read in a
process of its own (`run_limited`).
"""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import struct
import sys
import time
import zlib
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

from encoded_objects.base.errors import EncodedObjectsError

if TYPE_CHECKING:
    import subprocess
    from io import BufferedReader
    from zipfile import ZipFile

Refuse = Callable[..., EncodedObjectsError]
"""(cause, fix=..., place=...) -> the error that is raised: a class of errors, as a rule."""

MOST_TEXT: Final = 64 << 20  #: bytes of a JSON file: a calibration of 255 x 255 tactels takes 20 MB
#: what parsers raise on damaged content, besides errors of their own
DAMAGE: Final = (
    ArithmeticError, AttributeError, EOFError, LookupError, MemoryError, RuntimeError, SyntaxError,
    TypeError, ValueError, struct.error, zlib.error,
)  # fmt: skip
_MOST_FILES: Final = 64  #: open at once in a process of its own; ours take a dozen
_LOOK_S: Final = 0.05  #: between two looks at such a process
_IDLE_S: Final = 120.0  #: that one waits to be used

_KINDS: Final = (
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


class NotRegularError(OSError):
    """A folder, a device, a pipe or a socket where a file should be; raised before it is opened."""

    def __init__(self, path: str | os.PathLike[str], mode: int) -> None:
        if stat.S_ISDIR(mode):
            super().__init__(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
            return
        found = next((kind for is_kind, kind in _KINDS if is_kind(mode)), "something else")
        super().__init__(errno.EINVAL, f"it is {found}, not a file", os.fspath(path))


def regular_size(path: str | os.PathLike[str]) -> int:
    """Return the bytes of a regular file; OSError for anything else, which is not opened."""
    try:
        found = os.stat(path)
    except ValueError as error:  # a zero byte in the name
        raise OSError(errno.EINVAL, str(error), os.fspath(path)) from None
    if not stat.S_ISREG(found.st_mode):
        raise NotRegularError(path, found.st_mode)
    return found.st_size


def open_regular(path: str | os.PathLike[str]) -> BufferedReader:
    """Open a regular file for reading; OSError for anything else, at once.

    What stands there is looked at before (to open a device may move it) and after it is opened,
    without waiting for a writer.
    """
    regular_size(path)
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        raise NotRegularError(path, mode)
    return open(descriptor, "rb")


def foreign_bytes(
    path: str | os.PathLike[str], refuse: Refuse, *, most: int, fix: str, large: str = ""
) -> bytes:
    """Return the content of a file of at most `most` bytes.

    Raises what `refuse` returns: the file cannot be read (`fix` is the way out), is no regular
    file, or is too large (`large`).
    """
    place = str(path)
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            content = file.read(most + 1) if size <= most else b""
    except OSError as error:
        raise refuse(f"cannot be read: {error.strerror}", fix=fix, place=place) from error
    size = max(size, len(content))  # it may grow meanwhile
    if size > most:
        cause = f"the file has {_size_words(size)}; {_size_words(most)} are allowed"
        raise refuse(cause, fix=large or fix, place=place)
    return content


def foreign_json(
    path: str | os.PathLike[str], refuse: Refuse, *, fix: str, most: int = MOST_TEXT
) -> Any:
    """Return the value in a JSON file; raises as `foreign_bytes`, also where it is no JSON."""
    content = foreign_bytes(path, refuse, most=most, fix=fix)
    return parse_json(content, refuse, fix=fix, place=str(path))


def parse_json(content: bytes | str, refuse: Refuse, *, fix: str = "", place: str = "") -> Any:
    """Return the value of a JSON text; raises what `refuse` returns where it is none."""
    import json

    try:
        return json.loads(content)
    except RecursionError:
        cause = "is no JSON: too many levels of nesting"
    except ValueError as error:
        cause = f"is no JSON: {error}"
    raise refuse(cause, fix=fix, place=place)


def foreign_member(archive: ZipFile, name: str, most: int) -> bytes:
    """Return a file of an archive that is at most `most` bytes long when unpacked.

    Raises `ValueError` where it is longer, and what is in `DAMAGE`.
    """
    from lzma import LZMAError
    from zipfile import BadZipFile

    try:
        if archive.getinfo(name).file_size > most:  # the archive reads no more than it says here
            raise ValueError(f"{name} takes more than {_size_words(most)} when it is unpacked")
        return archive.read(name)
    except (BadZipFile, LZMAError, NotImplementedError, OSError) as error:
        raise ValueError(str(error)) from error


def waiting_process(*loads: str) -> subprocess.Popen[bytes]:
    """Start a process that loads some modules and waits for `run_limited`, at most `_IDLE_S`.

    It ends with this one.
    """
    import subprocess

    from encoded_objects.base.console import MATRIX_LIBRARIES

    path = os.pathsep.join(entry for entry in sys.path if entry)
    one_thread = {f"{name}_NUM_THREADS": "1" for name in MATRIX_LIBRARIES}
    return subprocess.Popen(  # noqa: S603 - our own module, no shell
        [sys.executable, "-m", __name__, *loads],
        env={**os.environ, **one_thread, "PYTHONPATH": path, "PYTHONSAFEPATH": "1"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )


def run_limited(
    module: str,
    arguments: Sequence[str],
    *,
    memory_bytes: int,
    cpu_s: float,
    written_bytes: int,
    folder: str | os.PathLike[str] | None = None,
    ending: Callable[[], bool] = lambda: False,
    waiting: subprocess.Popen[bytes] | None = None,
) -> tuple[int, bytes]:
    """Run a module of ours in a process of its own; return its exit code and what it printed.

    It works in `folder`, the current one by default; in the process that is `waiting`, if it is.

    The system ends it where it takes more memory (address space), time or room of one file; the
    code is negative then: the number of the signal. `ending` ends it at any time.

    Raises `TimeoutError` where it waits longer than `cpu_s` without working.
    """
    import json
    import subprocess

    there = waiting is not None and waiting.poll() is None
    limits = (memory_bytes, max(1, round(cpu_s)), written_bytes)
    with waiting if waiting is not None and there else waiting_process() as process:
        until_s = time.monotonic() + 2 * cpu_s + 10.0
        try:
            assert process.stdin is not None
            process.stdin.write(
                json.dumps([os.fspath(folder or "."), limits, module, *arguments]).encode()
            )
            process.stdin.close()
            process.stdin = None
            while not ending():
                with contextlib.suppress(subprocess.TimeoutExpired):
                    printed, _ = process.communicate(timeout=_LOOK_S)
                    return process.returncode, printed
                if time.monotonic() > until_s:
                    raise TimeoutError(f"{module} did not end in time")
        finally:
            process.kill()
    return process.returncode, b""


def _size_words(size: int) -> str:
    return f"{size / 2**20:.0f} MB" if size >= 10 << 20 else f"{-(-size // 1024)} KiB"


def _main(*loads: str) -> None:
    import json
    import resource
    import runpy
    from importlib import import_module
    from select import select

    for name in loads:
        import_module(name)
    if not select([sys.stdin], [], [], _IDLE_S)[0] or not (told := sys.stdin.buffer.read()):
        return
    folder, (memory_bytes, cpu_s, written_bytes), module, *arguments = json.loads(told)
    for limit, most in (
        (resource.RLIMIT_AS, memory_bytes),
        (resource.RLIMIT_CPU, cpu_s),
        (resource.RLIMIT_FSIZE, written_bytes),
        (resource.RLIMIT_NOFILE, _MOST_FILES),
        (resource.RLIMIT_CORE, 0),
    ):
        _, allowed = resource.getrlimit(limit)
        if allowed != resource.RLIM_INFINITY:
            most = min(most, allowed)
        resource.setrlimit(limit, (most, most))
    os.chdir(folder)
    sys.argv = [module, *arguments]
    runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _main(*sys.argv[1:])
